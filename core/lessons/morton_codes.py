"""Lesson "morton_codes": cells of a grid in the order of their codes, refined bit by bit.

A grid of 2^k cells per axis lies over the centroids. The curve joins the cells that have triangles
in them, in the order of their codes of 3 k bits. With every bit more per axis, each cell is divided
into eight, and the curve finishes one cell before it enters the next: codes of k bits are the
beginnings of those of k + 1 bits.

Of one triangle the cells that it lies in are drawn, one in another (orange), and its code is
written as bits: those of x, y and z interleaved, the bit of x first. Cells that share its parent
have their codes beside them. Codes and grid are the builder's. Lecture, slide "Morton code based
BVH tree"; G. M. Morton 1966.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import ramp
from ..geometry.box_shape import box_segments
from ..geometry.marks import stars
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import (
    GREY,
    ORANGE,
    Lines,
    coloured,
    column,
    counted,
    extent_of,
    faint,
    opaque,
    picture_of,
)
from .hierarchy import tree_of
from .lesson import Lesson, Play, Subject
from .morton_intervals import sorted_along, sorts_by_code
from .picture import Mark, Picture, Row

MOST_BITS = 10
"""Bits per axis up to which the grid is refined: those of codes of 30 bits."""

MOST_CELLS = 64
"""Cells of the grid up to which all that have triangles are drawn."""

MOST_PIECES = 6000
"""Pieces of the curve; of more cells every second, third, ... is joined."""

WRITTEN_BITS = 3
"""Bits per axis up to which neighbours of the triangle's cell have their codes beside them."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    bits: int = setting(
        2, "Bits per Axis", "k: the grid has 2^k cells per axis", minimum=1, maximum=MOST_BITS
    )
    triangle: int = setting(
        0, "Triangle", "Whose code is written; along the curve, the first is 0", minimum=0
    )


class MortonCodes(Play):
    """The codes of one scene.

    Attributes
    ----------
    codes : (n,) int64
        Ascending, of `bits` bits per axis.
    low, size : (3,) float64
        Of the grid.
    """

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.scene = bvh.scene
        found = sorted_along(bvh, progress)
        self.codes, self.centroids = found.codes, found.centroids
        self.bits = int(bvh.settings.morton_bits) // 3
        self.low = self.centroids.min(axis=0)
        self.size = self.centroids.max(axis=0) - self.low
        self.ends = {"triangle": len(self.codes) - 1}

    def codes_at(self, bits: int) -> np.ndarray:
        """Return the codes of a coarser grid, (n,) int64: their first bits."""
        return self.codes >> 3 * (self.bits - bits)

    def cells(self, codes: np.ndarray, bits: int) -> np.ndarray:
        """Return the boxes of cells, (k, 6)."""
        numbers = np.stack(numbers_of(codes, bits), axis=1)
        low = self.low + numbers * (self.size / (1 << bits))
        return np.concatenate([low, low + self.size / (1 << bits)], axis=1)

    def picture(self, settings: Settings) -> Picture:
        """Return the curve through the cells of a grid, and one triangle's code."""
        k = settings.bits
        all_codes = self.codes_at(k)
        first = np.flatnonzero(np.diff(all_codes, prepend=-1))
        occupied = all_codes[first]
        boxes = self.cells(occupied, k)
        step = -(-len(occupied) // MOST_PIECES)
        middles = (0.5 * (boxes[:, :3] + boxes[:, 3:]))[::step]
        pieces = np.stack([middles[:-1], middles[1:]], axis=1)
        along = np.arange(len(pieces)) / max(len(pieces) - 1, 1)
        parts = [Lines(pieces, opaque(ramp(along)))]
        if len(occupied) <= MOST_CELLS:
            parts.insert(0, coloured(box_segments(boxes), faint(GREY, 0.3)))
        code = int(all_codes[settings.triangle])
        nested = [self.cells(np.array([code >> 3 * (k - level)]), level) for level in range(k + 1)]
        parts.append(coloured(box_segments(np.concatenate(nested[:-1])), faint(ORANGE, 0.45)))
        parts.append(coloured(box_segments(nested[-1]), ORANGE))
        point = self.centroids[settings.triangle : settings.triangle + 1]
        parts.append(coloured(stars(point, np.array([0.06 * extent_of(self.scene)])), ORANGE))
        marks = self._marks(code, k)
        if k <= WRITTEN_BITS:
            siblings = np.flatnonzero(occupied >> 3 == code >> 3)
            for place in siblings.tolist():
                box, text = boxes[place], in_triples(int(occupied[place]), k)
                colour = ORANGE[:3] if occupied[place] == code else None
                marks.append(Mark(0.5 * (box[:3] + box[3:]), text, colour))
        counts = np.diff(np.append(first, len(all_codes)))
        caption = (
            f"k = {k}: {counted(len(occupied), 'cell', 'cells')} of {8**k} with triangles, joined "
            f"in the order of their codes of {3 * k} bits; triangle {settings.triangle} along the "
            f"curve has the code {in_triples(code, k)}"
        )
        if step > 1:
            caption += f"; drawn: one cell of {step}"
        rows = [
            Row("k", str(k), "Bits per axis"),
            Row("Cells", f"{8**k}", "Of the grid: 2^k along each axis"),
            Row("Occupied", str(len(occupied)), "Cells with triangles: different codes"),
            Row("Fullest Cell", str(int(counts.max())), "Triangles that share one code"),
            Row("Code", in_triples(code, k), "Of the triangle, triples of bits x y z"),
        ]
        return picture_of(parts, caption, marks=marks, rows=rows)

    def _marks(self, code: int, k: int) -> list[Mark]:
        """Return the numbers of the triangle's cell and its code, above the model."""
        numbers = [int(number[0]) for number in numbers_of(np.array([code]), k)]
        texts = [
            (f"{axis} = {number} = {number:0{k}b}", ORANGE)
            for axis, number in zip("xyz", numbers, strict=True)
        ]
        return column(self.scene, [*texts, (f"code = {in_triples(code, k)}", ORANGE)])

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first refinements, and one where the curve is fine."""
        return [Settings(bits, settings.triangle) for bits in (1, 2, 3, 6)]


def numbers_of(codes: np.ndarray, bits: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the numbers x, y, z of cells, (k,) each, whose bits codes interleave."""
    x, y, z = (np.zeros_like(codes) for _ in range(3))
    for bit in range(bits):
        for number, place in ((x, 2), (y, 1), (z, 0)):
            number |= (codes >> 3 * bit + place & 1) << bit
    return x, y, z


def in_triples(code: int, bits: int) -> str:
    """Return a code as bits, three by three."""
    text = f"{code:0{3 * bits}b}"
    return " ".join(text[i : i + 3] for i in range(0, len(text), 3))


def takes_bits_in_turn(structure: Any) -> str:
    """Accept trees whose codes interleave x, y and z, see :attr:`.Lesson.suits`."""
    if reason := sorts_by_code(structure):
        return reason
    if structure.settings.morton_codes != "standard":
        return "its codes do not have the bits of x, y and z in turn; take morton_codes=standard"
    return ""


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Sort the triangles along the curve."""
    return MortonCodes(tree_of(subject), progress)


LESSONS = (
    Lesson(
        name="morton_codes",
        label="Morton Codes",
        slide="Morton code based BVH tree",
        begin="Interleaving the bits of x, y and z gives each cell of a grid a place on one curve",
        look_for="With each bit more, a cell is divided into eight, and the curve runs through all "
        "of them before it goes on: neighbours on the curve are mostly neighbours in space",
        question="The curve makes long jumps. Where, and why does that not hurt the tree much?",
        answer="Where it leaves a large cell, as from 011 to 100, which differ in their first bit. "
        "The tree is split just there: the two ends of a jump are in different children of an "
        "upper node",
        source="structures.bvh.builders.morton.codes",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=lbvh",),
        suits=takes_bits_in_turn,
        Settings=Settings,
        play=play,
        film="bits",
    ),
)
