"""Exhibits of builders that sort along the Morton curve: the curve with its intervals, the sort.

"Morton curve" shows how the curve runs through the model, then the tree of LBVH level by level:
every interval in a colour of its own, the boxes around what is in them, and below the model the
intervals as brackets over the sorted codes. "Radix sort" shows the codes as bars after each pass.
"Radix-2 split" shows for some of the codes what the lecture's primitive does with one bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..colours import ramp
from ..geometry.box import boxes_of
from ..geometry.box_shape import box_segments
from ..kernels import call
from ..parallel import Team
from ..progress import SILENT, Progress
from ..structures.bvh.builders import BUILDERS
from ..structures.bvh.builders.morton.codes import MortonSettings, codes_of, sort_by_code
from ..structures.bvh.builders.morton.hlbvh import boxes_around
from ..structures.bvh.builders.morton.lbvh import find_cut
from ..structures.bvh.builders.morton.radix_sort import DIGIT, passes, split
from ..structures.bvh.hierarchy import BVH
from .drawing import BLUE, GREY, ORANGE, Chart, Lines, coloured, counted, frame_of
from .exhibit import MOST_SEGMENTS, Exhibit, Frame, Once

MOST_LEVELS = 8
"""Levels of the tree that are shown: the last has up to 128 intervals."""

BARS = 1000
"""Bars of the sort; of more codes every second, third, ... is drawn."""

SPLIT_CODES = 48
"""Codes that are split bit by bit."""

CHART = 0.4
"""Height of the charts, as a share of the longest side of the scene."""


class Sorted(NamedTuple):
    """The triangles along the curve: their codes (n,), boxes (n, 6) and centroids (n, 3)."""

    codes: np.ndarray
    boxes: np.ndarray
    centroids: np.ndarray


def morton_exhibits(bvh: BVH) -> list[Exhibit]:
    """Return the exhibits of the curve and of the sort, of builders that sort along the curve."""
    if not issubclass(BUILDERS[bvh.settings.builder].Settings, MortonSettings):
        return []
    return [morton_curve(bvh), radix_sort(bvh), radix_2_split(bvh)]


def chart_below(bvh: BVH, high: float, top: float) -> Chart:
    """Return a chart below the model, from 0 to `high` across and to `top` upwards."""
    low, size = bvh.scene.lower, float((bvh.scene.upper - bvh.scene.lower).max())
    width = max(float(bvh.scene.upper[0] - low[0]), 0.5 * size)
    corner = low - (0.1 + CHART) * size * np.array([0.0, 0.0, 1.0])
    across, upwards = np.array([width, 0.0, 0.0]), np.array([0.0, 0.0, CHART * size])
    return Chart(corner, across, upwards, 0.0, high, top)


# ------------------------------------------------------------------------------------------- curve


def morton_curve(bvh: BVH) -> Exhibit:
    """Return the curve, and the intervals of the upper levels of the tree of LBVH."""
    count = len(bvh.scene)
    bits = int(bvh.settings.morton_bits)
    levels = min(MOST_LEVELS, count.bit_length())

    @Once
    def along_curve(progress: Progress) -> Sorted:
        boxes = boxes_of(bvh.scene.triangles)
        with Team(progress, "Sorting along the curve") as team:
            codes, order = sort_by_code(boxes, bits, team)
        boxes = boxes[order]
        return Sorted(codes, boxes, 0.5 * (boxes[:, :3] + boxes[:, 3:]))

    @Once
    def intervals(progress: Progress) -> list[np.ndarray]:
        return intervals_of_levels(along_curve(progress).codes, levels)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        found = along_curve(progress)
        if number == 0:
            parts = [curve(found, np.linspace(0.0, 1.0, count), MOST_SEGMENTS)]
            n_different = 1 + int(np.count_nonzero(np.diff(found.codes)))
            different = counted(n_different, "differs", "differ")
            caption = (
                f"{counted(count, 'centroid', 'centroids')} in the order of their codes of {bits} "
                f"bits, of which {different}"
            )
        else:
            begins = intervals(progress)[number - 1]
            ends = np.append(begins[1:], count)
            sizes, colours = ends - begins, 0.5 * (begins + ends) / count
            parts = [
                curve(found, np.repeat(colours, sizes), MOST_SEGMENTS * 3 // 4),
                Lines(
                    box_segments(boxes_around(found.boxes, begins)),
                    opaque(ramp(np.repeat(colours, 12))),
                ),
                brackets(chart_below(bvh, count, levels), intervals(progress)[:number]),
            ]
            caption = (
                f"Level {number - 1} of LBVH: {counted(len(begins), 'interval', 'intervals')}; "
                f"the largest has {counted(int(sizes.max()), 'triangle', 'triangles')}"
            )
        drawn = len(parts[0].segments)
        if drawn < count - 1:
            caption += f"; drawn: {counted(drawn, 'piece', 'pieces')} of the curve"
        return frame_of(parts, caption)

    return Exhibit(
        "morton_curve",
        "Morton Curve",
        "The curve through the centroids; below, the sorted codes and the intervals of the tree",
        levels + 1,
        frame,
    )


def intervals_of_levels(codes: np.ndarray, levels: int) -> list[np.ndarray]:
    """Return where the intervals of each level begin, cut as LBVH does; leaves stay."""
    nodes, found = [(0, len(codes))], []
    for _ in range(levels):
        found.append(np.array([begin for begin, _ in nodes]))
        below: list[tuple[int, int]] = []
        for begin, end in nodes:
            middle = call(find_cut, codes, begin, end) if end - begin > 1 else end
            below += [(begin, middle), (middle, end)] if middle < end else [(begin, end)]
        nodes = below
    return found


def curve(found: Sorted, fractions: np.ndarray, most: int) -> Lines:
    """Return the curve with the ramp's colours at some fractions, (n,), at most `most` pieces."""
    step = -(-len(fractions) // most)
    points = found.centroids[::step]
    segments = np.stack([points[:-1], points[1:]], axis=1)
    return Lines(segments, opaque(ramp(fractions[::step][:-1])))


def opaque(colours: np.ndarray) -> np.ndarray:
    """Return colours (k, 3) with an opacity of 1."""
    return np.concatenate([colours, np.ones((len(colours), 1))], axis=1)


def brackets(chart: Chart, levels: list[np.ndarray]) -> Lines:
    """Return the intervals of levels as brackets, the root's on top."""
    count = chart.low + chart.span
    segments, colours = [], []
    for level, begins in enumerate(levels):
        ends = np.append(begins[1:], count)
        gap = 0.1 * (ends - begins)
        y = np.full(len(begins), chart.top - level)
        left, right = chart.points(begins + gap, y), chart.points(ends - gap, y)
        left_foot = chart.points(begins + gap, y - 0.4)
        right_foot = chart.points(ends - gap, y - 0.4)
        pieces = [(left, right), (left, left_foot), (right, right_foot)]
        segments += [np.stack(piece, axis=1) for piece in pieces]
        colours += [opaque(ramp(0.5 * (begins + ends) / count))] * 3
    return Lines(np.concatenate(segments), np.concatenate(colours))


# -------------------------------------------------------------------------------------------- sort


def radix_sort(bvh: BVH) -> Exhibit:
    """Return the codes as bars, before the sort and after each pass."""
    bits, count = int(bvh.settings.morton_bits), len(bvh.scene)
    digits = -(-bits // DIGIT)
    step = -(-count // BARS)

    @Once
    def states(progress: Progress) -> list[np.ndarray]:
        with Team(progress, "Sorting") as team:
            codes = codes_of(boxes_of(bvh.scene.triangles), bits, team)
            return [codes[::step].copy()] + [
                now[::step].copy() for now, _ in passes(codes, bits, team)
            ]

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        codes = states(progress)[number]
        done = min(number * DIGIT, bits)
        if number == 0:
            caption = (
                f"{counted(count, 'code', 'codes')} of {bits} bits in the order of the triangles"
            )
        else:
            caption = (
                f"Pass {number} of {digits}, bits {(number - 1) * DIGIT} to {done - 1}: "
                f"sorted by the lowest {done} bits, which the colour shows"
            )
        if step > 1:
            caption += f"; drawn: one code of {step}"
        chart = chart_below(bvh, len(codes), 2.0**bits)
        place = np.arange(len(codes)) + 0.5
        ends = chart.points(np.tile(place, 2), np.append(np.zeros(len(codes)), codes))
        lowest = (codes & (1 << done) - 1) / 2.0**done if number else codes / 2.0**bits
        bars = Lines(ends.reshape(2, -1, 3).swapaxes(0, 1), opaque(ramp(lowest)))
        return frame_of([chart.axes(), bars], caption)

    return Exhibit(
        "radix_sort",
        "Radix Sort",
        "The Morton codes as bars after every pass, one digit a pass, the lowest first",
        digits + 1,
        frame,
    )


def radix_2_split(bvh: BVH) -> Exhibit:
    """Return the lecture's sort with digits of one bit, on some of the codes."""
    bits = int(bvh.settings.morton_bits)
    step = -(-len(bvh.scene) // SPLIT_CODES)

    @Once
    def codes(progress: Progress) -> np.ndarray:
        with Team(progress, "Computing codes") as team:
            return codes_of(boxes_of(bvh.scene.triangles[::step]), bits, team)

    def frame(bit: int, progress: Progress = SILENT) -> Frame:
        now = codes(progress)
        for lower in range(bit):
            now = now[np.argsort(split(now, lower))]
        place = split(now, bit)
        chart = chart_below(bvh, len(now), 1.0)
        x = np.arange(len(now)) + 0.5
        above, below = chart.points(x, np.ones(len(x))), chart.points(place + 0.5, np.zeros(len(x)))
        moves, is_one = np.stack([above, below], axis=1), (now >> bit & 1).astype(bool)
        rows = chart.points(np.array([0, len(now)] * 2), np.array([0.0, 0, 1, 1])).reshape(2, 2, 3)
        parts = [
            coloured(rows, GREY),
            coloured(moves[~is_one], BLUE),
            coloured(moves[is_one], ORANGE),
        ]
        ones = int(is_one.sum())
        return frame_of(
            parts,
            f"Bit {bit}: {counted(len(now) - ones, 'zero', 'zeros')} (blue) to the left, "
            f"{counted(ones, 'one', 'ones')} (orange) to the right, otherwise in order"
            + (f"; drawn: one code of {step}" if step > 1 else ""),
        )

    return Exhibit(
        "radix_2_split",
        "Radix-2 Split",
        "One bit a pass, above the order before it, below the order after it",
        bits,
        frame,
    )
