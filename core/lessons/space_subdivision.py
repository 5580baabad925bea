"""Lesson "space subdivision": equal cells beside cells that adapt themselves, with what both cost.

A plane across y cuts the grid and the octree; both are drawn beside the model as the plane sees
them. Orange are the cells with objects. The figures are those of the slide: cells and memory, and
steps of a ray. The grid has as many cells along each axis as the octree has at its deepest level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..contract.structure import Structure
from ..progress import Progress
from ..settings import setting
from .drawing import GREY, ORANGE, Faces, Lines, counted, picture_of
from .figures import Costs, lines_through
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    Across,
    Plane,
    model_with,
    outline_beside,
    place_beside,
    title_place,
)


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    position: float = setting(
        0.5, "Plane", "Where the plane cuts, from the front (0) to the back (1)",
        minimum=0.0, maximum=1.0,
    )  # fmt: skip


class SpaceSubdivision(Play):
    """Structures beside each other, cut by one plane."""

    def __init__(self, structures: Sequence[Structure], progress: Progress) -> None:
        self.structures, self.scene = structures, structures[0].scene
        lines = lines_through(self.scene)
        self.cells, self.costs = [], []
        for number, structure in enumerate(structures):
            progress.report(number, len(structures), f"Looking at {structure.name}")
            self.cells.append(structure.cells(progress).own())
            self.costs.append(Costs.of(structure, lines, progress))
        progress.report(1, 1, "Looking at the cells")
        self.across = Across(self.scene, self.cells)

    def picture(self, settings: Settings) -> Picture:
        """Return what a plane sees of all of them."""
        plane = Plane.across(self.scene, settings.position)
        parts: list[Lines | Faces] = list(model_with(self.scene, plane))
        outlines = self.across.contour(plane)
        marks, rows, told = [], list[Row](), []
        for number, structure in enumerate(self.structures):
            cells, costs = self.cells[number], self.costs[number]
            shift = place_beside(self.scene, number)
            section = self.across.section(number, plane, cells.is_leaf, len(self.structures))
            beside = section.moved(shift)
            parts.append(beside.where(cells.count[section.owners] > 0).filled(ORANGE))
            parts.append(beside.drawn((*GREY[:3], FAINT)))
            parts.append(outline_beside(outlines, shift))
            cut = len(np.unique(section.owners)) + section.left_out
            marks.append(Mark(title_place(self.scene, plane, shift), structure.label))
            rows += costs.rows(structure.label)
            drawn = f", drawn: the largest {cut - section.left_out}" * (section.left_out > 0)
            told.append(
                f"{structure.label}: {counted(cut, 'cell', 'cells')} cut{drawn}, "
                f"{counted(costs.cells, 'cell', 'cells')} in all, {costs.steps:.1f} steps and "
                f"{costs.tests:.1f} tests per ray"
            )
        return picture_of(parts, "; ".join(told), marks=marks, rows=rows)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at the cells, and trace lines."""
    return SpaceSubdivision(subject.structures, progress)


LESSONS = (
    Lesson(
        name="space_subdivision",
        label="Uniform and Nonuniform Subdivision",
        slide="Space subdivision (spatial directories)",
        begin="Space is divided into cells, each with a list of the objects in it, and a ray asks "
        "only the cells it passes",
        look_for="The grid's cells are alike everywhere, so most are spent on nothing; the octree "
        "spends them where objects are, and its cells in empty space are large",
        question="The grid's step to the next cell is much cheaper than the octree's. When is it "
        "the better choice?",
        answer="If objects of like size are spread evenly, as in a cloud of particles that fills "
        "its box: then equal cells hold equally much, and addressing them costs nothing",
        source="structures.grid.cells",
        sample="suzanne:subdivisions=2",
        structures=("grid:resolution=32x32x32,assignment=exact", "octree:max_depth=5"),
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="position",
    ),
)
