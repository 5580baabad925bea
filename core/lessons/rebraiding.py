"""Lesson "re-braiding": two levels over overlapping instances, before and after nodes are opened.

On the left the top level as it is: its items are whole instances. On the right the same after
partial re-braiding. Orange: boxes of the items of both. Blue: one level of the tree over them.
Green: nodes that have been opened, the last dozen bright, as they stand in the world.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.cells import Cells
from ..contract.outlines import wires_of
from ..geometry.box_shape import box_segments, surface_area
from ..progress import SILENT, Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.two_level import TwoLevel
from .drawing import BLUE, GREEN, ORANGE, coloured, counted, extent_of, faint, picture_of
from .figures import lines_through
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Mark, Picture, Row

MOST_BOXES = 250

LAST = 12
"""Nodes that were opened last, and stand out."""

APART = 1.25
"""How far the right side stands from the left one, in lengths of the scene."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    opened: int = setting(0, "Opened", "Nodes that have been opened so far", minimum=0)
    level: int = setting(2, "Level", "Of the trees on both sides", minimum=0)
    items: bool = setting(False, "Items", "Show the boxes of instances and of parts of them")


class Rebraiding(Play):
    """The top level over whole instances, and over parts of them."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        before, after = subject.structures
        assert isinstance(before, TwoLevel)
        assert isinstance(after, TwoLevel)
        assert after.braid is not None
        self.before, self.after = before, after
        self.braid = after.braid
        self.cells = before.cells(progress), after.cells(progress)
        self.opened = edges_of_opened(after, self.braid.opened)
        lines = lines_through(after.scene)
        self.means = [each.trace(lines, progress=progress)[1].means() for each in (before, after)]
        self.costs = after.statistics(progress).extra
        flat = BVH.build(after.scene.flat(), BVH.Settings(), progress)
        self.means.append(flat.trace(lines, progress=progress)[1].means())
        self.shift = np.array([APART * extent_of(after.scene), 0.0, 0.0])
        deepest = max(int(cells.depth.max()) for cells in self.cells)
        self.ends = {"opened": len(self.braid.opened), "level": deepest}

    def picture(self, settings: Settings) -> Picture:
        """Return both sides."""
        left, right = self.cells
        parts = []
        if settings.items:
            boxes = self.before.scene.geometry.boxes
            parts.append(coloured(box_segments(largest(boxes)), faint(ORANGE, 0.4)))
            boxes = self.braid.references.boxes
            parts.append(coloured(box_segments(largest(boxes)) + self.shift, faint(ORANGE, 0.4)))
        parts.append(coloured(level_of(left, settings.level), BLUE))
        parts.append(coloured(level_of(right, settings.level) + self.shift, BLUE))
        opened = self.opened[max(settings.opened - MOST_BOXES, 0) : settings.opened]
        for some, colour in ((opened[:-LAST], faint(GREEN, 0.25)), (opened[-LAST:], GREEN)):
            parts.append(coloured(some.reshape(-1, 2, 3) + self.shift, colour))
        scene = self.after.scene
        top = np.array([scene.lower[0], scene.lower[1], scene.upper[2] + 0.1 * extent_of(scene)])
        marks = [Mark(top, "whole instances"), Mark(top + self.shift, "opened instances")]
        references = len(self.braid.references.owner)
        caption = (
            f"{counted(len(scene), 'instance', 'instances')}, of which "
            f"{counted(settings.opened, 'node is', 'nodes are')} opened so far, in the end "
            f"{len(self.braid.opened)}: {references} references; a line enters instances "
            f"{self.means[0]['instances_entered']:.2f} times before, "
            f"{self.means[1]['instances_entered']:.2f} times after"
        )
        return picture_of(parts, caption, marks=marks, rows=self._rows())

    def _rows(self) -> list[Row]:
        """Return what both cost."""
        steps = [sum(mean.get(name, 0.0) for name in ("N_TS", "N_TS_1")) for mean in self.means]
        tests = [mean.get("N_IT_1", mean["N_IT"]) for mean in self.means]
        entered = [mean.get("instances_entered", 0.0) for mean in self.means[:2]]
        vain = [mean.get("entered_in_vain", 0.0) for mean in self.means[:2]]
        rows = [
            _row("SAH Cost", [self.costs[key] for key in COSTS if key in self.costs],
                 "of lines through the box around all; " + THREE),
            _row("N_TS", steps, "nodes of both levels that a random line enters; " + THREE),
            _row("N_IT", tests, "triangles that such a line tests; " + THREE),
            _row("Entered", entered, "instances that it enters, before and after"),
            _row("In Vain", vain, "those among them in which it hits nothing"),
        ]  # fmt: skip
        return rows

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return nothing opened, some, and all, and a deeper level."""
        last = self.ends["opened"]
        chosen = [(0, 1), (last // 4, 2), (last, 3), (last, 5)]
        return [
            dataclasses.replace(settings, opened=opened, level=min(level, self.ends["level"]))
            for opened, level in chosen
        ]


COSTS = "sah_two_levels", "sah_rebraided", "sah_flattened"

THREE = "before, after, and of one tree over all triangles"


def _row(label: str, values: list[float], meaning: str) -> Row:
    return Row(label, ", ".join(f"{value:.2f}" for value in values), meaning)


def edges_of_opened(structure: TwoLevel, opened: np.ndarray) -> np.ndarray:
    """Return the edges of nodes that were opened, as they stand in the world, (k, 12, 2, 3)."""
    boxes = structure.instances.forest.volumes.boxes()[opened[:, 1]]
    edges = box_segments(boxes).reshape(-1, 12, 2, 3)
    matrices = structure.scene.geometry.matrices[opened[:, 0]]
    moved = np.einsum("nij,nekj->neki", matrices[:, :, :3], edges)
    return moved + matrices[:, None, None, :, 3]


def largest(boxes: np.ndarray) -> np.ndarray:
    """Return the largest of some boxes."""
    return boxes[np.argsort(-surface_area(boxes), kind="stable")[:MOST_BOXES]]


def level_of(cells: Cells, level: int) -> np.ndarray:
    """Return the edges of a level, and of leaves above it, (k, 2, 3)."""
    shown = (cells.depth == level) | (cells.is_leaf & (cells.depth < level))
    places = np.flatnonzero(shown)
    areas = surface_area(cells.boxes[places])
    places = np.sort(places[np.argsort(-areas, kind="stable")][:MOST_BOXES])
    return wires_of(cells, places).segments()


def play(subject: Subject, settings: Settings, progress: Progress = SILENT) -> Play:
    """Trace lines through both."""
    return Rebraiding(subject, progress)


LESSONS = (
    Lesson(
        name="rebraiding",
        label="Partial Re-braiding",
        slide="DXR acceleration",
        begin="Instances that overlap make a ray enter them all. So the top level is built over "
        "parts of them: nodes of bottom levels that are long are opened before each split",
        look_for="On the left every item is as large as an instance, and no plane divides them. "
        "On the right green nodes have been opened; the boxes of what is in them are small, and "
        "the tree over them divides what is far apart",
        question="Why does the top level not open everything?",
        answer="Each part is a reference of its own, which takes memory, time at every rebuild, "
        "and another move of the ray into the same instance. In the end it would be the tree over "
        "all triangles that two levels were to spare us",
        source="structures.two_level.rebraid",
        sample="overlapping:spheres=12,segments=32",
        structures=("two_level", "two_level:rebraid=partial,budget=16,room=0"),
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="opened",
    ),
)
