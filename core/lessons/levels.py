"""Lesson "levels": the hierarchy level by level, whoever built it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import INNER_COLOUR, depth_colours
from ..contract.cells import Cells
from ..contract.outlines import Wires, wires_of
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import counted
from .hierarchy import is_tree, tree_of
from .lesson import Lesson, Play, Subject
from .picture import MOST_SEGMENTS, Picture, Row

FAINT = 0.35
"""Opacity of what is not the subject of a frame."""

MOST_VOLUMES = 600
"""Volumes of a level that are drawn: of more, the largest."""

ON_PAGE = 0, 2, 4, 8
"""Levels that pictures show."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    level: int = setting(1, "Level", "Level of the tree; the root has 0", minimum=0)


class Levels(Play):
    """The levels of one hierarchy; leaves above a level are drawn with it, so that all of the scene
    is in the volumes of each picture.
    """

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.cells = bvh.cells(progress)
        self.areas = self.cells.attributes()["area"]
        self.deepest = int(bvh.depths().max())
        self.ends = {"level": self.deepest}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one level."""
        cells, level = self.cells, settings.level
        on_level = cells.depth == level
        above = cells.is_leaf & (cells.depth < level)
        # The leaves above only where there is room, and large ones before small ones.
        shown = np.flatnonzero(on_level | above)
        best_first = shown[np.lexsort((-self.areas[shown], ~on_level[shown]))]
        places, wires = first_that_fit(cells, best_first)
        bright = on_level[wires.edge_owners()]
        colours = np.empty((len(bright), 4))
        colours[~bright] = *INNER_COLOUR, FAINT
        colours[bright] = *depth_colours(np.array([level]), self.deepest)[0], 1.0

        n_nodes, n_above = int(on_level.sum()), int(above.sum())
        n_leaves = int((on_level & cells.is_leaf).sum())
        parts = [f"Level {level} of {self.deepest}: {counted(n_nodes, 'node', 'nodes')}"]
        if n_leaves:
            parts.append(f"{counted(n_leaves, 'leaf', 'leaves')} among them")
        if n_above:
            parts.append(f"grey: {counted(n_above, 'leaf', 'leaves')} above")
        if self.areas[0] > 0.0:
            share = self.areas[on_level | above].sum() / self.areas[0]
            parts.append(f"together {share:.2f} times the root's surface")
        if len(places) < (on_level | above).sum():
            parts.append(f"drawn: {counted(len(places), 'volume', 'volumes')}")
        rows = (
            Row("Nodes on the Level", str(n_nodes), "Inner nodes and leaves"),
            Row("Leaves among Them", str(n_leaves), "Nodes with primitives of their own"),
        )
        return Picture("; ".join(parts), wires.segments(), colours, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the levels that pictures show."""
        return [Settings(level) for level in ON_PAGE if level <= self.ends["level"]]


def first_that_fit(cells: Cells, best_first: np.ndarray) -> tuple[np.ndarray, Wires]:
    """Return places, ascending, and edges of the first of some cells, as many as are legible."""
    places = np.sort(best_first[:MOST_VOLUMES])
    wires = wires_of(cells, places)
    counts = np.bincount(wires.edge_owners(), minlength=len(cells))[best_first[: len(places)]]
    most = int(np.searchsorted(np.cumsum(counts), MOST_SEGMENTS, side="right"))
    if most < len(places):
        places = np.sort(best_first[:most])
        wires = wires_of(cells, places)
    return places, wires


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at the cells of the hierarchy."""
    return Levels(tree_of(subject), progress)


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
        suits=is_tree,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
