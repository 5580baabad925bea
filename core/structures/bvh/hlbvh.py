"""Hierarchical LBVH (HLBVH): cut by cost where it matters, by Morton codes where there is much.

References whose codes begin with the same TREELET_BITS lie in one cell of a coarse grid. They are
a *treelet*, built as by :mod:`.lbvh`. There are far fewer treelets than references, so the tree
above them can be built with care: by the surface area heuristic, evaluated at bin borders as in
:mod:`.binned_sah`. There a treelet counts as one, however many references it has.

J. Pantaleoni, D. Luebke: HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic
Geometry, HPG 2010. K. Garanzha, J. Pantaleoni, D. McAllister: Simpler and Faster HLBVH with Work
Queues, HPG 2011.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...geometry.box import area_of
from ...kernels import call, inner, kernel
from ...parallel import Team
from ...progress import Progress
from ..contract import MAXIMUM_DEPTH, STACK_SIZE
from .lbvh import complete, make_intervals
from .morton import sort_by_code
from .tree import Grouping, Primitives

if TYPE_CHECKING:
    from .settings import BVHSettings

TREELET_BITS = 15
"""Leading bits that all codes of a treelet have in common: cells of a grid of 32 x 32 x 32."""


class Treelets(NamedTuple):
    """The treelets, in an order that changes until the upper tree is finished.

    Attributes
    ----------
    boxes : (t, 6) float64
    sizes : (t,) int64
        References of each.
    number : (t,) int64
        Which one it was along the curve.
    node : (t,) int64
        Its root.
    """

    boxes: np.ndarray
    sizes: np.ndarray
    number: np.ndarray
    node: np.ndarray


class Scratch(NamedTuple):
    """Scratch memory: boxes (bins + 1, 6), the last one to sweep with, counts and costs (bins,)."""

    boxes: np.ndarray
    counts: np.ndarray
    costs: np.ndarray
    stack: np.ndarray


def make_scratch(bins: int) -> Scratch:
    """Return scratch memory."""
    return Scratch(
        np.empty((bins + 1, 6)), np.empty(bins, np.int64), np.empty(bins),
        np.empty((STACK_SIZE, 4), np.int64),
    )  # fmt: skip


@inner
def empty(box):
    """Make a box, (6,), contain nothing."""
    for axis in range(3):
        box[axis], box[3 + axis] = np.inf, -np.inf


@inner
def grow(box, other):
    """Make a box contain another one, (6,) each."""
    for axis in range(3):
        a, b = other[axis], other[3 + axis]
        box[axis] = a if a < box[axis] else box[axis]
        box[3 + axis] = b if b > box[3 + axis] else box[3 + axis]


@inner
def bin_of(box, axis, low, scale):
    """Return the bin of a treelet by the centre of its box, alike for counting and dividing."""
    return int((box[axis] + box[3 + axis] - low) * scale)


@inner
def find_best(treelets, first, last, scratch):
    """Return axis, origin and scale of the bins, and behind which one to cut.

    There SA(L) N_L + SA(R) N_R is least. The axis is -1 if all centres coincide.
    """
    boxes, counts, costs = scratch.boxes, scratch.counts, scratch.costs
    bins = len(counts)
    swept = boxes[bins]
    best_axis, best_low, best_scale, best_bin, least = -1, 0.0, 0.0, 0, np.inf
    for axis in range(3):
        low, high = np.inf, -np.inf
        for i in range(first, last):
            centre = treelets.boxes[i, axis] + treelets.boxes[i, 3 + axis]
            low = centre if centre < low else low
            high = centre if centre > high else high
        scale = bins * (1.0 - 1e-6) / (high - low)
        if not scale < np.inf:
            continue
        for b in range(bins):
            empty(boxes[b])
            counts[b] = 0
        for i in range(first, last):
            b = bin_of(treelets.boxes[i], axis, low, scale)
            grow(boxes[b], treelets.boxes[i])
            counts[b] += 1
        # From the right: costs[b] is SA N of bin b and everything behind.
        empty(swept)
        count = 0
        for b in range(bins - 1, 0, -1):
            grow(swept, boxes[b])
            count += counts[b]
            costs[b] = count * area_of(swept) if count > 0 else np.inf
        # From the left, with the other side at hand. The first bin is never empty.
        empty(swept)
        count = 0
        for b in range(bins - 1):
            grow(swept, boxes[b])
            count += counts[b]
            cost = count * area_of(swept) + costs[b + 1]
            if cost < least:
                best_axis, best_low, best_scale, best_bin, least = axis, low, scale, b, cost
    return best_axis, best_low, best_scale, best_bin


@inner
def swap(treelets, i, j):
    """Exchange two treelets."""
    boxes, sizes, number = treelets.boxes, treelets.sizes, treelets.number
    for side in range(6):
        boxes[i, side], boxes[j, side] = boxes[j, side], boxes[i, side]
    sizes[i], sizes[j] = sizes[j], sizes[i]
    number[i], number[j] = number[j], number[i]


@kernel
def build_top(tree, treelets, deepest, upper, scratch):
    """Build the tree above the treelets; they end up in the order of their references.

    Parameters
    ----------
    tree : Intervals
        Node 0 has all references.
    deepest : int
        Depth at which every treelet must have its root at the latest.
    upper : (t - 1,) int64
        Gets the inner nodes, parents before children.
    """
    stack, height, done = scratch.stack, 1, 0
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, len(treelets.sizes), 0
    while height > 0:
        height -= 1
        node, first = stack[height, 0], stack[height, 1]
        last, depth = stack[height, 2], stack[height, 3]
        if last - first == 1:
            treelets.node[first] = node
            continue
        middle = (first + last) >> 1
        # As long as halving would still do below.
        if last - first <= 1 << deepest - depth - 1:
            axis, low, scale, last_left = find_best(treelets, first, last, scratch)
            if axis >= 0:
                i, middle = first, last
                while i < middle:
                    if bin_of(treelets.boxes[i], axis, low, scale) <= last_left:
                        i += 1
                    else:
                        middle -= 1
                        swap(treelets, i, middle)
        child, begin, left_size = 2 * done + 1, tree.begin[node], 0
        for i in range(first, middle):
            left_size += treelets.sizes[i]
        tree.first[node] = child
        tree.begin[child], tree.size[child] = begin, left_size
        tree.begin[child + 1], tree.size[child + 1] = begin + left_size, tree.size[node] - left_size
        upper[done] = node
        done += 1
        left, right = stack[height], stack[height + 1]
        left[0], left[1], left[2], left[3] = child, first, middle, depth + 1
        right[0], right[1], right[2], right[3] = child + 1, middle, last, depth + 1
        height += 2


def build(primitives: Primitives, settings: BVHSettings, progress: Progress) -> Grouping:
    """Sort, build the tree above the treelets, then the treelets.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    bits = int(settings.morton_bits)
    with Team(progress, "Building bvh") as team:
        codes, order = sort_by_code(primitives.boxes, bits, team)
        starts = np.flatnonzero(np.diff(codes >> bits - TREELET_BITS, prepend=-1))
        sizes = np.diff(starts, append=len(codes))
        treelets = make_treelets(primitives.boxes[order], starts, sizes)
        # A treelet has at most this many levels: the rest of the code, then bits of the index.
        levels = bits - TREELET_BITS + int(sizes.max()).bit_length()
        top = make_intervals(2 * len(starts) - 1)
        top.size[0] = len(codes)
        upper = np.empty(len(starts) - 1, np.int64)
        scratch = make_scratch(settings.bins)
        deepest = min(MAXIMUM_DEPTH - levels, 62)  # a power of two of that is still a number
        call(build_top, top, treelets, deepest, upper, scratch)
        # The treelets are in another order now; their references follow them.
        shift = starts[treelets.number] - top.begin[treelets.node]
        source = np.arange(len(codes)) + np.repeat(shift, treelets.sizes)
        codes, order = codes[source], order[source]
        roots = treelets.node.tolist()
        tree = complete(top, upper.tolist(), roots, codes, primitives.boxes, order, settings, team)
    return Grouping(tree, order)


def make_treelets(boxes: np.ndarray, starts: np.ndarray, sizes: np.ndarray) -> Treelets:
    """Return the treelets that begin at `starts` of the references with these boxes."""
    low = np.minimum.reduceat(boxes[:, :3], starts)
    high = np.maximum.reduceat(boxes[:, 3:], starts)
    number = np.arange(len(starts))
    return Treelets(np.concatenate([low, high], axis=1), sizes, number, np.zeros_like(number))
