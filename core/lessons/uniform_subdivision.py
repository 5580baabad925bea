"""Lesson "uniform subdivision": the grid over the object, and which of its cells matter.

The lines of the grid are drawn on three sides of its box. Shown are the cells with objects, as one
body (orange), or the cells that a ray enters: orange with objects, blue without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..memory import in_words
from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.grid import Grid, GridSettings
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    Faces,
    Lines,
    coloured,
    counted,
    outlines,
    picture_of,
    quads,
)
from .lesson import Lesson, Play, Subject
from .one_ray import Counted, Walked, ray_of
from .picture import Picture, Row

MOST_SIDES = 1500
"""Sides of cells whose edges are drawn; of more only the faces."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    resolution: int = setting(
        10, "Cells Along the Longest Side", "Along the others as many as make the cells cubes",
        unit="cells", minimum=1, maximum=64,
    )  # fmt: skip
    shown: str = setting(
        "objects",
        "Shown",
        "Which cells are drawn",
        choices={"objects": "The cells with objects", "ray": "The cells that a ray enters"},
    )


def resolution_of(scene: Scene, along_longest: int) -> tuple[int, int, int]:
    """Return the resolution whose cells are cubes, or nearly so."""
    size = scene.upper - scene.lower
    x, y, z = np.maximum(np.rint(along_longest * size / size.max()), 1).astype(int).tolist()
    return x, y, z


class UniformSubdivision(Play):
    """One grid, and one ray through it."""

    def __init__(self, grid: Grid, walked: Walked) -> None:
        self.grid, self.walked = grid, walked
        self.counts = np.diff(grid.arrays.offsets)
        self.sides = border_of(grid, self.counts > 0)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of what is asked for."""
        resolution = "x".join(str(n) for n in self.grid.arrays.resolution)
        n_occupied, n_cells = int((self.counts > 0).sum()), len(self.counts)
        parts: list[Lines | Faces] = [coloured(rulings(self.grid), (*GREY[:3], 0.35))]
        rows = [
            Row("Resolution", resolution, "Cells along x, y and z"),
            Row("Cells", show_integer(n_cells), "N_V"),
            Row("With Objects", f"{show_integer(n_occupied)}, {n_occupied / n_cells:.0%}",
                "The others are empty"),
            Row("References", show_integer(int(self.counts.sum())),
                "N_OIV: an object is listed in every cell that it reaches into"),
            Row("Memory", in_words(self.grid.memory()), "Without the objects themselves"),
        ]  # fmt: skip
        if settings.shown == "objects":
            parts += self.objects()
            share = f"{n_occupied / n_cells:.0%}"
            caption = (
                f"{resolution} = {counted(n_cells, 'cell', 'cells')}: "
                f"{show_integer(n_occupied)} with objects, {share}; the others are empty"
            )
        else:
            parts += self.along_ray()
            counts, of_all = self.walked.counts, show_integer(len(self.grid.scene))
            entered, empty = counts["N_ETS"], counts["N_EETS"]
            rows += [
                Row("Entered", str(entered), "N_TS: cells that the ray enters"),
                Row("Empty Ones", str(empty), "N_EETS"),
                Row("Tests", str(counts["N_IT"]), "N_IT: objects that the ray is tested against"),
            ]
            caption = (
                f"{resolution} = {counted(n_cells, 'cell', 'cells')}: the ray enters "
                f"{entered}, {empty} of them empty, and is tested against "
                f"{counted(counts['N_IT'], 'object', 'objects')} of {of_all}"
            )
        return picture_of(parts, caption, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return few cells, more cells, and a ray through these."""
        return [Settings(4), Settings(10), Settings(10, "ray"), Settings(30)]

    def objects(self) -> list[Lines | Faces]:
        """Return the border of the cells with objects."""
        parts: list[Lines | Faces] = [quads(self.sides, ORANGE, 0.16)]
        if len(self.sides) <= MOST_SIDES:
            parts.append(coloured(outlines(self.sides), (*ORANGE[:3], 0.6)))
        return parts

    def along_ray(self) -> list[Lines | Faces]:
        """Return the cells that the ray enters, and the ray."""
        boxes, is_empty = self.walked.cells.boxes[self.walked.places], self.walked.is_empty
        return [
            coloured(box_segments(boxes[is_empty]), (*BLUE[:3], 0.8)),
            coloured(box_segments(boxes[~is_empty]), ORANGE),
            *self.walked.ray_lines(),
        ]


def border_of(grid: Grid, is_inside: np.ndarray) -> np.ndarray:
    """Return the sides between cells within and without a set, (k, 4, 3)."""
    resolution = tuple(int(n) for n in grid.arrays.resolution)
    padded = np.pad(is_inside.reshape(resolution), 1)
    lower, size = grid.arrays.box[0, :3], grid.arrays.cell_size
    found = []
    for axis in range(3):
        # Between cell i - 1 and i of an axis stands wall i.
        others = tuple(slice(None) if a == axis else slice(1, -1) for a in range(3))
        index = np.argwhere(np.diff(padded[others].astype(np.int8), axis=axis))
        boxes = np.concatenate([lower + index * size, lower + (index + 1) * size], axis=1)
        found.append(planes_across(boxes, axis, boxes[:, axis]))
    return np.concatenate(found)


def rulings(grid: Grid) -> np.ndarray:
    """Return the grid's lines on the floor, the back and the left of its box, (k, 2, 3)."""
    box = grid.arrays.box[0]
    lower, upper = box[:3], box[3:]
    sides = ((2, lower), (1, upper), (0, lower))  # as seen from the front right, from above
    lines = []
    for axis, corner in sides:
        u, v = (a for a in range(3) if a != axis)
        for along, across in ((u, v), (v, u)):
            count = int(grid.arrays.resolution[across])
            ends = np.empty((count + 1, 2, 3))
            ends[..., axis] = corner[axis]
            ends[:, 0, along], ends[:, 1, along] = lower[along], upper[along]
            ends[..., across] = np.linspace(lower[across], upper[across], count + 1)[:, None]
            lines.append(ends)
    return np.concatenate(lines)


def meets_most(counted_in: Sequence[Counted], hits: np.ndarray) -> np.ndarray:
    """Prefer rays that hit, and enter many cells before."""
    return hits * 1000 + counted_in[0]["N_ETS"]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Build a grid of this resolution, and follow a ray."""
    progress.report(0, 2, "Building the grid")
    resolution = resolution_of(subject.scene, settings.resolution)
    grid = Grid.build(subject.scene, GridSettings(resolution=resolution), progress)
    progress.report(1, 2, "Following a ray")
    rays = ray_of(subject, [grid], meets_most, progress)
    return UniformSubdivision(grid, Walked.of(grid, rays, progress))


LESSONS = (
    Lesson(
        name="uniform_subdivision",
        label="Uniform Subdivision: the Grid",
        slide="Uniform subdivision (grid)",
        begin="A grid cuts the box of the scene into equal cells, and each lists the objects that "
        "reach into it",
        look_for="More cells enclose the object more closely and save tests, but ever more of them "
        "are empty, and a ray has to pass them",
        question="A surface is cut by n x n x n cells. How do the cells with objects grow with n, "
        "and how the empty ones?",
        answer="Those with objects like n squared, as the surface has two dimensions; all cells "
        "like n cubed, so nearly all of them are empty in the end",
        source="structures.grid.cells",
        sample="suzanne:subdivisions=2",
        Settings=Settings,
        play=play,
        film="resolution",
        replays=("resolution",),
        takes_ray=True,
    ),
)
