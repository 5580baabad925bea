"""Exhibits of builders that sort along the Morton curve: the curve with its intervals, the sort.

"Morton curve" shows how the curve runs through the model, then the tree level by level, as the
build log tells of it: every node in a colour of its own, the box around it, and below the model its
intervals as brackets over the sorted codes. A node of LBVH is one interval. One of HLBVH above the
treelets has several, and clusters of PLOC are seen in an exhibit of their own.

"Radix sort" shows the codes as bars after each pass, "Radix-2 split" for some of them what the
lecture's primitive does with one bit. No log has passes of a sort: it is done again, with the codes
of the same triangles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..colours import ramp
from ..contract.build_log import SPLIT, BuildLog
from ..geometry.box_shape import box_segments
from ..parallel import Team
from ..progress import SILENT, Progress
from ..structures.bvh.builders import BUILDERS
from ..structures.bvh.builders.morton.codes import MortonSettings, codes_of, sort_by_code
from ..structures.bvh.builders.morton.hlbvh import boxes_around
from ..structures.bvh.builders.morton.radix_sort import DIGIT, passes, split
from ..structures.bvh.hierarchy import BVH
from .drawing import BLUE, GREY, ORANGE, Chart, Lines, coloured, counted, frame_of
from .exhibit import MOST_SEGMENTS, Exhibit, Frame, Once

MOST_LEVELS = 8
"""Levels of the tree that are shown: the last has up to 128 nodes."""

MOST_BRACKETS = 128
"""Brackets of one level."""

BARS = 1000
"""Bars of the sort; of more codes every second, third, ... is drawn."""

SPLIT_CODES = 48
"""Codes that are split bit by bit."""

CHART = 0.4
"""Height of the charts, as a share of the longest side of the scene."""


class Sorted(NamedTuple):
    """The triangles along the curve: their codes (n,), numbers (n,) and centroids (n, 3)."""

    codes: np.ndarray
    order: np.ndarray
    centroids: np.ndarray


def morton_exhibits(bvh: BVH, log: BuildLog) -> list[Exhibit]:
    """Return the exhibits of the curve and of the sort, of builders that sort along the curve."""
    if not issubclass(BUILDERS[bvh.settings.builder].Settings, MortonSettings):
        return []
    return [morton_curve(bvh, log), radix_sort(bvh), radix_2_split(bvh)]


def chart_below(bvh: BVH, high: float, top: float) -> Chart:
    """Return a chart below the model, from 0 to `high` across and to `top` upwards."""
    low, size = bvh.scene.lower, float((bvh.scene.upper - bvh.scene.lower).max())
    width = max(float(bvh.scene.upper[0] - low[0]), 0.5 * size)
    corner = low - (0.1 + CHART) * size * np.array([0.0, 0.0, 1.0])
    across, upwards = np.array([width, 0.0, 0.0]), np.array([0.0, 0.0, CHART * size])
    return Chart(corner, across, upwards, 0.0, high, top)


# ------------------------------------------------------------------------------------------- curve


class Level(NamedTuple):
    """The nodes of a level, and the leaves above it, along the curve.

    Attributes
    ----------
    sizes : (k,) int64
        Triangles of each.
    boxes : (k, 6) float64
    middles : (k,) float64
        The middle of each, as a share of all triangles in the order of the tree.
    node : (n,) int64
        The node, by its place in the above, of every triangle along the curve.
    """

    sizes: np.ndarray
    boxes: np.ndarray
    middles: np.ndarray
    node: np.ndarray


def morton_curve(bvh: BVH, log: BuildLog) -> Exhibit:
    """Return the curve, and the upper levels of the tree where the builder divides it."""
    count = len(bvh.scene)
    bits = int(bvh.settings.morton_bits)
    splits = log.step[log.kind == SPLIT]
    levels = 0 if log.is_bottom_up else min(MOST_LEVELS, 1 + int(splits.max(initial=0)))

    @Once
    def along_curve(progress: Progress) -> Sorted:
        boxes = bvh.scene.boxes()
        with Team(progress, "Sorting along the curve") as team:
            codes, order = sort_by_code(boxes, bits, team)
        boxes = boxes[order]
        return Sorted(codes, order, 0.5 * (boxes[:, :3] + boxes[:, 3:]))

    @Once
    def found_levels(progress: Progress) -> list[Level]:
        order = along_curve(progress).order
        progress.report(0, 1, "Reading the splits")
        return levels_of(bvh, log, order, levels)

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
            upper = found_levels(progress)[:number]
            level = upper[-1]
            parts = [
                curve(found, level.middles[level.node], MOST_SEGMENTS * 3 // 4),
                Lines(box_segments(level.boxes), opaque(ramp(np.repeat(level.middles, 12)))),
                brackets(chart_below(bvh, count, levels), upper),
            ]
            n_runs = 1 + int(np.count_nonzero(np.diff(level.node)))
            caption = (
                f"Level {number - 1} of the tree: {counted(len(level.sizes), 'node', 'nodes')}, "
                f"{counted(n_runs, 'interval', 'intervals')} of the curve; the largest node has "
                f"{counted(int(level.sizes.max()), 'triangle', 'triangles')}"
            )
            if n_runs > MOST_BRACKETS:
                caption += f"; brackets: the {MOST_BRACKETS} longest intervals"
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


def levels_of(bvh: BVH, log: BuildLog, order: np.ndarray, levels: int) -> list[Level]:
    """Return the upper levels of a tree as it was split, a level a step.

    Parameters
    ----------
    order : (n,) int
        The triangles along the curve.
    """
    # Where the triangles of every node begin, in the order that the builder gave them.
    begin = np.zeros(len(log.cells), np.int64)
    begins = [np.zeros(1, np.int64)]
    is_split = log.kind == SPLIT
    step, node = log.step[is_split], log.node[is_split]
    (left, right), n_left = log.children[is_split].T, log.counts[is_split, 0]
    for number in range(1, int(step.max(initial=0)) + 1):
        these = slice(*np.searchsorted(step, [number, number + 1]))
        begin[left[these]] = begin[node[these]]
        begin[right[these]] = begin[node[these]] + n_left[these]
        begins.append(np.sort(np.append(begins[-1], begin[right[these]])))
    ids = bvh.geometry.ids
    if log.leaves is not None:  # they have been moved since
        ids = np.empty_like(ids)
        ids[begin[log.leaves]] = bvh.geometry.ids
    place = np.empty(len(ids), np.int64)
    place[ids] = np.arange(len(ids))
    boxes, places = bvh.scene.boxes()[ids], place[order]
    found = []
    for first in begins[:levels]:
        ends = np.append(first[1:], len(ids))
        found.append(
            Level(
                ends - first,
                boxes_around(boxes, first),
                0.5 * (first + ends) / len(ids),
                np.searchsorted(first, places, side="right") - 1,
            )
        )
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


def brackets(chart: Chart, levels: list[Level]) -> Lines:
    """Return the intervals of levels as brackets in their nodes' colours, the root's on top."""
    segments, colours = [], []
    for number, level in enumerate(levels):
        begins = np.flatnonzero(np.diff(level.node, prepend=-1))
        ends = np.append(begins[1:], len(level.node))
        longest = np.sort(np.argsort(begins - ends, kind="stable")[:MOST_BRACKETS])
        begins, ends = begins[longest], ends[longest]
        gap = 0.1 * (ends - begins)
        y = np.full(len(begins), chart.top - number)
        left, right = chart.points(begins + gap, y), chart.points(ends - gap, y)
        left_foot = chart.points(begins + gap, y - 0.4)
        right_foot = chart.points(ends - gap, y - 0.4)
        pieces = [(left, right), (left, left_foot), (right, right_foot)]
        segments += [np.stack(piece, axis=1) for piece in pieces]
        colours += [opaque(ramp(level.middles[level.node[begins]]))] * 3
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
            codes = codes_of(bvh.scene.boxes(), bits, team)
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
            return codes_of(bvh.scene.boxes(), bits, team)[::step]

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
