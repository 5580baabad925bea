"""Lesson "grid traversal": a ray from cell to cell, as on the first slide of the 3D DDA.

Walls across x are blue, across y green, across z orange; so are the ray's crossings with them. The
grid is drawn where the upright plane of the ray cuts it: walls across x and across y are both
upright there, in distances of their own. Cells with objects are filled orange, empty ones blue.

:class:`Traversal` is shared with the lessons of the next two slides (:mod:`.dda`).

A. Fujimoto, T. Tanaka, K. Iwata: ARTS, IEEE CG&A 6(4), 1986; J. Amanatides, A. Woo: A Fast Voxel
Traversal Algorithm for Ray Tracing, Eurographics 1987.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.protocols import Skipping
from ..errors import InputError
from ..geometry.marks import stars
from ..progress import Progress
from ..settings import setting
from ..structures.grid import Grid
from ..structures.grid.ladder import Ladder, ladder_of
from .drawing import BLUE, GREEN, GREY, ORANGE, Colour, Faces, Lines, coloured, picture_of
from .lesson import Lesson, Play, Subject
from .one_ray import Walked, near, ray_of
from .picture import Mark, Picture, Row
from .section import (
    Plane,
    contour,
    model_with,
    outline_beside,
    place_beside,
    section_of,
    sideways,
    walls_in,
)

AXES = "xyz"
AXIS_COLOURS: tuple[Colour, ...] = (BLUE, GREEN, ORANGE)

MOST_NUMBERED = 12
"""Cells with their numbers beside them."""

MOST_WALLS = 40
"""Cells along an axis of a grid that is shown."""

LEAST_ROOM = 0.05
"""Length of the ray in a cell that has room for a number, in sizes of the scene."""

ENOUGH = 12
"""Cells that make a telling ray."""


@dataclass(frozen=True)
class CellSettings:
    """The knob of the lessons that go from cell to cell."""

    cell: int = setting(3, "Cell", "Which cell of the ray; the first is 0", minimum=0)


class Traversal(Play):
    """One ray through a grid, and its ladder."""

    def __init__(self, walked: Walked) -> None:
        grid = walked.structure
        assert isinstance(grid, Grid)
        self.walked, self.scene = walked, grid.scene
        self.t = walked.steps.t_enter[walked.visits]
        self.t_exit = walked.steps.t_exit[walked.visits]
        cells = walked.steps.cell[walked.visits]
        self.ladder: Ladder = ladder_of(grid.arrays, grid.geometry, walked.rays, cells)
        origin, direction = walked.rays.origins[0], walked.rays.directions[0]
        self.plane = Plane.through_ray(origin, direction)
        self.shift = place_beside(self.scene, 0)
        self.contour = contour(self.scene, self.plane)
        self.entered = section_of(walked.cells, np.unique(walked.places), self.plane)
        self.entered = self.entered.moved(self.shift)
        box = grid.arrays.box[0]
        walls = [grid.walls(axis) for axis in range(3)]
        self.walls = [walls_in(box, axis, walls[axis], self.plane) for axis in range(3)]
        self.along = sideways(self.plane, direction)
        ends = np.concatenate([part.reshape(-1, 3) for part in self.walls]) @ self.along
        self.left, self.right = float(ends.min()), float(ends.max())
        self.size = float((self.scene.upper - self.scene.lower).max())
        self.begin, self.last = float(self.t[0]), float(self.t_exit[np.isfinite(self.t_exit)][-1])
        self.last_cell = len(cells) - 1

    # ------------------------------------------------------------------------- what all share

    def base(self, only: Sequence[int] = (0, 1, 2)) -> list[Lines | Faces]:
        """Return the model with the plane, and the section with its walls in colours."""
        parts: list[Lines | Faces] = [
            *model_with(self.scene, self.plane), *self.walked.ray_lines()
        ]  # fmt: skip
        for axis in range(3):
            colour = AXIS_COLOURS[axis] if axis in only else GREY
            opacity = 0.6 if axis in only else 0.2
            parts.append(coloured(self.walls[axis] + self.shift, (*colour[:3], opacity)))
        parts.append(outline_beside(self.contour, self.shift))
        return parts

    def filled(self, count: int) -> list[Lines | Faces]:
        """Return the first cells of the ray, filled: orange with objects, blue without."""
        places, is_empty = self.walked.places[:count], self.walked.is_empty[:count]
        fills = np.zeros((len(self.walked.cells), 4))
        fills[places] = *ORANGE[:3], 0.3
        fills[places[is_empty]] = *BLUE[:3], 0.2
        return [self.entered.of(places).faces(fills)]

    def at(self, t: np.ndarray | float) -> np.ndarray:
        """Return points on the ray in the section."""
        return self.walked.at(t) + self.shift

    def crossings(self, axis: int) -> np.ndarray:
        """Return the t at which the ray has crossed walls of a system, ascending."""
        crossed = self.ladder.walls[:, axis] == self.t_exit
        earlier = (self.ladder.walls[:, :axis] == self.t_exit[:, None]).any(axis=1)
        return self.t_exit[crossed & ~earlier & np.isfinite(self.t_exit)]

    def dots(self, t: np.ndarray, colour: Colour) -> Lines:
        """Return marks on the ray."""
        return coloured(stars(self.at(t), np.full(1, 0.035 * self.size)), colour)

    def name_of(self, cell: int) -> str:
        """Return a cell as the lecture writes it."""
        return "[{}, {}, {}]".format(*self.ladder.cell[cell])

    def axis_of(self, cell: int) -> int:
        """Return the system of the wall through which the ray leaves a cell."""
        return int(np.argmin(self.ladder.walls[cell]))

    def end_text(self) -> str:
        """Say why the walk ends in its last cell."""
        if np.isfinite(self.walked.t_hit):
            return f"the nearest hit, at t = {self.walked.t_hit:.4g}, lies in the current cell"
        if self.t_exit[-1] > self.walked.rays.t_max[0]:
            return "the ray ends in the current cell"
        return "no hit, and the next cell is outside of the grid"


def number(value: float) -> str:
    """Write a figure; inf where no wall is crossed."""
    return f"{value:.4g}" if np.isfinite(value) else "inf"


class CellByCell(Traversal):
    """Slide 1: the cells of a ray in their order."""

    def __init__(self, walked: Walked) -> None:
        super().__init__(walked)
        self.ends = {"cell": self.last_cell}

    def picture(self, settings: CellSettings) -> Picture:
        """Return the picture up to a cell."""
        cell = settings.cell
        parts = self.base() + self.filled(cell + 1)
        until = np.inf if cell == self.last_cell else float(self.t_exit[cell])
        parts += self.walked.ray_lines(self.shift, until)
        for axis in range(3):
            met = self.crossings(axis)
            parts.append(self.dots(met[met <= self.t_exit[cell]], AXIS_COLOURS[axis]))
        marks = []
        for each in range(max(cell + 1 - MOST_NUMBERED, 0), cell + 1):
            piece = self.at(np.array([self.t[each], min(self.t_exit[each], self.last)]))
            if np.linalg.norm(piece[1] - piece[0]) > LEAST_ROOM * self.size or each == cell:
                marks.append(Mark(piece.mean(axis=0), str(each)))
        is_last = cell == self.last_cell
        way = (
            f"it ends: {self.end_text()}" if is_last else f"left across {AXES[self.axis_of(cell)]}"
        )
        kind = "empty" if self.walked.is_empty[cell] else "with objects"
        rows = (
            Row("Cells Entered", f"{cell + 1} of {len(self.t)}", "N_ETS of this ray"),
            Row("Cell", self.name_of(cell), "Its numbers [i, j, k] along x, y and z"),
            Row("Entered at", f"t = {number(self.t[cell])}", "Ray parameter of entry"),
            Row("Left at", f"t = {number(self.t_exit[cell])}", "Ray parameter of the next wall"),
        )
        caption = f"Cell {cell}, {self.name_of(cell)}, {kind}; {way}"
        return picture_of(parts, caption, marks=marks, rows=rows)


def steps_from_cell_to_cell(structure: Any) -> str:
    """Accept uniform grids, see :attr:`.lesson.Lesson.suits`."""
    if not isinstance(structure, Grid) or isinstance(structure, Skipping):
        return f"{structure.label} is no uniform grid that is walked cell by cell"
    if structure.arrays.resolution.max() > MOST_WALLS:
        return f"it has more than {MOST_WALLS} cells along an axis, which nobody can tell apart"
    return ""


def play_of(kind: type[Traversal]) -> Any:
    """Return the function that plays a lesson."""

    def play(subject: Subject, settings: Any, progress: Progress) -> Play:
        grid = subject.structures[0]
        progress.report(0, 2, "Choosing a ray")
        rays = ray_of(subject, [grid], near(ENOUGH), progress, is_oblique=True)
        progress.report(1, 2, "Following the ray")
        walked = Walked.of(grid, rays, progress)
        if not len(walked.visits):
            raise InputError("this ray misses the grid; choose one that enters it")
        return kind(walked)

    return play


SHARED: dict[str, Any] = {
    "source": "structures.grid.dda",
    "sample": "suzanne:subdivisions=2",
    "structures": ("grid:resolution=8x8x8",),
    "suits": steps_from_cell_to_cell,
    "takes_ray": True,
}

LESSONS = (
    Lesson(
        name="grid_traversal",
        label="Grid Traversal Cell by Cell",
        slide="Grid traversal (3D DDA) 1",
        begin="A ray goes through a grid from cell to cell, always through the wall it meets first",
        look_for="The next cell is always one of six neighbours: one of i, j, k changes by one, "
        "and the colour of the crossing says which",
        question="How many cells can a ray enter at most in a grid of n x n x n cells?",
        answer="3 n - 2: it crosses at most n - 1 walls of each of the three systems, and enters "
        "one cell more than it crosses walls",
        Settings=CellSettings,
        play=play_of(CellByCell),
        film="cell",
        **SHARED,
    ),
)
