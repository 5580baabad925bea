"""What lessons about a hierarchy share: the tree and its log, and why another structure is none."""

from __future__ import annotations

from typing import Any

from ..contract.build_log import BuildLog
from ..progress import Progress
from ..structures.bvh.hierarchy import BVH
from .lesson import Subject


def tree_of(subject: Subject) -> BVH:
    """Return the hierarchy that a lesson is about."""
    bvh = subject.structures[0]
    assert isinstance(bvh, BVH)
    return bvh


def tree_and_log(subject: Subject, progress: Progress) -> tuple[BVH, BuildLog]:
    """Return the hierarchy that a lesson is about, and how it was built.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    bvh, text = tree_of(subject), "Reading the build log"
    progress.report(0, 1, text)
    log = bvh.build_log  # put together now, if nobody has looked at it before
    progress.report(1, 1, text)
    assert log is not None
    return bvh, log


def is_tree(structure: Any) -> str:
    """Accept hierarchies, see :attr:`.lesson.Lesson.suits`."""
    return "" if isinstance(structure, BVH) else f"{structure.label} is no hierarchy of volumes"


def has_log(structure: Any) -> str:
    """Accept structures that say how they were built, see :attr:`.lesson.Lesson.suits`."""
    return "" if structure.keeps_log else "no log of its building was kept; build it anew"
