"""What a lesson shows: lines, translucent faces, text in space, images, rows of figures, a caption.

The same picture is drawn by the overlay, painted into a PNG and printed by the command line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

MOST_SEGMENTS = 20_000
"""Segments in one picture; more of them are a grey mass."""


@dataclass(frozen=True)
class Mark:
    """Text at a point in space.

    Attributes
    ----------
    position : (3,) array_like of float
        The text stands beside it, to the right.
    text : str
        A few words, on one line.
    colour : (3,) of float, optional
        sRGB; by default whatever is legible on the background.
    line : int
        In a column of texts, how many of them come before it; they stand together on the screen.
    """

    position: np.ndarray
    text: str
    colour: tuple[float, float, float] | None = None
    line: int = 0


@dataclass(frozen=True)
class Image:
    """An image beside the model, such as a heat map.

    Attributes
    ----------
    name : str
        What a file of it is called.
    pixels : (height, width, 3) float64
        sRGB from 0 to 1; row 0 is the top.
    values : (height, width) float64, optional
        What the colours mean.
    """

    name: str
    pixels: np.ndarray
    values: np.ndarray | None = None


@dataclass(frozen=True)
class Row:
    """A figure behind its label; `meaning` is one sentence about it, without a full stop."""

    label: str
    text: str
    meaning: str = ""


def in_columns(marks: Sequence[Mark]) -> list[list[Mark]]:
    """Return texts in their columns, of which most are a single one."""
    columns: list[list[Mark]] = []
    for mark in marks:
        if mark.line:
            columns[-1].append(mark)
        else:
            columns.append([mark])
    return columns


NO_LINES, NO_FACES, NO_COLOURS = np.empty((0, 2, 3)), np.empty((0, 3, 3)), np.empty((0, 4))


@dataclass(frozen=True)
class Picture:
    """One picture.

    Attributes
    ----------
    caption : str
        What is to be seen, with its figures.
    segments : (k, 2, 3) float64
        Both ends of each line; where lines coincide, the last is seen.
    colours : (k, 4) float64
        sRGB and opacity of each line.
    faces : (m, 3, 3) float64
        Translucent triangles.
    face_colours : (m, 4) float64
        sRGB and opacity of each.
    marks : tuple of Mark
    rows : tuple of Row
    images : tuple of Image
    """

    caption: str
    segments: np.ndarray = field(default_factory=NO_LINES.copy)
    colours: np.ndarray = field(default_factory=NO_COLOURS.copy)
    faces: np.ndarray = field(default_factory=NO_FACES.copy)
    face_colours: np.ndarray = field(default_factory=NO_COLOURS.copy)
    marks: tuple[Mark, ...] = ()
    rows: tuple[Row, ...] = ()
    images: tuple[Image, ...] = ()

    def points(self) -> np.ndarray:
        """Return all that the view has to have in it, (n, 3)."""
        marks = [np.asarray(mark.position, dtype=np.float64)[None] for mark in self.marks]
        return np.concatenate([self.segments.reshape(-1, 3), self.faces.reshape(-1, 3), *marks])
