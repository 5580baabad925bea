"""Lesson "macro-cells": where there is nothing near, a ray passes many cells in one step.

As on the slide "Macro-cells (Miloš Šrámek)": an empty cell knows how far the nearest object is, in
cells, and the whole box of that reach around it is empty and passed at once
(:mod:`..structures.macro_grid`). Beside the model stand the plain grid, cell by cell, and the same
grid with macro-cells. Orange are cells with objects, blue empty ones, red the region that is being
passed, yellow those that were passed before; numbers are distances in cells, from 2 on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..contract.cells import Cells
from ..contract.events import JUMP
from ..errors import InputError
from ..progress import Progress
from ..settings import setting
from ..structures.grid import Grid
from ..structures.macro_grid import FARTHEST, MacroGrid
from .column import YELLOW
from .drawing import BLUE, GREY, ORANGE, RED, Faces, Lines, counted, picture_of
from .lesson import Lesson, Play, Subject, build
from .one_ray import Counted, Walked, ray_of
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    Plane,
    contour,
    model_with,
    outline_beside,
    place_beside,
    section_of,
    title_place,
)

RESOLUTION = "24x24x24"

MOST_NUMBERS = 10
"""Distances that are written."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    step: int = setting(3, "Step", "Of the walk with macro-cells; the first is 0", minimum=0)
    regions: str = setting(
        "chessboard",
        "Regions",
        "How far an empty cell looks",
        choices={
            "chessboard": "In all directions: one distance for each cell",
            "octant": "Only in the directions of the ray: eight distances for each cell",
        },
    )


class MacroCells(Play):
    """One ray, with macro-cells and without."""

    def __init__(self, walked: Walked, plain: Walked, plane: Plane) -> None:
        self.walked, self.plain, self.plane = walked, plain, plane
        grid = walked.structure
        assert isinstance(grid, MacroGrid)
        self.scene = grid.scene
        self.ends = {"step": len(walked.visits) - 1}
        direction = walked.rays.directions[0]
        numbers = walked.steps.cell[walked.visits].tolist()
        found = [grid.region(number, direction) for number in numbers]
        own = walked.cells.boxes[walked.places]
        self.boxes = np.array(
            [box if region is None else region for region, box in zip(found, own, strict=True)]
        )
        octant = int((direction > 0.0) @ [4, 2, 1]) if len(grid.arrays.distances) > 1 else 0
        self.distances = grid.arrays.distances[octant][numbers]
        self.shifts = [place_beside(self.scene, number) for number in range(2)]
        occupied = np.flatnonzero(walked.cells.count > 0)
        every = np.arange(len(walked.cells))
        self.section = section_of(walked.cells, every, plane, 2)
        self.occupied = section_of(walked.cells, occupied, plane, 2)
        self.entered = section_of(plain.cells, np.unique(plain.places), plane)
        none = np.zeros(len(self.boxes), np.int32)
        regions = Cells(self.boxes, np.arange(len(none), dtype=np.int32), none, none == 0, none)
        self.regions = section_of(regions, np.arange(len(none)), plane)
        self.contour = contour(self.scene, plane, 2)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after a step."""
        step, steps = settings.step, self.walked.steps
        visit = self.walked.visits[step]
        reached = float(steps.t_exit[visit])
        is_last = step == self.ends["step"]
        cells_before = int((self.plain.steps.t_enter[self.plain.visits] < reached).sum())
        cells_before = len(self.plain.visits) if is_last else cells_before
        parts: list[Lines | Faces] = [
            *model_with(self.scene, self.plane), *self.walked.ray_lines()
        ]  # fmt: skip
        for shift in self.shifts:
            parts += self.grid(shift)
            parts += self.walked.ray_lines(shift, np.inf if is_last else reached)
        parts += self.cells_entered(cells_before) + self.passed(step)
        marks = [
            Mark(
                title_place(self.scene, self.plane, shift), f"{name}: {counted(n, 'step', 'steps')}"
            )
            for shift, name, n in zip(
                self.shifts, ("Cell by Cell", "Macro-Cells"), (cells_before, step + 1), strict=True
            )
        ]
        for each in range(max(step + 1 - MOST_NUMBERS, 0), step + 1):
            t = float(steps.t_enter[self.walked.visits[each]])
            place = self.walked.at(t) + self.shifts[1]
            distance = int(self.distances[each])
            if distance > 1:
                marks.append(Mark(place, "far" if distance == FARTHEST else str(distance)))
        counts, plain = self.walked.counts, self.plain.counts
        rows = (
            Row("Steps, Cell by Cell", str(plain["N_TS"]), "N_TS of the plain grid"),
            Row("Steps with Macro-Cells", str(counts["N_TS"]), "N_TS of the same ray"),
            Row("Cells Skipped", str(counts["cells_skipped"]), "The difference of both"),
            Row("Distance", str(int(self.distances[step])),
                "Cells from here to the nearest with objects; 0 if there are some in it"),
            Row("Tests", str(counts["N_IT"]), "The same with and without"),
        )  # fmt: skip
        distance, passed = int(self.distances[step]), self.cells_passed(step)
        what = "it has objects, and is left by its wall"
        if distance:
            what = f"objects are {counted(distance, 'cell', 'cells')} away"
            if distance == FARTHEST:
                what = "there are no objects that way"
            more = counted(passed, "more cell is", "more cells are")
            what += f", and {more} passed in this step" if passed else ", so nothing is skipped"
        caption = f"Step {step}, cell {int(steps.cell[visit])}: {what}"
        return picture_of(parts, caption, marks=marks, rows=rows)

    def cells_passed(self, step: int) -> int:
        """Return how many cells the log says are passed in a step beside its own."""
        steps, visits = self.walked.steps, self.walked.visits
        last = visits[step + 1] if step + 1 < len(visits) else len(steps)
        jumps = np.arange(visits[step], last)[steps.kind[visits[step] : last] == JUMP]
        return int(steps.primitive[jumps].sum())

    def grid(self, shift: np.ndarray) -> list[Lines | Faces]:
        """Return the section of all cells, those with objects filled, and the object."""
        count = len(self.walked.cells)
        lines = np.tile((*GREY[:3], 0.5 * FAINT), (count, 1))
        fills = np.tile((*ORANGE[:3], 0.3), (count, 1))
        return [
            self.occupied.moved(shift).faces(fills),
            self.section.moved(shift).lines(lines),
            outline_beside(self.contour, shift),
        ]

    def cells_entered(self, count: int) -> list[Lines | Faces]:
        """Return the first cells that the plain walk enters."""
        places, is_empty = self.plain.places[:count], self.plain.is_empty[:count]
        colours = np.tile(ORANGE, (len(self.plain.cells), 1))
        colours[places[is_empty]] = BLUE
        entered = self.entered.of(places).moved(self.shifts[0])
        return [entered.raised(self.scene).lines(colours)]

    def passed(self, step: int) -> list[Lines | Faces]:
        """Return the regions that were passed, and that of this step."""
        colours = np.tile(YELLOW, (len(self.boxes), 1))
        colours[self.distances == 0] = ORANGE
        colours[step] = RED
        fills = colours.copy()
        fills[:, 3] = 0.18
        regions = self.regions.moved(self.shifts[1]).raised(self.scene)
        before, now = regions.of(np.arange(step)), regions.of(np.array([step]))
        return [before.lines(colours), now.faces(fills), now.raised(self.scene).lines(colours)]


def passes_much(counted_in: Sequence[Counted], hits: np.ndarray) -> np.ndarray:
    """Prefer rays through many empty cells, and those that hit."""
    return counted_in[0]["N_EETS"] + 20 * hits + 0.1 * counted_in[0]["N_TS"]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Build both grids, and record the ray in them."""
    progress.report(0, 3, "Building the grids")
    spec = f"macro_grid:resolution={RESOLUTION},regions={settings.regions}"
    macro = build(subject.scene, spec, progress)
    plain = build(subject.scene, f"grid:resolution={RESOLUTION}", progress)
    assert isinstance(plain, Grid)
    progress.report(1, 3, "Choosing a ray")
    rays = ray_of(subject, [plain], passes_much, progress)
    progress.report(2, 3, "Following the ray")
    walked, cell_by_cell = (Walked.of(grid, rays, progress) for grid in (macro, plain))
    if not len(walked.visits):
        raise InputError("this ray misses the grid; choose one that enters it")
    plane = Plane.through_ray(rays.origins[0], rays.directions[0])
    return MacroCells(walked, cell_by_cell, plane)


LESSONS = (
    Lesson(
        name="macro_cells",
        label="Macro-Cells",
        slide="Macro-cells",
        begin="A cell that knows how far the nearest object is lets a ray pass all the empty "
        "cells around it in one step",
        look_for="Far from objects regions are large and the steps long; near the surface they "
        "shrink to single cells, and the walk goes on from wall to wall",
        question="What does a directed distance, one for each octant of directions, gain over one "
        "distance for all?",
        answer="A ray that leaves an object behind need not mind it any more: it may pass at "
        "once, where the distance to all sides is still small",
        source="structures.macro_grid",
        sample="suzanne:subdivisions=2",
        Settings=Settings,
        play=play,
        takes_ray=True,
        film="step",
        replays=("regions",),
    ),
)
