"""Lessons on the 3D DDA: its constants Dx, Dy, Dz, and the step, as on its second and third slide.

Below the section of the grid (:mod:`.grid_traversal`) stands the ladder: a row for each system of
walls, in which ticks are the t of crossings. In every cell Lx, Ly, Lz are what is left to the next
tick of each row, and the least of them, red, is the step D.

The lecture subtracts D from Lx, Ly, Lz in every step. The walk of the structure takes the t of the
next wall from its number, so that no error builds up (:mod:`..structures.grid.dda`): L is that t
less the t at which the cell is entered, and Dx, Dy, Dz are spacings of walls by the direction. The
outermost walls stand a hair outside, so that the border of the box lies within.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..settings import setting
from .drawing import GREY, RED, Colour, Faces, Lines, coloured, picture_of
from .grid_traversal import (
    AXES,
    AXIS_COLOURS,
    SHARED,
    CellSettings,
    Traversal,
    number,
    play_of,
)
from .lesson import Lesson
from .one_ray import RAY, Walked
from .picture import Mark, Picture, Row
from .section import FAINT

ROW = 0.13
"""Height of a row of the ladder, in sizes of the scene."""

MOST_AHEAD = 1.5
"""How far a row reaches at most, in lengths of the ray within the cells it enters."""

BESIDE = 0.36
"""How far before a row its name stands, in sizes of the scene."""


@dataclass(frozen=True)
class AxisSettings:
    """The knob of the lesson on the constants."""

    axis: str = setting(
        "x",
        "Walls",
        "Which system of walls",
        choices={"x": "Walls across x", "y": "Walls across y", "z": "Walls across z"},
    )


class WithLadder(Traversal):
    """A traversal with the ladder below the section."""

    def __init__(self, walked: Walked) -> None:
        super().__init__(walked)
        walls = self.ladder.walls[np.isfinite(self.ladder.walls)]
        furthest = self.begin + MOST_AHEAD * (self.last - self.begin)
        self.end = min(float(walls.max(initial=self.last)), furthest)

    def chart_point(self, t: np.ndarray | float, row: float) -> np.ndarray:
        """Return where a t stands in a row of the ladder, (..., 3); below the section."""
        share = (np.asarray(t) - self.begin) / ((self.end - self.begin) or 1.0)
        foot = self.plane.point - (self.plane.point @ self.along) * self.along
        foot = foot + self.shift
        foot[2] = self.scene.lower[2] - (0.12 + ROW * row) * self.size
        across = self.left + share * (self.right - self.left)
        return foot + across[..., None] * self.along

    def row(self, axis: int, colour: Colour) -> list[Lines]:
        """Return a system's row: its crossings as ticks."""
        begin, end = self.chart_point(np.array([self.begin, self.end]), axis)
        ticks = self.chart_point(self.crossings(axis), axis)
        half = np.array([0.0, 0.0, 0.3 * ROW * self.size])
        return [
            coloured(np.array([[begin, end]]), (*GREY[:3], FAINT)),
            coloured(np.stack([ticks - half, ticks + half], axis=1), colour),
        ]

    def bar(self, axis: int, begin: float, end: float, colour: Colour) -> Faces:
        """Return a bar in a row, from one t to another."""
        ends = self.chart_point(np.clip([begin, end], self.begin, self.end), axis)
        half = np.array([0.0, 0.0, 0.16 * ROW * self.size])
        a, b, c, d = ends[0] - half, ends[1] - half, ends[1] + half, ends[0] + half
        return Faces(np.array([[a, b, c], [a, c, d]]), np.tile((*colour[:3], 0.6), (2, 1)))

    def beside_row(self, axis: int, text: str, colour: Colour) -> Mark:
        """Return text before a row."""
        place = self.chart_point(self.begin, axis) - BESIDE * self.size * self.along
        return Mark(place, text, colour[:3])


class Constants(WithLadder):
    """Slide 2: Dx, Dy, Dz, the initial cell, and Lx, Ly, Lz there."""

    def picture(self, settings: AxisSettings) -> Picture:
        """Return the picture of one system of walls."""
        axis = AXES.index(settings.axis)
        name, colour = settings.axis, AXIS_COLOURS[axis]
        parts = self.base([axis]) + self.filled(1) + list(self.walked.ray_lines(self.shift))
        parts.append(self.dots(self.crossings(axis), colour))
        marks, rows = [], []
        left = self.ladder.walls[0] - self.t[0]
        for each in range(3):
            own = AXIS_COLOURS[each] if each == axis else (*AXIS_COLOURS[each][:3], 0.5)
            parts += self.row(each, own)
            text = f"D{AXES[each]} = {number(self.ladder.spacing[each])}"
            marks.append(self.beside_row(each, text, AXIS_COLOURS[each]))
            rows.append(Row(f"D{AXES[each]}", number(self.ladder.spacing[each]),
                            f"The t between two walls across {AXES[each]}: constant"))  # fmt: skip
        for each in range(3):
            rows.append(Row(f"L{AXES[each]}", number(left[each]),
                            f"The t left to the first wall across {AXES[each]}"))  # fmt: skip
        met = self.crossings(axis)
        if len(met) > 1:
            parts.append(self.bar(axis, met[0], met[1], RED))
        elif len(met):
            parts.append(self.bar(axis, self.begin, met[0], RED))
        rows.append(Row("Initial Cell", self.name_of(0), "[i, j, k] in which the ray enters"))
        rows.append(Row("t", number(self.t[0]), "Ray parameter at which it enters"))
        crossed = f"{len(met)} wall{'s' * (len(met) != 1)} across {name} crossed"
        caption = (
            f"{crossed}, each D{name} = {number(self.ladder.spacing[axis])} after the last; from "
            f"the first cell, {self.name_of(0)}, L{name} = {number(left[axis])} is left to the next"
        )
        return picture_of(parts, caption, marks=marks, rows=rows)


class Stepping(WithLadder):
    """Slide 3: the least of Lx, Ly, Lz decides."""

    def __init__(self, walked: Walked) -> None:
        super().__init__(walked)
        self.ends = {"cell": self.last_cell}

    def picture(self, settings: CellSettings) -> Picture:
        """Return the picture of the step out of a cell."""
        cell, axis = settings.cell, self.axis_of(settings.cell)
        t, left = self.t[cell], self.ladder.walls[cell] - self.t[cell]
        is_last = cell == self.last_cell
        parts = self.base() + self.filled(cell + 1)
        parts += self.walked.ray_lines(self.shift, np.inf if is_last else float(self.t_exit[cell]))
        for each in range(3):
            wall = self.ladder.walls[cell, each]
            if wall <= self.end:
                chosen = RED if each == axis else AXIS_COLOURS[each]
                parts.append(self.dots(np.array([wall]), chosen))
        now = self.chart_point(np.array([t, t]), 0.0)
        now[0, 2] += 0.5 * ROW * self.size
        now[1, 2] -= 2.5 * ROW * self.size
        marks = []
        for each in range(3):
            colour = AXIS_COLOURS[each]
            parts += self.row(each, (*colour[:3], 0.8))
            parts.append(self.bar(each, t, self.ladder.walls[cell, each],
                                  RED if each == axis else colour))  # fmt: skip
            text = f"L{AXES[each]} = {number(left[each])}" + " = D" * (each == axis)
            marks.append(self.beside_row(each, text, RED if each == axis else colour))
        parts.append(coloured(now[None], RAY))
        marks.append(Mark(now[0], "t"))
        rows = [
            Row("Cell", self.name_of(cell), "[i, j, k]"),
            Row("t", number(t), "Ray parameter at which the cell is entered"),
            *(Row(f"L{AXES[each]}", number(left[each]),
                  f"The t left to the next wall across {AXES[each]}") for each in range(3)),
            Row("D = min", number(left[axis]), "The step: the least of Lx, Ly, Lz"),
            *(Row(f"D{AXES[each]}", number(self.ladder.spacing[each]),
                  f"What L{AXES[each]} is set to once that wall is crossed") for each in range(3)),
        ]  # fmt: skip
        caption = (
            f"Cell {self.name_of(cell)}: D = L{AXES[axis]} = {number(left[axis])} is the least"
        )
        if is_last:
            caption = f"Cell {self.name_of(cell)}, the last: {self.end_text()}"
            rows.append(Row("End", self.end_text(), "Why the walk ends here"))
        else:
            step = "+" if self.walked.rays.directions[0, axis] > 0.0 else "-"
            caption += f"; {'ijk'[axis]} = {'ijk'[axis]} {step} 1: {self.name_of(cell + 1)} is next"
            rows.append(Row("Next Cell", self.name_of(cell + 1), f"{'ijk'[axis]} has changed"))
        return picture_of(parts, caption, marks=marks, rows=rows)


LESSONS = (
    Lesson(
        name="dda_constants",
        label="The Constants of the 3D DDA",
        slide="Grid traversal (3D DDA) 2",
        begin="Walls of one system are equally far apart, so the ray meets them in equal steps",
        look_for="The ticks of a row have the same distance throughout: Dx, Dy, Dz depend on the "
        "direction alone, and only the first tick depends on where the ray enters",
        question="What is Dx of a ray that runs parallel to the walls across x?",
        answer="Infinite: it meets none of them, and Lx is never the least",
        Settings=AxisSettings,
        play=play_of(Constants),
        film="axis",
        **SHARED,
    ),
    Lesson(
        name="dda_step",
        label="A Step of the 3D DDA",
        slide="Grid traversal (3D DDA) 3",
        begin="The least of Lx, Ly, Lz says through which wall the ray leaves and how far that is",
        look_for="The red bar is the shortest of the three; all three shrink by it, and its own "
        "starts anew with the length of a full step",
        question="Why may the walk not end at the first hit that is found in a cell?",
        answer="The object may reach beyond the cell, and the hit lie in a later one; an object "
        "that is met before it may be listed only in a cell in between",
        Settings=CellSettings,
        play=play_of(Stepping),
        film="cell",
        **SHARED,
    ),
)
