"""Lessons "radix_sort" and "radix_split": Morton codes are sorted digit by digit, bit by bit.

"radix_sort" shows the codes as bars in the order that they have after each pass of the builder's
sort, one digit a pass, the lowest first; the colour is what they are sorted by so far.

"radix_split" shows for some of the codes what the lecture's primitive does with one bit. On top the
codes, a column each, its highest bit on top; the bit of this pass is outlined. Below how many zeros
there are before each code, an exclusive prefix sum, and where each code goes: zeros (blue) to the
left, ones (orange) to the right, otherwise in order.

No log has passes of a sort: it is done again, by the builder's own kernels, with the codes of the
same triangles. Lecture, slide "Parallel radix sort on GPU (CUDA)".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..colours import ramp
from ..parallel import Team
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.builders.morton.codes import codes_of
from ..structures.bvh.builders.morton.radix_sort import DIGIT, passes, split
from ..structures.bvh.hierarchy import BVH
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Chart,
    Faces,
    Lines,
    chart_below,
    coloured,
    counted,
    extent_of,
    opaque,
    outlines,
    picture_of,
    quads,
)
from .hierarchy import tree_of
from .lesson import Lesson, Play, Subject
from .morton_intervals import sorts_by_code
from .picture import Mark, Picture, Row
from .scattering import TOP, drawn_items, drawn_result, drawn_sums, names_of_rows

BARS = 500
"""Bars of the sort; of more codes every second, third, ... is drawn."""

SPLIT_CODES = 16
"""Codes that are split bit by bit."""


@dataclass(frozen=True)
class PassSettings:
    """The knob of the lesson "radix_sort"."""

    done: int = setting(
        1, "Passes", "Passes that are done; 0 shows the codes as they come", minimum=0
    )


@dataclass(frozen=True)
class BitSettings:
    """The knob of the lesson "radix_split"."""

    bit: int = setting(0, "Bit", "Which bit this pass is about; 0 is the lowest", minimum=0)


class RadixSort(Play):
    """The codes before the sort and after each pass, or evenly chosen ones of them."""

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.scene, self.bits, self.count = bvh.scene, int(bvh.settings.morton_bits), len(bvh.scene)
        self.stride = -(-self.count // BARS)
        with Team(progress, "Sorting") as team:
            codes = codes_of(self.scene.boxes(), bvh.settings, team)
            self.states = [codes[:: self.stride].copy()]
            self.states += [now[:: self.stride].copy() for now, _ in passes(codes, self.bits, team)]
        self.ends = {"done": len(self.states) - 1}

    def picture(self, settings: PassSettings) -> Picture:
        """Return the picture after some passes."""
        codes, number, last = self.states[settings.done], settings.done, self.ends["done"]
        done = min(number * DIGIT, self.bits)
        if number == 0:
            caption = (
                f"{counted(self.count, 'code', 'codes')} of {self.bits} bits in the order of the "
                "triangles"
            )
        else:
            caption = (
                f"Pass {number} of {last}, bits {(number - 1) * DIGIT} to {done - 1}: "
                f"sorted by the lowest {done} bits, which the colour shows"
            )
        if self.stride > 1:
            caption += f"; drawn: one code of {self.stride}"
        chart = chart_below(self.scene, len(codes), 2.0**self.bits)
        place = np.arange(len(codes)) + 0.5
        ends = chart.points(np.tile(place, 2), np.append(np.zeros(len(codes)), codes))
        lowest = (codes & (1 << done) - 1) / 2.0**done if number else codes / 2.0**self.bits
        bars = Lines(ends.reshape(2, -1, 3).swapaxes(0, 1), opaque(ramp(lowest)))
        rows = [
            Row("Codes", str(self.count), "One for each triangle"),
            Row("Bits", str(self.bits), "Of a code"),
            Row("Digit", str(DIGIT), "Bits that one pass sorts by"),
            Row("Passes", f"{number} of {last}", "Each leaves equal digits in their order"),
        ]
        marks = [Mark(chart.at(1.03, 0.0), "place"), Mark(chart.at(0.0, 1.1), "code")]
        return picture_of([chart.axes(), bars], caption, marks=marks, rows=rows)


class RadixSplit(Play):
    """Some of the codes, split bit by bit.

    Attributes
    ----------
    orders : list of (n,) int64
        The codes before each pass.
    places : list of (n,) int64
        Where each goes in it.
    """

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.scene, self.bits = bvh.scene, int(bvh.settings.morton_bits)
        self.stride = -(-len(bvh.scene) // SPLIT_CODES)
        with Team(progress, "Computing codes") as team:
            codes = codes_of(bvh.scene.boxes(), bvh.settings, team)[:: self.stride]
        self.orders, self.places = [codes], []
        for bit in range(self.bits):
            self.places.append(split(self.orders[-1], bit))
            self.orders.append(self.orders[-1][np.argsort(self.places[-1])])
        self.ends = {"bit": self.bits - 1}

    def picture(self, settings: BitSettings) -> Picture:
        """Return what one pass does."""
        bit = settings.bit
        codes, places = self.orders[bit], self.places[bit]
        count, is_zero = len(codes), (codes >> bit & 1) == 0
        n_zeros = int(is_zero.sum())
        # A zero goes behind the zeros before it, a one behind all zeros and the ones before it.
        before = np.where(is_zero, places, n_zeros + np.arange(count) - places)
        chart = chart_below(self.scene, count, TOP, height=0.95)
        bars, numbers = drawn_sums(chart, before, is_zero)
        parts = [*drawn_items(chart, is_zero), *bars, *drawn_result(chart, places, is_zero)]
        names = names_of_rows(chart, count, f"bit {bit}", "zeros before", "after the pass")
        matrix, name = self._matrix(codes, bit)
        caption = (
            f"Bit {bit}: {counted(n_zeros, 'zero', 'zeros')} (blue) to the left, "
            f"{counted(count - n_zeros, 'one', 'ones')} (orange) to the right, otherwise in order"
        )
        if self.stride > 1:
            caption += f"; drawn: one code of {self.stride}"
        rows = [
            Row("Zeros", str(n_zeros), "They take the places 0, 1, ... in order"),
            Row("Ones", str(count - n_zeros), "They follow behind all zeros, in order"),
            Row("Passes", str(self.bits), "One for each bit of a code"),
        ]
        return picture_of([*parts, *matrix], caption, marks=[*numbers, *names, name], rows=rows)

    def _matrix(self, codes: np.ndarray, bit: int) -> tuple[list[Lines | Faces], Mark]:
        """Return the bits of all codes, to the right of the model; the highest on top."""
        size = extent_of(self.scene)
        chart = Chart.beside(self.scene, 0.0, len(codes), self.bits)
        grid = np.meshgrid(np.arange(len(codes)), np.arange(self.bits))
        column, row = (each.ravel() for each in grid)
        quad = chart.rectangles(column, column + 0.9, row, row + 0.9)
        is_one = (codes[column] >> row & 1).astype(bool)
        here = row == bit
        parts: list[Lines | Faces] = [
            quads(quad[is_one & ~here], GREY, 0.7),
            quads(quad[~is_one & ~here], GREY, 0.12),
            quads(quad[is_one & here], ORANGE, 0.8),
            quads(quad[~is_one & here], BLUE, 0.8),
        ]
        around = np.array([[0.0], [len(codes)], [bit], [bit + 1.0]])
        parts.append(coloured(outlines(chart.rectangles(*around)), RED))
        place = chart.place(len(codes) + 0.3, bit + 0.5) + np.array([0.02 * size, 0.0, 0.0])
        return parts, Mark(place, f"bit {bit}", RED[:3])


def play_sort(subject: Subject, settings: PassSettings, progress: Progress) -> Play:
    """Sort the codes once more, and keep what they are after every pass."""
    return RadixSort(tree_of(subject), progress)


def play_split(subject: Subject, settings: BitSettings, progress: Progress) -> Play:
    """Split some of the codes by all their bits."""
    return RadixSplit(tree_of(subject), progress)


LESSONS = (
    Lesson(
        name="radix_sort",
        label="Radix Sort, Pass by Pass",
        slide="Parallel radix sort on GPU (CUDA)",
        begin="Codes are sorted by one digit after the other, beginning with the lowest",
        look_for="After each pass the codes are in the order of all digits so far; only the last "
        "pass, over the highest digit, makes the bars ascend",
        question="Why does the sort begin with the lowest digit, and what must every pass keep?",
        answer="Every pass is stable: codes of equal digits stay in their order. So the order by "
        "the lower digits survives among codes that are equal in the higher ones, and after the "
        "last pass everything is sorted. From the highest digit on, each group would have to be "
        "sorted by itself",
        source="structures.bvh.builders.morton.radix_sort",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=lbvh",),
        suits=sorts_by_code,
        Settings=PassSettings,
        play=play_sort,
        film="done",
    ),
    Lesson(
        name="radix_split",
        label="One Bit of a Radix Sort",
        slide="Parallel radix sort on GPU (CUDA)",
        begin="With digits of one bit a pass is a split: zeros go to the left, ones to the right",
        look_for="The number below each code says how many zeros are before it; from that, its "
        "own place and the number of all zeros every code knows where to go, so all can move at "
        "once",
        question="A zero goes behind the zeros before it. How does a one find its place?",
        answer="It goes behind all zeros, and behind the ones before it. Those are all codes "
        "before it that are not zeros: place = number of all zeros + i - zeros before i",
        source="structures.bvh.builders.morton.radix_sort",
        sample="suzanne:subdivisions=0",
        structures=("bvh:builder=lbvh,morton_bits=30",),
        suits=sorts_by_code,
        Settings=BitSettings,
        play=play_split,
        film="bit",
    ),
)
