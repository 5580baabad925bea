"""Lesson "adaptive systems": octree, kd-trees and BSP tree of one object, level by level.

As on the slide "Adaptive subdivision systems": an octree divides in the middle; a kd-tree cuts in
the middle across x, y, z in turn, or where it thinks best; planes of a general BSP tree have any
orientation. Beside the model stands what a plane across y sees of each; red are the cuts of the
level, cells with objects are orange once they are leaves.

A level of the octree is three of the others, as it cuts across three axes at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.structure import Structure
from ..geometry.triangles import Triangles
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from .drawing import GREY, ORANGE, RED, Faces, Lines, counted, picture_of
from .figures import Costs, lines_through
from .lesson import Lesson, Play, Subject, build
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    Across,
    Plane,
    Section,
    left_out_text,
    model_with,
    outline_beside,
    place_beside,
    title_place,
)

SYSTEMS = {
    "Octree": "octree:max_leaf_size=16",
    "kd Cyclic": "kdtree:planes=cyclic,max_leaf_size=16",
    "kd Longest": "kdtree:planes=longest,max_leaf_size=16",
    "kd Median": "kdtree:planes=object_median,max_leaf_size=16",
    "kd SAH": "kdtree:planes=sah,max_leaf_size=16",
    "BSP": "bsp:planes=fixed,max_leaf_size=16",
}
"""What is shown, in the order of the slide, by names that are short enough to stand over a section.
Of the kd-trees, the first two cut in the middle, across x, y and z in turn or across the longest
side. The same M for all."""

COLUMNS = 3
"""Systems in a row."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    level: int = setting(
        9, "Level", "Levels of binary cuts; the octree has one for three of them", minimum=0
    )
    position: float = setting(
        0.5, "Plane", "Where the plane cuts, from the front (0) to the back (1)",
        minimum=0.0, maximum=1.0,
    )  # fmt: skip


class AdaptiveSystems(Play):
    """Trees beside each other, up to one level."""

    def __init__(self, scene: Scene, structures: dict[str, Structure], progress: Progress) -> None:
        self.structures, self.scene = structures, scene
        lines = lines_through(self.scene)
        self.cells, self.costs, self.binary = [], [], []
        for number, structure in enumerate(structures.values()):
            progress.report(number, len(structures), f"Looking at {structure.name}")
            cells = structure.cells(progress).own()
            self.cells.append(cells)
            progress.report(number + 0.5, len(structures), f"Looking at {structure.name}")
            self.costs.append(Costs.of(structure, lines, progress))
            _, children = np.unique(cells.parents[1:], return_counts=True)
            self.binary.append(3 if len(children) and children.max() > 2 else 1)
        deepest = [
            int(cells.depth.max()) * steps
            for cells, steps in zip(self.cells, self.binary, strict=True)
        ]
        progress.report(1, 1, "Looking at the cells")
        self.across = Across(self.scene, self.cells)
        self.ends = {"level": max(*deepest, 1)}

    def picture(self, settings: Settings) -> Picture:
        """Return all trees up to a level, as a plane sees them."""
        plane = Plane.across(self.scene, settings.position)
        outlines = self.across.contour(plane)
        parts: list[Lines | Faces] = list(model_with(self.scene, plane))
        marks, rows, told, sections = [], [], [], list[Section]()
        for number, (name, cells) in enumerate(zip(self.structures, self.cells, strict=True)):
            shift = place_beside(self.scene, number, COLUMNS)
            depth = settings.level // self.binary[number]
            shown = (cells.depth == depth) | (cells.is_leaf & (cells.depth < depth))
            section = self.across.section(number, plane, shown, 2 * len(SYSTEMS))
            sections.append(section)
            beside, owners = section.moved(shift), section.owners
            full = cells.is_leaf[owners] & (cells.count[owners] > 0)
            parts += [beside.where(full).filled(ORANGE), beside.drawn((*GREY[:3], FAINT))]
            newest = beside.where((cells.depth[owners] == depth) & (depth > 0))
            parts.append(newest.raised(self.scene).drawn((*RED[:3], 0.8)))
            parts.append(outline_beside(outlines, shift))
            marks.append(Mark(title_place(self.scene, plane, shift), name))
            costs = self.costs[number]
            rows.append(
                Row(
                    name,
                    f"{counted(costs.cells, 'leaf', 'leaves')}, SAH {costs.sah:.1f}, "
                    f"N_TS {costs.steps:.1f}, N_IT {costs.tests:.1f}",
                    "Leaves and SAH cost of the whole tree; steps and tests of random lines",
                )
            )
            told.append(f"{name} {int(shown.sum())}")
        caption = f"Level {settings.level} of binary cuts; cells so far: {', '.join(told)}"
        return picture_of(parts, caption + left_out_text(sections), marks=marks, rows=rows)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Build all trees, and trace lines; a BSP tree has triangles only."""
    scene, structures = subject.scene, {}
    for name, spec in SYSTEMS.items():
        if isinstance(scene.geometry, Triangles) or not spec.startswith("bsp"):
            structures[name] = build(scene, spec, progress)
    return AdaptiveSystems(scene, structures, progress)


LESSONS = (
    Lesson(
        name="adaptive_systems",
        label="Octree, kd-Tree, BSP Tree",
        slide="Adaptive subdivision systems",
        begin="Adaptive subdivisions differ in which planes may cut a cell, and who chooses them",
        look_for="Cuts in the middle do not ask where the object is; the SAH cuts off empty space "
        "first and in large pieces, and oblique planes follow the surface",
        question="The object median puts half of the objects on either side. Why is that a poor "
        "rule for a ray tracer?",
        answer="It balances the tree, as a search by key needs it. A ray visits a cell in "
        "proportion to its surface, so large empty cells and small full ones are better",
        source="structures.subdivision.tree",
        sample="suzanne:subdivisions=2",
        Settings=Settings,
        play=play,
        film="level",
    ),
)
