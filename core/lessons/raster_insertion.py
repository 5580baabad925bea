"""Lesson "raster insertion": a face of the cube drawn as an image, beside what is exact.

As on the lecture's slide "Directional cube": "HW rasterization and visibility (depth-buffer) can be
used for uniform division". Every cell has some pixels and lists what is visible at the middle of
one (:mod:`..structures.directional.raster`; REFERENCE.md A22). What falls between the pixels is
missed, so the structure goes on to the exact list where a ray is not blocked by what was drawn.

Beside the model is the face of the cube that most is seen through: on the left the image, each
object in a colour of its own, with the borders of cells; on the right the cells, tinted by what is
missed in them: red, and the darker the more. Bright red are the objects that have blocked a shadow
ray and were not drawn in its cell, as the structure has counted them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..colours import ramp
from ..printing import show_integer
from ..progress import Progress
from ..settings import setting
from ..structures.directional.insertion import view_of
from ..structures.directional.lists import NONE
from ..structures.directional.raster import drawn_face
from ..structures.directional.settings import UNIFORM
from ..structures.light_buffer import RASTER, LightBuffer, LightBufferSettings
from .directions import Projections, list_of, lit, shadow_rays_seen
from .drawing import (
    GREY,
    RED,
    Faces,
    Lines,
    coloured,
    counted,
    halves,
    opaque,
    outlines,
    picture_of,
)
from .lesson import Lesson, Play, Subject, build, only_its_own
from .picture import Mark, Picture, Row

SIZE = 0.62
"""Edge of a board, in diagonals of the scene."""

MOST_PIXELS = 9216
"""Pixels that are drawn on the board; of more, every second of every second row, and so on."""

ACROSS = np.array([0.81, 0.59, 0.0])
"""Along the boards, upright before those who look from the front right."""

MOST_OUTLINES = 150
"""Overlooked objects that are drawn."""

GOLDEN = 0.618_033_988_75
"""Turns of hue between objects that follow each other: neighbours have different colours."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    cells: int = setting(
        8, "Cells", "Cells along an edge of the face", unit="cells", minimum=1, maximum=64
    )
    pixels: int = setting(
        2, "Pixels", "Pixels along an edge of a cell", unit="pixels", minimum=1, maximum=8
    )
    dilation: int = setting(
        0, "Dilation", "Pixels around a cell that are its own as well", unit="pixels", minimum=0,
        maximum=8,
    )  # fmt: skip
    shown: str = setting(
        "missed",
        "Right Board",
        "What the right board shows of each cell",
        choices={"missed": "What is missed there", "listed": "How long its exact list is"},
    )


class RasterInsertion(Play):
    """One face, drawn and exact.

    Attributes
    ----------
    drawn_items : (n, n) int64
        The item that each pixel shows, by its place in the geometry; row 0 is the lowest v.
    exact, drawn : (size * size,) int64
        How many items each cell of the face lists exactly, and of what was drawn.
    missed : (size * size,) int64
        How many of its exact list were not drawn into a cell.
    window : tuple of (2,) float64 and float
        The corner, in u and v, and the width of the square that holds all cells with something.
    overlooked_items : (k,) int64
        Places of items that blocked rays and were not drawn in their cells.
    """

    def __init__(
        self, buffer: LightBuffer, light: str, counted_rays: tuple[int, int, np.ndarray],
        progress: Progress,
    ) -> None:  # fmt: skip
        self.buffer, self.light, self.scene = buffer, light, buffer.scene
        self.n_rays, self.n_blocked, overlooked = counted_rays
        lists, drawn = buffer.lists, buffer.arrays.drawn
        settings = buffer.settings
        self.size, width = settings.cells, settings.cells * settings.pixels
        of_face = (lists.last - lists.first).reshape(-1, self.size**2).sum(axis=1)
        self.face = int(of_face.argmax())
        told = partial(progress.report, 0, 2, "Drawing the face")
        self.projections = Projections.of(buffer, self.face, told)
        footprints = self.projections.footprints
        shown = drawn_face(view_of(buffer.insertion, self.face, footprints), width, told)
        items = np.append(footprints.item, NONE).astype(np.int64)
        self.drawn_items = items[shown]
        progress.report(1, 2, "Comparing the lists")
        first = self.face * self.size**2
        cells = range(first, first + self.size**2)
        self.exact = (lists.last - lists.first)[first : first + self.size**2]
        self.drawn = np.diff(drawn)[first : first + self.size**2]
        self.window = window_of((self.exact > 0).reshape(self.size, self.size))
        self.missed = np.array([len(missed_in(buffer, cell)) for cell in cells])
        self.overlooked_items = np.unique(overlooked)
        self.n_overlooked = len(overlooked)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of both boards."""
        item = self.scene.item_name
        n_exact, n_drawn, n_missed = (
            int(each.sum()) for each in (self.exact, self.drawn, self.missed)
        )
        parts = [*self.image_board(), *self.cell_board(settings.shown)]
        overlooked = [
            place for place in self.overlooked_items.tolist() if place in self.projections.rows
        ][:MOST_OUTLINES]
        for board in range(2):
            for place in overlooked:
                ring = self.at(board, *self.projections.outline(place).T)
                parts.append(coloured(outlines(ring[None]), RED))
        low, width = self.window
        places = [self.at(board, low[:1], low[1:] + 1.06 * width)[0] for board in range(2)]
        right = "missed in cells" if settings.shown == "missed" else "exact lists"
        marks = [
            Mark(place, text)
            for place, text in zip(places, ("drawn at pixels", right), strict=True)
        ]
        name = f"{'+-'[self.face % 2]}{'xyz'[self.face // 2]}"
        caption = (
            f"Face {name}: of {show_integer(n_exact)} references {show_integer(n_exact - n_missed)}"
            f" are visible at pixels, {show_integer(n_missed)} are not; of "
            f"{counted(self.n_blocked, 'blocked shadow ray', 'blocked shadow rays')} "
            f"{show_integer(self.n_overlooked)} would be lit wrongly"
        )
        rows = (
            Row("Listed Exactly", show_integer(n_exact),
                f"References to {item}s in the cells of this face, none missing"),
            Row("Drawn", show_integer(n_drawn), "References of what is visible at a pixel"),
            Row("Missed", show_integer(n_missed),
                "Listed exactly and not drawn: hidden behind others, or between the pixels"),
            Row("Overlooked", show_integer(self.n_overlooked),
                "Shadow rays that are blocked by what was not drawn into their cell"),
            Row("Shadow Rays", show_integer(self.n_rays), "Of a small picture from the front"),
            Row("Blocked", show_integer(self.n_blocked), "Shadow rays that meet something"),
            Row("Light", self.light, "Around which the cube is"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return what was played, in both ways."""
        return [settings, Settings(settings.cells, settings.pixels, settings.dilation, "listed")]

    def at(self, board: int, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return places of the face on the left board (0) or the right (1), (n, 3)."""
        edge, (low, width) = SIZE * self.scene.diagonal, self.window
        corner = 0.5 * (self.scene.lower + self.scene.upper)
        corner = corner + (0.5 + 0.75 * board) * self.scene.diagonal * ACROSS
        corner[2] -= 0.5 * edge
        along, up = ((np.stack([u, v]) - low[:, None]) / width * edge)[:, :, None]
        return corner + along * ACROSS + up * np.array([0.0, 0.0, 1.0])

    def shown_cells(self, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return u and v of the squares, of `size` times `size`, on the boards, and which they are.

        Which: (n,) int, row by row from below.
        """
        step, (low, width) = 2.0 / size, self.window
        first, count = np.rint((low + 1.0) / step).astype(np.int64), round(width / step)
        j, i = (each.ravel() for each in np.indices((count, count)))
        j, i = j + first[1], i + first[0]
        return -1.0 + step * i, -1.0 + step * j, j * size + i

    def squares(self, board: int, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a board's squares, (n, 4, 3), and which they are, (n,)."""
        u, v, number = self.shown_cells(size)
        width = 2.0 / size
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
        places = [self.at(board, u + width * x, v + width * y) for x, y in corners]
        return np.stack(places, axis=1), number

    def rulings(self, board: int) -> Lines:
        """Return the borders between the cells."""
        low, width = self.window
        count = round(width * self.size / 2.0)
        share, ones = np.linspace(0.0, width, count + 1), np.ones(count + 1)
        u, v = low
        lines = [
            np.stack([self.at(board, u + share, v * ones),
                      self.at(board, u + share, (v + width) * ones)], axis=1),
            np.stack([self.at(board, u * ones, v + share),
                      self.at(board, (u + width) * ones, v + share)], axis=1),
        ]  # fmt: skip
        return coloured(np.concatenate(lines), (*GREY[:3], 0.6 if count <= 32 else 0.25))

    def colours(self) -> np.ndarray:
        """Return the colours of the pixels, (n, n, 3): white where nothing is."""
        colours = np.ones((*self.drawn_items.shape, 3))
        is_there = self.drawn_items >= 0
        colours[is_there] = ramp((self.drawn_items[is_there] * GOLDEN) % 1.0)
        return colours

    def image_board(self) -> list[Lines | Faces]:
        """Return the image."""
        squares, number = self.squares(0, len(self.drawn_items))
        every = math.ceil(math.sqrt(len(squares) / MOST_PIXELS))
        if every > 1:
            # The lower left of so many times so many pixels stands for all of them.
            side = math.isqrt(len(squares))
            chosen = np.arange(len(squares)).reshape(side, side)[::every, ::every].ravel()
            corner = squares[chosen, :1]
            squares, number = corner + every * (squares[chosen] - corner), number[chosen]
        is_there = self.drawn_items.ravel()[number] >= 0
        colours = opaque(self.colours().reshape(-1, 3)[number[is_there]])
        colours[:, 3] = 0.75
        faces = Faces(halves(squares[is_there]), np.repeat(colours, 2, axis=0))
        return [faces, self.rulings(0)]

    def cell_board(self, shown: str) -> list[Lines | Faces]:
        """Return the cells, tinted by what is missed, or listed."""
        values = self.missed if shown == "missed" else self.exact
        filled = values > 0
        share = values / max(int(values.max()), 1)
        colours = np.empty((len(values), 4))
        if shown == "missed":
            colours[:, :3], colours[:, 3] = RED[:3], 0.05 + 0.45 * share
        else:
            colours[:, :3], colours[:, 3] = ramp(share), 0.4
        squares, number = self.squares(1, self.size)
        squares, number = squares[filled[number]], number[filled[number]]
        faces = Faces(halves(squares), np.repeat(colours[number], 2, axis=0))
        return [faces, self.rulings(1)]


def window_of(filled: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the corner, (2,) in u and v, and the width of the square that holds some cells.

    Parameters
    ----------
    filled : (n, n) bool
        By rows along v.
    """
    size = len(filled)
    rows, columns = np.flatnonzero(filled.any(axis=1)), np.flatnonzero(filled.any(axis=0))
    ends = np.array([[columns[0], rows[0]], [columns[-1] + 1, rows[-1] + 1]])
    count = int((ends[1] - ends[0]).max())
    first = np.clip((ends.sum(axis=0) - count) // 2, 0, size - count)
    return -1.0 + first * (2.0 / size), count * (2.0 / size)


def missed_in(buffer: LightBuffer, cell: int) -> np.ndarray:
    """Return the places of items that a cell lists exactly, and that were not drawn into it."""
    return np.setdiff1d(list_of(buffer, cell).places, buffer.drawn_into(cell))


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Draw the items into the cube, and trace shadow rays through it."""
    progress.report(0, 3, "Drawing the objects into cells")
    scene, light = lit(subject.scene)
    chosen = LightBufferSettings(
        division=UNIFORM, cells=settings.cells, insert=RASTER, pixels=settings.pixels,
        dilation=settings.dilation,
    )  # fmt: skip
    buffer = LightBuffer.build(scene, chosen, progress)
    progress.report(1, 3, "Tracing shadow rays")
    rays = shadow_rays_seen(scene, build(scene, "bvh", progress), progress)
    overlooked, n_rays, n_blocked = np.empty(0, np.int64), 0, 0
    if rays is not None:
        hits, counts = buffer.trace(rays, progress=progress)
        n_rays, n_blocked = len(rays), int((hits.primitive >= 0).sum())
        # By their numbers in the scene; places are those of the geometry.
        place_of = np.argsort(buffer.geometry.ids, kind="stable")
        overlooked = place_of[hits.primitive[counts["overlooked"] > 0]]
    progress.report(2, 3, "Comparing the lists")
    return RasterInsertion(buffer, light, (n_rays, n_blocked, overlooked), progress)


LESSONS = (
    Lesson(
        name="raster_insertion",
        label="Cells Filled by Drawing",
        slide="Directional cube",
        begin="Graphics hardware can fill the cells of a cube: it draws the objects into each "
        "face, and a cell lists what is visible at its pixels",
        look_for="What is smaller than a pixel falls between the pixels, and what is hidden is not "
        "drawn: with more pixels, or dilation, less is overlooked, and never nothing for certain",
        question="What lies hidden behind a nearer object is not drawn. Why is it no fault that "
        "its cell does not list it?",
        answer="A ray from behind both is blocked by the nearer one, wherever that covers the "
        "hidden one. Between the middles of pixels it need not: there a shadow can be lost",
        source="structures.directional.raster",
        sample="suzanne:subdivisions=0",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="dilation",
        replays=("cells", "pixels", "dilation"),
    ),
)
