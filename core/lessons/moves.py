"""Moves of an optimiser, the greatest of them: what lessons on rearranged trees share.

How the tree was at that time comes from making the moves of the log again, from the tree as it was
built (:mod:`..structures.bvh.optimisers.replay`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from ..contract.build_log import MOVE, REINSERT, BuildLog
from ..errors import InputError
from ..geometry.box_shape import box_segments, surface_area
from ..progress import Progress
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.optimisers.replay import Replay
from .drawing import Colour, Lines, coloured
from .hierarchy import has_log, is_tree

MOST_MOVES = 24
"""Moves that are shown."""

TEXT = "Making the moves of the log again"

T = TypeVar("T")


def moves_made(log: BuildLog) -> int:
    """Return how many moves the log has."""
    return int((np.isin(log.kind, (MOVE, REINSERT)) & ~np.isnan(log.cost)).sum())


def was_rearranged(structure: Any, names: Sequence[str]) -> str:
    """Accept trees that one of some optimisers has rearranged, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if structure.rearrangement is None or structure.settings.optimise not in names:
        return f"it was not rearranged by {' or '.join(names)}"
    return has_log(structure)


def replayed(
    bvh: BVH, log: BuildLog, look: Callable[[Replay, int, Progress], T], progress: Progress
) -> list[T]:
    """Return what a look at each of the greatest moves has found, the greatest first.

    Parameters
    ----------
    look : callable
        Gets the tree before a move, and the number of that; it may make the move.

    Raises
    ------
    InputError
        If there was no move, or the tree as it was built was kept.
    Cancelled
        From `progress`.
    """
    progress.report(0, 1, TEXT)
    if not moves_made(log):
        raise InputError(
            "nothing of this tree was moved: it could not be made cheaper so; choose a mesh of "
            "more triangles, or another builder"
        )
    replay = Replay(log, bvh.reference_boxes())
    progress.report(0, 1, TEXT)
    greatest = np.argsort(-replay.gains, kind="stable")[:MOST_MOVES]
    found = {}
    for number in np.sort(greatest).tolist():
        replay.go_on(int(replay.moves[number, 0]), progress, TEXT)
        found[number] = look(replay, number, progress)
    return [found[number] for number in greatest.tolist()]


def union(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the box (6,) around two boxes."""
    return np.concatenate([np.minimum(a[:3], b[:3]), np.maximum(a[3:], b[3:])])


def around(box: np.ndarray, colour: Colour) -> Lines:
    """Return the edges of a box."""
    return coloured(box_segments(box[None]), colour)


def share_of(structure: BVH, box: np.ndarray) -> float:
    """Return the area of a box as a share of the root's."""
    root = float(surface_area(structure.arrays.volumes.boxes()[0])) or 1.0
    return float(surface_area(box)) / root
