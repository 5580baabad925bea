"""Lesson "directional cube": the cube around a light, its cells, and what one of them sees.

As on the lecture's slides "Directional cube (adaptive)" and "Directional cube": cells of the faces
are equal, or divided where lists are long, and each stores its objects, nearest first
(:mod:`..structures.directional`; REFERENCE.md A22).

Cells with something are tinted by the length of their list. One cell is bright: orange the pyramid
that is seen through it; green its objects, with their numbers in the list, and their projections
onto the cube, as they were inserted. Empty cells are not drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..printing import show_integer
from ..progress import Progress
from ..structures.directional.settings import UNIFORM
from ..structures.light_buffer import LightBuffer, LightBufferSettings
from .directions import (
    MOST_NUMBERED,
    Projections,
    cell_setting,
    cells_setting,
    corners_at,
    cube_edges,
    division_setting,
    drawn_cells,
    lengths_of,
    list_of,
    lit,
    longest_first,
    longest_setting,
    numbered,
    pyramid,
    reach_of,
    tinted_cells,
)
from .drawing import GREEN, ORANGE, Faces, Lines, coloured, counted, items_in, outlines, picture_of
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Mark, Picture, Row

MOST_FOOTPRINTS = 60
"""Projections that are drawn: of the nearest."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    division: str = division_setting("a face", "squares")
    cells: int = cells_setting(8, "an edge of a face", 64)
    longest: int = longest_setting(24)
    cell: int = cell_setting()


class DirectionalCube(Play):
    """The cube around one light."""

    def __init__(self, buffer: LightBuffer, light: str, progress: Progress) -> None:
        self.buffer, self.light, self.scene = buffer, light, buffer.scene
        self.order, self.lengths = longest_first(buffer), lengths_of(buffer)
        self.ends = {"cell": len(self.order) - 1}
        self.half = buffer.drawn_size
        cells, lengths = drawn_cells(buffer)
        corners = corners_at(buffer, cells, self.half)
        self.cube = [
            cube_edges(buffer, self.half),
            *tinted_cells(corners, lengths, int(self.lengths.max())),
        ]
        self.projections: dict[int, Projections] = {}
        faces = np.unique(buffer.squares.face[self.order]).tolist()
        for n, face in enumerate(faces):
            told = partial(progress.report, n, len(faces), "Projecting the objects")
            self.projections[face] = Projections.of(buffer, face, told)
        is_leaf = buffer.lists.children < 0
        seen = is_leaf & (self.lengths > 0)
        weights = buffer.weights
        self.empty_share = 1.0 - float(weights[seen].sum())
        self.mean = float((weights * self.lengths)[seen].sum() / weights[seen].sum())
        self.n_cells = int(is_leaf.sum())

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one cell."""
        buffer, cell = self.buffer, int(self.order[settings.cell])
        listing, face = list_of(buffer, cell), int(buffer.squares.face[cell])
        item = self.scene.item_name
        near = corners_at(buffer, np.array([cell]), 1.004 * self.half)
        reach = max(reach_of(buffer, face, listing.places), 1.2 * self.half)
        parts: list[Lines | Faces] = [*self.cube]
        parts += self.projections[face].drawn(
            buffer, listing.places[:MOST_FOOTPRINTS], 1.008 * self.half, GREEN
        )
        parts.append(coloured(outlines(near), ORANGE))
        parts += pyramid(buffer, cell, self.half, reach, ORANGE)
        parts.append(items_in(self.scene, listing.items, GREEN, 0.55))
        n_items = len(listing.items)
        marks = numbered(buffer, listing.places)
        origin = buffer.faces.origins[face]
        marks.append(Mark(origin + np.array([0.0, 0.0, 1.25 * self.half]), "light"))
        if n_items > MOST_NUMBERED:
            last = corners_at(buffer, np.array([cell]), reach)[0].mean(axis=0)
            marks.append(Mark(last, f"and {n_items - MOST_NUMBERED} more", GREEN[:3]))
        name = f"{'+-'[face % 2]}{'xyz'[face // 2]}"
        n_cells, n_all = show_integer(len(self.order)), show_integer(len(self.scene))
        caption = (
            f"Cell {settings.cell} of {n_cells} with {item}s, in face {name}: it lists "
            f"{counted(n_items, item, f'{item}s')} of {n_all}, nearest first"
        )
        if buffer.lists.cover[cell] >= 0:
            covering = int(buffer.geometry.ids[buffer.lists.cover[cell]])
            caption += f"; {item} {covering} covers it, and what begins behind is not listed"
        rows = (
            Row("Cells", show_integer(self.n_cells), "Of all six faces"),
            Row("With Objects", show_integer(len(self.order)), "The others are empty"),
            Row("Empty Directions", f"{self.empty_share:.1%}",
                "Share of all directions in which the light meets nothing"),
            Row("Longest List", str(int(self.lengths.max())), "Objects in cell 0"),
            Row("Mean List", f"{self.mean:.3g}",
                "Over all directions in which there is something"),
            Row("References", show_integer(int(self.lengths.sum())),
                "An object is listed in every cell that it may be seen through"),
            Row("Nearest", f"{listing.nearest[0]:.4g}",
                "Least distance of the first object of this cell from the light"),
            Row("Light", self.light, "Around which the cube is"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the longest list, one of middle length, and two uniform divisions."""
        return [
            Settings(),
            Settings(cell=len(self.order) // 2),
            Settings(UNIFORM, 8),
            Settings(UNIFORM, 32),
        ]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Divide the cube around a light."""
    progress.report(0, 2, "Filling the cells of the cube")
    scene, light = lit(subject.scene)
    is_uniform = settings.division == UNIFORM
    chosen = LightBufferSettings(
        division=settings.division, cells=settings.cells,
        max_list_size=LightBufferSettings.max_list_size if is_uniform else settings.longest,
    )  # fmt: skip
    buffer = LightBuffer.build(scene, chosen, progress)
    progress.report(1, 2, "Projecting the objects")
    return DirectionalCube(buffer, light, progress)


LESSONS = (
    Lesson(
        name="directional_cube",
        label="The Directional Cube",
        slide="Directional cube",
        begin="A cube around a point sorts objects by the direction in which they are seen: each "
        "cell of its faces lists those that may be seen through it",
        look_for="Adaptive cells are small where many objects are seen, and large beside them; "
        "what a cell lists is all that its pyramid meets, also what is hidden behind something",
        question="Why may a cell list an object that no ray through it hits, but never leave out "
        "one that some ray hits?",
        answer="One too many costs a test and changes nothing; one too few is a shadow that is "
        "missing. So insertion has to be conservative",
        source="structures.directional.lists",
        sample="suzanne:subdivisions=0",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="cell",
        replays=("division", "cells", "longest"),
    ),
)
