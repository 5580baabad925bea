"""Lesson "two levels": boxes of instances in the world, boxes of a bottom level in its own space.

Grey and in colours: nodes of the top level. Orange: boxes of instances, which are its items, those
of the chosen mesh stronger than others. Beside the scene stands the space of that mesh, in which
its own tree lies; blue is one level of that tree, in its space and in all places in which the mesh
is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import depth_colours
from ..contract.outlines import wires_of
from ..geometry.box_shape import box_segments, surface_area
from ..geometry.instances import levels_of_mesh, moved_points, stored_in
from ..memory import in_words
from ..progress import Progress
from ..settings import setting
from ..structures.two_level import TwoLevel
from .drawing import BLUE, GREY, ORANGE, coloured, counted, faint, picture_of
from .lesson import Lesson, Play, Subject
from .object_space import ObjectSpace, is_two_level
from .picture import Mark, Picture, Row

MOST_BOXES = 300
"""Of a kind that are drawn: of more, the largest."""

MOST_PLACES = 40
"""In which the boxes of a mesh are drawn, if they are drawn in all."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    level: int = setting(
        0, "Level", "First the levels of the top level, then instances, then levels of the mesh",
        minimum=0,
    )  # fmt: skip
    mesh: int = setting(
        0, "Mesh", "Whose tree and places are shown; 0 is that with most instances", minimum=0
    )
    everywhere: bool = setting(
        True, "In All Places", "Show the mesh wherever an instance of it is, too"
    )


class TwoLevels(Play):
    """Both levels of one structure."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        structure = subject.structures[0]
        assert isinstance(structure, TwoLevel)
        self.structure, self.scene = structure, structure.scene
        self.geometry = structure.scene.geometry
        self.cells = structure.cells(progress)
        self.deepest = int(self.cells.depth.max())
        uses = np.bincount(self.geometry.which, minlength=len(self.geometry.meshes))
        self.meshes = np.argsort(-uses, kind="stable")
        self.uses = uses
        self.spaces: dict[int, ObjectSpace] = {}
        deepest_within = 0
        if levels_of_mesh(self.geometry) == 1:
            for number in range(len(self.geometry.meshes)):
                cells = structure.bottom_of(self.geometry.meshes[number]).cells()
                deepest_within = max(deepest_within, int(cells.depth.max()))
        self.ends = {
            "level": self.deepest + 1 + deepest_within + 1, "mesh": len(self.meshes) - 1
        }  # fmt: skip

    def space(self, mesh: int) -> ObjectSpace:
        """Return the space of a mesh; it is put beside the scene but once."""
        if mesh not in self.spaces:
            geometry = self.geometry.meshes[mesh]
            self.spaces[mesh] = ObjectSpace(self.scene, self.structure, geometry)
        return self.spaces[mesh]

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one level."""
        if settings.level <= self.deepest:
            return self._top(settings)
        if levels_of_mesh(self.geometry) > 1 or settings.level == self.deepest + 1:
            return self._instances(settings)
        return self._mesh(settings, settings.level - self.deepest - 2)

    def _places(self, settings: Settings) -> np.ndarray:
        """Return the instances in whose places the mesh is shown."""
        is_shown = self.geometry.which == self.meshes[settings.mesh]
        return np.flatnonzero(is_shown & settings.everywhere)

    def _instance_boxes(self, opacity: float, settings: Settings) -> list[Any]:
        """Return the boxes of instances, those of the chosen mesh twice as strong as others."""
        boxes = self.geometry.boxes
        largest = np.argsort(-surface_area(boxes), kind="stable")[:MOST_BOXES]
        is_shown = np.isin(largest, self._places(settings))
        return [
            coloured(box_segments(boxes[some]), faint(ORANGE, strength * opacity))
            for some, strength in ((largest[~is_shown], 0.5), (largest[is_shown], 1.0))
        ]

    def _top(self, settings: Settings) -> Picture:
        """Show a level of the tree over instances."""
        cells, level = self.cells, settings.level
        on_level = np.flatnonzero(cells.depth == level)
        above = np.flatnonzero(cells.is_leaf & (cells.depth < level))
        areas = surface_area(cells.boxes)
        on_level, above = (
            each[np.argsort(-areas[each], kind="stable")][:MOST_BOXES] for each in (on_level, above)
        )
        colour = (*depth_colours(np.array([level]), self.deepest)[0], 1.0)
        parts = [
            *self._instance_boxes(0.3, settings),
            coloured(wires_of(cells, np.sort(above)).segments(), faint(GREY)),
            coloured(wires_of(cells, np.sort(on_level)).segments(), colour),
        ]
        nodes = int((cells.depth == level).sum())
        caption = (
            f"Top level, level {level} of {self.deepest}: {counted(nodes, 'node', 'nodes')} around "
            f"boxes of instances, which are drawn faint"
        )
        return picture_of(parts, caption, rows=self._rows())

    def _instances(self, settings: Settings) -> Picture:
        """Show the boxes of instances."""
        count = len(self.geometry.ids)
        caption = (
            f"The items of the top level: world boxes of {counted(count, 'instance', 'instances')} "
            f"of {counted(len(self.geometry.meshes), 'mesh', 'meshes')}, each with a matrix of its "
            "own"
        )
        parts, marks = self._instance_boxes(1.0, settings), []
        if levels_of_mesh(self.geometry) == 1:
            mesh = int(self.meshes[settings.mesh])
            parts.append(self.space(mesh).items(0.3))
            marks.append(self._name(mesh))
        return picture_of(parts, caption, marks=marks, rows=self._rows())

    def _mesh(self, settings: Settings, level: int) -> Picture:
        """Show a level of the tree of a mesh, in its space, and where it is."""
        mesh = int(self.meshes[settings.mesh])
        space = self.space(mesh)
        cells = space.cells
        level = min(level, int(cells.depth.max()))
        shown = np.flatnonzero((cells.depth == level) | (cells.is_leaf & (cells.depth < level)))
        areas = surface_area(cells.boxes)[shown]
        shown = shown[np.argsort(-areas, kind="stable")][:MOST_BOXES]
        places = np.flatnonzero(self.geometry.which == mesh)
        parts = [*self._instance_boxes(0.4, settings), space.items()]
        few = self._places(settings)[:MOST_PLACES]
        # All of them together no more than are legible.
        is_much = len(few) * len(shown) > 1500
        most = max(1, MOST_BOXES // len(few)) if is_much else len(shown)
        corners = box_segments(cells.boxes[shown[: max(most, 8)]])
        for number in few:
            moved = moved_points(corners, self.geometry.matrices[number])
            parts.append(coloured(moved, faint(BLUE, 0.6)))
        parts.append(coloured(space.boxes(cells.boxes[shown]), BLUE))
        number = int((cells.depth == level).sum())
        caption = (
            f"Bottom level, level {level} of {int(cells.depth.max())}: "
            f"{counted(number, 'box', 'boxes')} in the mesh's own space, stored once and seen in "
            f"{counted(len(places), 'place', 'places')}"
        )
        marks = [self._name(mesh)]
        if settings.everywhere and len(places) > MOST_PLACES:
            caption += f"; drawn in {MOST_PLACES} of them"
        return picture_of(parts, caption, marks=marks, rows=self._rows())

    def _name(self, mesh: int) -> Mark:
        uses = counted(int(self.uses[mesh]), "instance", "instances")
        return self.space(mesh).name(f"object space of mesh {mesh}: {uses}")

    def _rows(self) -> list[Row]:
        """Return what both levels have and take."""
        structure, geometry = self.structure, self.geometry
        total, stored = int(geometry.first[-1]), stored_in(geometry)
        return [
            Row("Instances", f"{len(geometry.ids)}", "items of the top level"),
            Row("Meshes", f"{len(geometry.meshes)}", "bottom levels, if they are shared"),
            Row("Triangles", f"{total:,}".replace(",", " "), "those of every instance counted"),
            Row("Triangles Stored", f"{stored:,}".replace(",", " "), "those of every mesh once"),
            Row("Memory, Top", in_words(structure.bytes_of_top()), "nodes and instances"),
            Row("Memory, Bottom", in_words(structure.bytes_of_bottoms()), "trees of meshes"),
        ]  # fmt: skip

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the root, a middle level, instances, and a level of the mesh."""
        last = self.ends["level"]
        within = min(self.deepest + 2 + 4, last)
        chosen = sorted({0, min(3, self.deepest), self.deepest + 1, within})
        return [Settings(level, settings.mesh, settings.everywhere) for level in chosen]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at both levels."""
    return TwoLevels(subject, progress)


LESSONS = (
    Lesson(
        name="two_levels",
        label="Two Levels",
        slide="Scene and AABBs",
        begin="A scene of many instances has two levels: a tree over the boxes of instances in the "
        "world, and for each mesh a tree in its own space, built once",
        look_for="First the nodes of the top level close in on instances. Then the boxes of one "
        "bottom level: beside the scene, where they are stored, and wherever an instance is, where "
        "they stand aslant as its matrix turns them",
        question="Why is the box of a turned instance larger than it need be?",
        answer="It is put around the eight corners of the mesh's turned box, not around its "
        "triangles. Looking at deeper nodes would make it tighter, and cost more at every rebuild",
        source="structures.two_level.structure",
        sample="crowd:figures=12,triangles=3000",
        structures=("two_level",),
        suits=is_two_level,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
