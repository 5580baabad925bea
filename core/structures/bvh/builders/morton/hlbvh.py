"""Hierarchical LBVH (HLBVH): cut by cost where it matters, by Morton codes where there is much.

References whose codes begin with the same TREELET_BITS lie in one cell of a coarse grid. They are
a *treelet*, built as by :mod:`.lbvh`. There are far fewer treelets than references, so the tree
above them can be built with care: by the surface area heuristic, evaluated at bin borders as in
:mod:`..top_down.binned_sah`. There a treelet counts as one, however many references it has.

J. Pantaleoni, D. Luebke: HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic
Geometry, HPG 2010. K. Garanzha, J. Pantaleoni, D. McAllister: Simpler and Faster HLBVH with Work
Queues, HPG 2011.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .....contract.build_log import BuildLog
from .....contract.workspace import MAXIMUM_DEPTH, STACK_SIZE
from .....geometry.box import area_of, clear, include
from .....geometry.box_shape import surface_area
from .....kernels import call, inner, kernel, whole
from .....parallel import Team
from .....progress import Progress
from .....ranges import ranges
from ...topology.build_log import log_of_splits
from ...topology.tree import Builder, Grouping, Primitives, Splits, make_splits, note_split
from ..top_down.binned_sah import bins_setting
from .codes import MortonSettings, sort_by_code
from .lbvh import Intervals, complete, make_intervals, splits_by_codes

TREELET_BITS = 15
"""Leading bits that all codes of a treelet have in common: cells of a grid of 32 x 32 x 32, or of
extended codes as many others, two of whose bits are of sizes."""


@dataclass(frozen=True)
class Settings(MortonSettings):
    """Settings of HLBVH."""

    bins: int = bins_setting()


class Bins(NamedTuple):
    """Scratch memory: boxes (bins + 1, 6), the last one to sweep with, counts and costs (bins,)."""

    boxes: np.ndarray
    counts: np.ndarray
    costs: np.ndarray


def make_bins(bins: int) -> Bins:
    """Return scratch memory for a number of bins."""
    return Bins(np.empty((bins + 1, 6)), np.empty(bins, np.int64), np.empty(bins))


@inner
def bin_of(box, axis, low, scale):
    """Return the bin of a treelet by the centre of its box, alike for counting and dividing."""
    return int((box[axis] + box[3 + axis] - low) * scale)


@inner
def find_best(boxes, number, first, last, bins):
    """Return axis, origin and scale of the bins, behind which one to cut, and its cost.

    There SA(L) N_L + SA(R) N_R, of N treelets, is least. The axis is -1 if all centres coincide.
    """
    n_bins = len(bins.counts)
    swept = bins.boxes[n_bins]
    best_axis, best_low, best_scale, best_bin, least = -1, 0.0, 0.0, 0, np.inf
    for axis in range(3):
        low, high = np.inf, -np.inf
        for i in range(first, last):
            centre = boxes[number[i], axis] + boxes[number[i], 3 + axis]
            low = centre if centre < low else low
            high = centre if centre > high else high
        if not high > low:
            continue
        scale = n_bins * (1.0 - 1e-6) / (high - low)
        if scale == np.inf:
            continue
        for b in range(n_bins):
            clear(bins.boxes[b])
            bins.counts[b] = 0
        for i in range(first, last):
            box = boxes[number[i]]
            b = bin_of(box, axis, low, scale)
            include(bins.boxes[b], box)
            bins.counts[b] += 1
        # From the right: costs[b] is SA N of bin b and everything behind.
        clear(swept)
        count = 0
        for b in range(n_bins - 1, 0, -1):
            include(swept, bins.boxes[b])
            count += bins.counts[b]
            bins.costs[b] = count * area_of(swept) if count > 0 else np.inf
        # From the left, with the other side at hand. The first bin is never empty.
        clear(swept)
        count = 0
        for b in range(n_bins - 1):
            include(swept, bins.boxes[b])
            count += bins.counts[b]
            cost = count * area_of(swept) + bins.costs[b + 1]
            if cost < least:
                best_axis, best_low, best_scale, best_bin, least = axis, low, scale, b, cost
    return best_axis, best_low, best_scale, best_bin, least


@kernel
def build_top(top, boxes, number, deepest, bins, splits, stack):
    """Build the tree above the treelets, as if each were a single reference.

    Parameters
    ----------
    top : Intervals
        Node 0 has all treelets.
    boxes : (t, 6) float64
        Of the treelets.
    number : (t,) int64
        The treelets, in an order that becomes that of the tree.
    deepest : int
        Depth at which every treelet must have its root at the latest.
    splits : Splits
        Gets the planes, and SA(L) N_L + SA(R) N_R in place of costs; references are treelets.
    """
    stack[0, 0], stack[0, 1] = 0, 0
    height, child = 1, 1
    while height > 0:
        height -= 1
        node, depth, cost = stack[height, 0], stack[height, 1], np.nan
        first = whole(top.begin[node])
        last = first + top.size[node]
        if last - first == 1:
            continue
        middle, split_axis, position = (first + last) >> 1, -1, 0.0
        # As long as halving would still do below.
        if last - first <= 1 << deepest - depth - 1:
            axis, low, scale, last_left, least = find_best(boxes, number, first, last, bins)
            if axis >= 0:
                cost, split_axis, position = least, axis, 0.5 * (low + (last_left + 1) / scale)
                i, middle = first, last
                while i < middle:
                    if bin_of(boxes[number[i]], axis, low, scale) <= last_left:
                        i += 1
                    else:
                        middle -= 1
                        number[i], number[middle] = number[middle], number[i]
        note_split(splits, middle, split_axis, position, cost, middle - first, last - middle)
        top.first[node] = child
        top.begin[child], top.size[child] = first, middle - first
        top.begin[child + 1], top.size[child + 1] = middle, last - middle
        stack[height, 0], stack[height, 1] = child + 1, depth + 1
        stack[height + 1, 0], stack[height + 1, 1] = child, depth + 1
        height += 2
        child += 2


def build_hlbvh(
    primitives: Primitives, settings: Settings, progress: Progress, log: bool = False
) -> Grouping:
    """Sort, build the tree above the treelets, then the treelets.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    bits = int(settings.morton_bits)
    with Team(progress, "Building bvh") as team:
        codes, order = sort_by_code(primitives.boxes, settings, team)
        starts = np.flatnonzero(np.diff(codes >> bits - TREELET_BITS, prepend=-1))
        sizes = np.diff(starts, append=len(codes))
        # A treelet has at most this many levels: the rest of the code, then bits of the index.
        levels = bits - TREELET_BITS + int(sizes.max()).bit_length()
        deepest = min(MAXIMUM_DEPTH - levels, 62)  # a power of two of that is still a number
        boxes = boxes_around(primitives.boxes[order], starts)
        top_splits = make_splits(len(starts) if log else 0)
        top, number = top_of(boxes, deepest, settings.bins, top_splits)
        upper, roots = np.flatnonzero(top.size > 1), np.flatnonzero(top.size == 1)
        # From treelets to references, which follow their treelets into the new order.
        sizes = sizes[number]
        begins = np.concatenate([[0], np.cumsum(sizes)])
        top.size[:] = begins[top.begin + top.size] - begins[top.begin]
        top.begin[:] = begins[top.begin]
        source = ranges(starts[number], sizes)
        codes, order = codes[source], order[source]
        tree = complete(
            top, upper.tolist(), roots.tolist(), codes, primitives.boxes, order, settings, team
        )
    if not log:
        return Grouping(tree, order)

    def told() -> BuildLog:
        splits = splits_by_codes(tree, codes, primitives.boxes, settings)
        between = begins[1:-1]  # treelets
        splits.axis[between], splits.position[between] = (
            top_splits.axis[1:],
            top_splits.position[1:],
        )
        splits.cost[between] = top_splits.cost[1:]
        log = log_of_splits(tree, splits, by_level=True)
        area = surface_area(tree.boxes[log.node])
        shares = np.divide(log.cost, area, out=np.full(len(area), np.nan), where=area > 0.0)
        return replace(log, cost=settings.C_trav + settings.C_isect * shares)

    return Grouping(tree, order, log=told)


def boxes_around(boxes: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Return the boxes around runs of boxes that begin at `starts`."""
    low = np.minimum.reduceat(boxes[:, :3], starts)
    high = np.maximum.reduceat(boxes[:, 3:], starts)
    return np.concatenate([low, high], axis=1)


def top_of(
    boxes: np.ndarray, deepest: int, bins: int, splits: Splits
) -> tuple[Intervals, np.ndarray]:
    """Return the tree above treelets with these boxes, and the order in which it has them."""
    top, number = make_intervals(2 * len(boxes) - 1), np.arange(len(boxes))
    top.size[0] = len(boxes)
    stack = np.empty((STACK_SIZE, 2), np.int64)
    call(build_top, top, boxes, number, deepest, make_bins(bins), splits, stack)
    return top, number


BUILDER = Builder(
    "LBVH below, SAH above (Pantaleoni and Luebke 2010)",
    Settings,
    build_hlbvh,
    bytes_per_triangle=400,
)
