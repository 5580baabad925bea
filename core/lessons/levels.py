"""Lesson "levels": the hierarchy level by level, whoever built it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import INNER_COLOUR, depth_colours
from ..contract.cells import Cells
from ..contract.outlines import Wires, wires_of
from ..progress import SILENT, Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import counted
from .exhibit import MOST_SEGMENTS, Exhibit, Frame, Once
from .lesson import Lesson, Play, Subject
from .picture import Picture, Row

FAINT = 0.35
"""Opacity of what is not the subject of a frame."""

ON_PAGE = 0, 2, 4, 8
"""Levels that pictures show."""


def levels(bvh: BVH) -> Exhibit:
    """Return the hierarchy level by level, as on the lecture's slides of k-DOP trees.

    Leaves above the level are drawn, too, so that the volumes of each frame contain everything.
    """
    cells_of = Once(bvh.cells)
    deepest = int(bvh.depths().max())

    def frame(level: int, progress: Progress = SILENT) -> Frame:
        cells = cells_of(progress)
        areas = cells.attributes()["area"]
        on_level = cells.depth == level
        above = cells.is_leaf & (cells.depth < level)
        # The leaves above only where there is room, and large ones before small ones.
        shown = np.flatnonzero(on_level | above)
        progress.report(0, 1, "Choosing volumes")
        best_first = shown[np.lexsort((-areas[shown], ~on_level[shown]))]
        places, wires = first_that_fit(cells, best_first, progress)
        bright = on_level[wires.edge_owners()]
        colours = np.empty((len(bright), 4))
        colours[~bright] = *INNER_COLOUR, FAINT
        colours[bright] = *depth_colours(np.array([level]), deepest)[0], 1.0

        n_leaves, n_above = int((on_level & cells.is_leaf).sum()), int(above.sum())
        parts = [f"Level {level} of {deepest}: {counted(int(on_level.sum()), 'node', 'nodes')}"]
        if n_leaves:
            parts.append(f"{counted(n_leaves, 'leaf', 'leaves')} among them")
        if n_above:
            parts.append(f"grey: {counted(n_above, 'leaf', 'leaves')} above")
        if areas[0] > 0.0:
            share = areas[on_level | above].sum() / areas[0]
            parts.append(f"together {share:.2f} times the root's surface")
        if len(places) < (on_level | above).sum():
            parts.append(f"drawn: {counted(len(places), 'volume', 'volumes')}")
        return Frame(wires.segments(), colours, "; ".join(parts))

    return Exhibit(
        "levels",
        "Levels",
        "The volumes of one level after the other",
        deepest + 1,
        frame,
        on_page=tuple(level for level in ON_PAGE if level <= deepest),
    )


def first_that_fit(
    cells: Cells, best_first: np.ndarray, progress: Progress
) -> tuple[np.ndarray, Wires]:
    """Return places, ascending, and edges of the first of some cells, up to a frame's limit.

    No more are looked at than would fit with six edges each, as a tetrahedron has: of flat cells,
    which have fewer, there may be room for more than are returned.
    """
    places = np.sort(best_first[: MOST_SEGMENTS // 6])
    wires = wires_of(cells, places, progress)
    counts = np.bincount(wires.edge_owners(), minlength=len(cells))[best_first[: len(places)]]
    most = int(np.searchsorted(np.cumsum(counts), MOST_SEGMENTS, side="right"))
    if most < len(places):
        places = np.sort(best_first[:most])
        wires = wires_of(cells, places, progress)
    return places, wires


# ------------------------------------------------------------------------------------ the lesson


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    level: int = setting(1, "Level", "Level of the tree; the root has 0", minimum=0)


class Levels(Play):
    """The levels of one hierarchy."""

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.exhibit = levels(bvh)
        self.exhibit.frame(0, progress)  # looks at the cells
        self.ends = {"level": self.exhibit.count - 1}
        depths = bvh.depths()
        self.nodes, self.leaves = np.bincount(depths), np.bincount(depths[bvh.arrays.size > 0])

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one level."""
        frame, level = self.exhibit.frame(settings.level), settings.level
        n_leaves = int(self.leaves[level]) if level < len(self.leaves) else 0
        rows = (
            Row("Nodes on the Level", str(int(self.nodes[level])), "Inner nodes and leaves"),
            Row("Leaves among Them", str(n_leaves), "Nodes with primitives of their own"),
        )
        return Picture(frame.caption, frame.segments, frame.colours, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the levels that pictures show."""
        return [Settings(level) for level in ON_PAGE if level <= self.ends["level"]]


def has_nodes(structure: Any) -> str:
    """Accept hierarchies, see :attr:`.lesson.Lesson.suits`."""
    return "" if isinstance(structure, BVH) else f"{structure.label} is no hierarchy of volumes"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at the cells of the hierarchy."""
    bvh = subject.structures[0]
    assert isinstance(bvh, BVH)
    return Levels(bvh, progress)


LESSONS = (
    Lesson(
        name="levels",
        label="A Hierarchy Level by Level",
        slide="Bounding Volume Hierarchy (BVH)",
        begin="A bounding volume hierarchy is a tree of volumes: each encloses what is below it",
        look_for="Every level encloses the whole object, and does it more tightly than the one "
        "above; siblings may overlap, and empty space falls away",
        question="Why may the volumes of one level together have more surface than the root, and "
        "the tree be good all the same?",
        answer="A ray tests a node only if it has hit the parent. What counts is the surface of "
        "each node in relation to the root's, weighted by what is to be tested there: the SAH cost",
        source="structures.bvh.hierarchy",
        sample="suzanne:subdivisions=3",
        structures=("bvh",),
        suits=has_nodes,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
