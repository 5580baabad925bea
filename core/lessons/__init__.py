"""Lessons: one file for each idea that is shown.

A module in this folder that defines ``LESSONS`` is found by itself.
"""

from __future__ import annotations

import difflib
import functools
import importlib
import pkgutil
from collections.abc import Sequence

from ..contract.structure import Structure
from ..errors import InputError
from ..structures.bvh.hierarchy import BVH
from .efficiency import nodes_not_paying, overlapping_siblings
from .exhibit import Exhibit
from .kdop import kdop_levels
from .lesson import Lesson, any_structure
from .levels import levels
from .moment import Moment
from .morton_intervals import morton_curve
from .parallel_sah import parallel_exhibits
from .ploc import ploc_exhibits
from .radix_sort import radix_exhibits
from .rearranging import rearranging_exhibits
from .refit import refit_over_timeline
from .sah_decision import split_planes
from .sbvh import spatial_splits
from .solid_efficiency import volume_efficiency
from .split_curve import cost_curve


@functools.cache
def lessons() -> dict[str, Lesson]:
    """Return every lesson by name, in the order of the slides."""
    found: list[Lesson] = []
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name):
        found += getattr(importlib.import_module(f"{__name__}.{module.name}"), "LESSONS", ())
    return {lesson.name: lesson for lesson in sorted(found, key=lambda lesson: lesson.place)}


def lesson_named(name: str) -> Lesson:
    """Return the lesson called `name`.

    Raises
    ------
    InputError
        Naming those whose names are alike.
    """
    try:
        return lessons()[name]
    except KeyError:
        alike = " or ".join(difflib.get_close_matches(name, lessons()))
        meant = f"; perhaps {alike} is meant" if alike else ""
        said = f"there is no lesson '{name}'{meant}; accelscope lessons lists them"
        raise InputError(said) from None


def lessons_about(structure: Structure) -> list[Lesson]:
    """Return the lessons that are about structures of one kind, of which this one is."""
    return [
        lesson
        for lesson in lessons().values()
        if len(lesson.structures) == 1
        and lesson.suits is not any_structure
        and not lesson.suits(structure)
    ]


OF_TREE = (
    levels, kdop_levels, split_planes, nodes_not_paying, overlapping_siblings, volume_efficiency
)  # fmt: skip
"""Exhibits of any hierarchy, whatever became of it."""

OF_BUILDING = (
    cost_curve, parallel_exhibits, morton_curve, radix_exhibits, ploc_exhibits,
    rearranging_exhibits, spatial_splits,
)  # fmt: skip
"""Exhibits of how a hierarchy was built, if it was built so and kept a log."""


def exhibits_of(structure: Structure, history: Sequence[Moment] = ()) -> list[Exhibit]:
    """Return what there is to show of a structure and of how it was built: of hierarchies only.

    Cheap, frames are made on demand. What explains the building reads its log, over the triangles
    the tree has now. One that was refitted has none, since those are elsewhere.

    Parameters
    ----------
    history : sequence of Moment
        The animation over which such a structure was refitted, if it was.
    """
    exhibits = exhibits_of_hierarchy(structure) if isinstance(structure, BVH) else []
    if history:
        exhibits.insert(len(OF_TREE), refit_over_timeline(history))
    return exhibits


def exhibits_left_out(structure: Structure) -> str:
    """Say why exhibits that such structures usually have are not offered; empty if none are."""
    if not isinstance(structure, BVH) or structure.build_log is not None:
        return ""
    if structure.is_refitted:
        return (
            "Exhibits of the building are not shown after a refit, since the triangles have moved. "
            "Build to see them"
        )
    return "Exhibits of the building are not shown, since no log of it was asked for"


def exhibits_of_hierarchy(bvh: BVH) -> list[Exhibit]:
    """Return the exhibits of a hierarchy."""
    exhibits = [make(bvh) for make in OF_TREE]
    if (log := bvh.build_log) is not None:
        for make_of_building in OF_BUILDING:
            exhibits += make_of_building(bvh, log)
    return exhibits
