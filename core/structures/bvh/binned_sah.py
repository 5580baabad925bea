"""Top-down construction by the surface area heuristic (SAH), evaluated at bin borders.

At each node a plane divides the triangles by their centroids; the plane is chosen by

    Cost(V -> {L, R}) = C_trav + C_isect * (SA(L) / SA(V) * N_L + SA(R) / SA(V) * N_R)

Binning evaluates it at a fixed number of planes per axis: count triangles and boxes per bin in one
pass, then sweep over the bins from both sides. A node becomes a leaf where no plane is cheaper than
testing all its triangles, C_isect * N.

I. Wald: On fast Construction of SAH-based Bounding Volume Hierarchies, RT 2007.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...kernels import call, inner, kernel
from ...parallel import core_count
from ...progress import Progress
from ..contract import MAXIMUM_DEPTH, STACK_SIZE
from .tree import Grouping, Primitives, Tree, copy_depth_first

if TYPE_CHECKING:
    from .settings import BVHSettings

SUBTREE = 1 << 16
"""Triangles up to which a subtree is built by one kernel call, in some 50 ms; different subtrees on
different threads. Between calls the builder looks at the cancel button."""


class SplitRule(NamedTuple):
    """What decides a split, for kernels."""

    max_leaf_size: int
    bins: int
    c_trav: float
    c_isect: float


class Scratch(NamedTuple):
    """Scratch memory of one building thread."""

    bounds: np.ndarray
    bin_boxes: np.ndarray
    bin_counts: np.ndarray
    right_costs: np.ndarray
    stack: np.ndarray


def make_scratch(bins: int) -> Scratch:
    """Return scratch memory for one thread."""
    return Scratch(
        np.empty(12), np.empty((bins, 6)), np.empty(bins, np.int64), np.empty(bins),
        np.empty((STACK_SIZE, 4), np.int64),
    )  # fmt: skip


@inner
def area_of(x0, y0, z0, x1, y1, z1):
    """Return the surface area of a box."""
    x, y, z = x1 - x0, y1 - y0, z1 - z0
    return 2.0 * (x * y + y * z + z * x)


@inner
def bin_of(box, axis, low, scale, bins):
    """Return the bin of a triangle's centroid; used alike for counting and for dividing."""
    return min(int((box[axis] + box[3 + axis] - low) * scale), bins - 1)


@inner
def fit(boxes, first, count, out):
    """Write into `out` (12,) the box around boxes, then that around their centroids (doubled)."""
    for axis in range(3):
        low, high, low_c, high_c = np.inf, -np.inf, np.inf, -np.inf
        for i in range(first, first + count):
            a, b = boxes[i, axis], boxes[i, 3 + axis]
            low = a if a < low else low
            high = b if b > high else high
            c = a + b
            low_c = c if c < low_c else low_c
            high_c = c if c > high_c else high_c
        out[axis], out[3 + axis] = low, high
        out[6 + axis], out[9 + axis] = low_c, high_c


@inner
def best_split(boxes, first, count, bounds, bins, bin_boxes, bin_counts, right_costs):
    """Return axis, bin and SA(L) N_L + SA(R) N_R of the cheapest of 3 (bins - 1) planes.

    The axis is -1 if all centroids coincide. Planes go behind the returned bin.
    """
    best_axis, best_bin, best_cost = -1, 0, np.inf
    for axis in range(3):
        low, extent = bounds[6 + axis], bounds[9 + axis] - bounds[6 + axis]
        if not extent > 0.0:
            continue
        scale = bins * (1.0 - 1e-6) / extent
        if scale == np.inf:
            continue
        for b in range(bins):
            bin_counts[b] = 0
            for side in range(3):
                bin_boxes[b, side] = np.inf
                bin_boxes[b, 3 + side] = -np.inf
        for i in range(first, first + count):
            box = boxes[i]
            b = bin_of(box, axis, low, scale, bins)
            bin_counts[b] += 1
            for side in range(3):
                bin_boxes[b, side] = min(bin_boxes[b, side], box[side])
                bin_boxes[b, 3 + side] = max(bin_boxes[b, 3 + side], box[3 + side])
        # From the right: right_costs[b] is SA N of everything behind bin b.
        x0 = y0 = z0 = np.inf
        x1 = y1 = z1 = -np.inf
        n = 0
        for b in range(bins - 1, 0, -1):
            n += bin_counts[b]
            x0, y0, z0 = (
                min(x0, bin_boxes[b, 0]),
                min(y0, bin_boxes[b, 1]),
                min(z0, bin_boxes[b, 2]),
            )
            x1, y1, z1 = (
                max(x1, bin_boxes[b, 3]),
                max(y1, bin_boxes[b, 4]),
                max(z1, bin_boxes[b, 5]),
            )
            right_costs[b - 1] = n * area_of(x0, y0, z0, x1, y1, z1) if n > 0 else np.inf
        # From the left, with the other side at hand.
        x0 = y0 = z0 = np.inf
        x1 = y1 = z1 = -np.inf
        n = 0
        for b in range(bins - 1):
            n += bin_counts[b]
            x0, y0, z0 = (
                min(x0, bin_boxes[b, 0]),
                min(y0, bin_boxes[b, 1]),
                min(z0, bin_boxes[b, 2]),
            )
            x1, y1, z1 = (
                max(x1, bin_boxes[b, 3]),
                max(y1, bin_boxes[b, 4]),
                max(z1, bin_boxes[b, 5]),
            )
            if n == 0 or n == count:
                continue
            cost = n * area_of(x0, y0, z0, x1, y1, z1) + right_costs[b]
            if cost < best_cost:
                best_axis, best_bin, best_cost = axis, b, cost
    return best_axis, best_bin, best_cost


@inner
def divide(boxes, order, first, count, axis, last_left, low, scale, bins):
    """Reorder a range so that bins up to `last_left` come first; return how many those are."""
    i, j = first, first + count - 1
    while i <= j:
        if bin_of(boxes[i], axis, low, scale, bins) <= last_left:
            i += 1
        else:
            for side in range(6):
                boxes[i, side], boxes[j, side] = boxes[j, side], boxes[i, side]
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i - first


@kernel
def split_node(tree, boxes, order, node, first, count, depth, rule, scratch):
    """Fit a node's box, then split it or make it a leaf; return the size of its left child or 0.

    The children of a node that is cut between the triangles k - 1 and k are 2k - 1 and 2k. Every
    place is cut at most once, so threads need not agree on who takes which number.
    """
    fit(boxes, first, count, scratch.bounds)
    bounds = scratch.bounds
    for side in range(6):
        tree.boxes[node, side] = bounds[side]
    axis, last_left, cost = -1, 0, np.inf
    # More bins than triangles would mostly be empty.
    bins = min(rule.bins, 4 + count)
    if count > 1 and depth < MAXIMUM_DEPTH // 2:
        axis, last_left, cost = best_split(
            boxes, first, count, bounds, bins,
            scratch.bin_boxes, scratch.bin_counts, scratch.right_costs,
        )  # fmt: skip
    area = area_of(bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5])
    no_gain = rule.c_isect * count * area <= rule.c_trav * area + rule.c_isect * cost
    if count == 1 or (count <= rule.max_leaf_size and no_gain):
        tree.first[node] = first
        tree.size[node] = count
        return 0
    if axis >= 0:
        low = bounds[6 + axis]
        scale = bins * (1.0 - 1e-6) / (bounds[9 + axis] - low)
        n_left = divide(boxes, order, first, count, axis, last_left, low, scale, bins)
    else:
        n_left = count // 2  # nothing tells the triangles apart: split by index
    tree.first[node] = 2 * (first + n_left) - 1
    tree.size[node] = 0
    return n_left


@inner
def push(stack, height, node, first, count, depth):
    """Remember a node to split."""
    stack[height, 0], stack[height, 1] = node, first
    stack[height, 2], stack[height, 3] = count, depth


@kernel
def build_subtree(tree, boxes, order, node, first, count, depth, rule, scratch):
    """Split a node and everything below it, depth-first."""
    stack = scratch.stack
    push(stack, 0, node, first, count, depth)
    height = 1
    while height > 0:
        height -= 1
        node, first = stack[height, 0], stack[height, 1]
        count, depth = stack[height, 2], stack[height, 3]
        n_left = split_node(tree, boxes, order, node, first, count, depth, rule, scratch)
        if n_left > 0:
            left = tree.first[node]
            push(stack, height, left + 1, first + n_left, count - n_left, depth + 1)
            push(stack, height + 1, left, first, n_left, depth + 1)
            height += 2


def build(primitives: Primitives, settings: BVHSettings, progress: Progress) -> Grouping:
    """Build the tree; the boxes of the primitives are reordered.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    boxes = primitives.boxes
    rule = SplitRule(settings.max_leaf_size, settings.bins, settings.C_trav, settings.C_isect)
    count = len(boxes)
    order = np.arange(count, dtype=np.int32)
    # A size of -1 marks a number that no node has taken.
    tree = Tree(
        np.zeros((2 * count - 1, 6)), np.zeros(2 * count - 1, np.int32),
        np.full(2 * count - 1, -1, np.int32),
    )  # fmt: skip
    scratch = make_scratch(rule.bins)
    done = 0

    # The upper part, node by node; what is small enough is put aside.
    pending, subtrees = [(0, 0, count, 0)], []
    while pending:
        node, first, size, depth = pending.pop()
        if size <= SUBTREE:
            subtrees.append((node, first, size, depth))
            continue
        progress.report(0, count, "Building bvh")
        n_left = call(split_node, tree, boxes, order, node, first, size, depth, rule, scratch)
        if n_left:
            left = int(tree.first[node])
            pending.append((left, first, n_left, depth + 1))
            pending.append((left + 1, first + n_left, size - n_left, depth + 1))

    # The lower parts, side by side.
    def build_one(each: tuple[int, int, int, int]) -> int:
        call(build_subtree, tree, boxes, order, *each, rule, make_scratch(rule.bins))
        return each[2]

    with ThreadPoolExecutor(core_count()) as pool:
        futures = [pool.submit(build_one, each) for each in subtrees]
        try:
            for future in futures:
                done += future.result()
                progress.report(done, count, "Building bvh")
        finally:
            for future in futures:
                future.cancel()
    n_nodes = int((tree.size >= 0).sum())
    compact = Tree(np.empty((n_nodes, 6)), np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32))
    call(copy_depth_first, tree, compact, scratch.stack)
    return Grouping(compact, order)
