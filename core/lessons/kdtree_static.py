"""Lesson "kd-tree, static variant": planes in the middle, across x, y and z in turn.

The slide shows the cuts of one tree. Here they come level by level: the planes of the level in the
colour of their axis (x blue, y green, z orange), each clipped to its cell; those of levels above
are outlines. The planes are those that the tree stores.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.outlines import outlines_of, triangles_of
from ..geometry.polygons import Polygons
from ..progress import Progress
from ..settings import setting
from ..structures.kdtree import KdTree
from .drawing import BLUE, GREEN, GREY, ORANGE, Faces, Lines, counted, picture_of
from .lesson import Lesson, Play, Subject
from .picture import Picture, Row

AXIS_COLOURS = np.array([BLUE, GREEN, ORANGE])
AXES = "xyz"

MOST_PLANES = 2000
"""Planes of the level that are drawn, and of those above: the largest."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    level: int = setting(2, "Level", "Whose planes are drawn; the root's has 0", minimum=0)


class KdTreeStatic(Play):
    """The planes of a kd-tree by levels."""

    def __init__(self, tree: KdTree, progress: Progress) -> None:
        cells = tree.cells(progress).own()
        assert cells.planes is not None
        self.tree, self.planes, self.cells = tree, cells.planes, cells
        owners = cells.planes.owners
        self.depth = cells.depth[owners]
        corners = cells.planes.points.reshape(-1, 4, 3)
        size = np.ptp(corners, axis=1)
        # A plane is flat along its axis; of a plane that is a line, what the tree says.
        self.axis = tree.arrays.tree.link[cells.numbers[owners]] & 3
        self.area = np.sort(size, axis=1)[:, 1:].prod(axis=1)
        self.ends = {"level": int(self.depth.max(initial=0))}

    def picture(self, settings: Settings) -> Picture:
        """Return the planes of a level, and outlines of those above."""
        level = settings.level
        now, above = np.flatnonzero(self.depth == level), np.flatnonzero(self.depth < level)
        drawn = [self.largest(now), self.largest(above)]
        parts: list[Lines | Faces] = []
        for chosen, is_now in zip(drawn[::-1], (False, True), strict=True):
            polygons = chosen_from(self.planes, chosen)
            wires = outlines_of(polygons._replace(owners=np.arange(len(chosen))))
            colours = AXIS_COLOURS[self.axis[chosen]][wires.edge_owners()].copy()
            if not is_now:
                colours[:] = *GREY[:3], 0.35
            parts.append(Lines(wires.segments(), colours))
            if is_now and len(chosen):
                triangles, owner = triangles_of(polygons._replace(owners=np.arange(len(chosen))))
                fills = AXIS_COLOURS[self.axis[chosen]][owner].copy()
                fills[:, 3] = 0.22
                parts.append(Faces(triangles, fills))
        across = np.bincount(self.axis[now], minlength=3)
        named = ", ".join(
            f"{counted(int(count), 'plane', 'planes')} across {AXES[axis]}"
            for axis, count in enumerate(across)
            if count
        )
        cells = self.cells
        leaves = int((cells.is_leaf & (cells.depth <= level + 1)).sum())
        reached = int((cells.depth == level + 1).sum()) + int(
            (cells.is_leaf & (cells.depth <= level)).sum()
        )
        rows = (
            Row("Planes of the Level", str(len(now)), "Each cuts one cell in two"),
            Row("Axis", ", ".join(AXES[a] for a in np.flatnonzero(across)) or "none",
                "Across which axes the planes of the level lie"),
            Row("Cells", str(reached), "Of the scene's box, after these cuts"),
            Row("Leaves among Them", str(leaves), "They are not cut any more"),
        )  # fmt: skip
        caption = f"Level {level} of {self.ends['level']}: {named or 'nothing is cut'}"
        if len(drawn[0]) < len(now):
            caption += f", drawn: the largest {len(drawn[0])}"
        return picture_of(parts, f"{caption}; {counted(reached, 'cell', 'cells')} now", rows=rows)

    def largest(self, planes: np.ndarray) -> np.ndarray:
        """Return the largest of some planes, ascending, as many as are drawn."""
        return np.sort(planes[np.argsort(-self.area[planes], kind="stable")[:MOST_PLANES]])


def chosen_from(planes: Polygons, chosen: np.ndarray) -> Polygons:
    """Return some of a list of rectangles."""
    corners = planes.points.reshape(-1, 4, 3)[chosen]
    offsets = 4 * np.arange(len(chosen) + 1, dtype=np.int64)
    return Polygons(corners.reshape(-1, 3), offsets, planes.owners[chosen])


def is_kdtree(structure: object) -> str:
    """Accept kd-trees, whoever places their planes, see :attr:`.lesson.Lesson.suits`."""
    if isinstance(structure, KdTree):
        return ""
    return f"{getattr(structure, 'label', structure)} is no kd-tree"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at the planes."""
    tree = subject.structures[0]
    assert isinstance(tree, KdTree)
    progress.report(0, 1, "Looking at the planes")
    return KdTreeStatic(tree, progress)


LESSONS = (
    Lesson(
        name="kdtree_static",
        label="The Static kd-Tree",
        slide="KD-tree (static variant)",
        begin="A static kd-tree cuts every cell in the middle, across x, then y, then z, and again",
        look_for="All planes of one level have the same axis and colour; cells with few objects "
        "are left alone, so later levels cut only where there is much",
        question="What does such a tree need not store about its planes?",
        answer="Neither axis nor position: the axis is the level modulo 3, the position the middle "
        "of the cell, and both follow on the way down",
        source="structures.kdtree.static",
        sample="suzanne:subdivisions=2",
        structures=("kdtree:planes=cyclic,max_leaf_size=32",),
        suits=is_kdtree,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
