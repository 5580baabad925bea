"""The data-parallel SAH split: the best plane of one node, found by many threads of a GPU.

k uniform planes per axis are candidates, each for a thread of its own, which tests all triangles of
the node one by one and then knows the cost of its plane. With no more than k triangles their
centroids take the place of the planes: the same as a full sweep. Of all candidates the cheapest is
found by *reduction*: each step compares pairs and leaves half of them, so log2 steps do.
The triangles are reordered by flags, 1 for those that go left, whose exclusive scan says where each
belongs.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha: Fast BVH Construction on GPUs,
Eurographics 2009.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .....contract.workspace import MAXIMUM_DEPTH
from .....kernels import implements, inner, kernel, whole
from ...topology.tree import Primitives
from .binned_sah import BinnedSettings
from .centroid_plane import EVERY, axis_to_divide, cost_of_plane, goes_left
from .recursion import Limits, choose, divide, enclose, enclose_boxes, limits_of, note


class DataParallel(NamedTuple):
    """The rule. Threads that split different nodes share the last five arrays of it.

    Attributes
    ----------
    limits : Limits
    bounds, sides : (2, 6) float64
    curve : (rows, 5) float64
        A row for each candidate.
    planes : (3 k,) float64
        Of the candidates, k of each axis, doubled; NaN for those not in use.
    lasts : (3 k,) int64
        Of the triangles in such a plane, the last that goes left.
    costs : (3 k,) float64
    winners : (3 k,) int64
        While they are reduced: the best of the candidates that a place stands for.
    boxes : (n, 6) float64
    order : (n,) int32
    spare_boxes : (n, 6) float64
    spare_order, scan : (n,) int32
    """

    limits: Limits
    bounds: np.ndarray
    sides: np.ndarray
    curve: np.ndarray
    planes: np.ndarray
    lasts: np.ndarray
    costs: np.ndarray
    winners: np.ndarray
    boxes: np.ndarray
    order: np.ndarray
    spare_boxes: np.ndarray
    spare_order: np.ndarray
    scan: np.ndarray


@implements(enclose, DataParallel)
def enclose_parallel(rule, first, count):
    """Fit both boxes."""
    enclose_boxes(rule.boxes, first, count, rule.bounds)


@inner
def place_candidates(rule, first, count, depth):
    """Lay k planes across each axis; the bounds are known.

    The first is at the least centroid and the others follow in steps of a k-th of the extent. What
    lies in a plane goes left, so there is always something on both sides.
    """
    boxes, centroids, limits = rule.boxes, rule.bounds[1], rule.limits
    k = len(rule.planes) // 3
    only = axis_to_divide(limits, centroids, depth)
    most = count if depth < MAXIMUM_DEPTH // 2 else 0  # below, nodes are split by index
    for axis in range(3):
        low, extent = centroids[axis], centroids[3 + axis] - centroids[axis]
        for i in range(k):
            plane, last = np.nan, EVERY
            if i < most and (axis == only or not limits.in_turn):
                plane = low + extent * (i / k)
                if count <= k:
                    plane = boxes[first + i, axis] + boxes[first + i, 3 + axis]
                    last = whole(rule.order[first + i])
            rule.planes[axis * k + i], rule.lasts[axis * k + i] = plane, last


@inner
def evaluate_candidates(rule, first, count, begin, end):
    """Compute the costs of the candidates ``begin <= i < end``; a GPU has a thread for each."""
    k = len(rule.planes) // 3
    for i in range(begin, end):
        cost, n_left, plane = np.inf, 0, rule.planes[i]
        if not np.isnan(plane):
            cost, n_left = cost_of_plane(
                rule.boxes, rule.order, first, count, i // k, plane, rule.lasts[i], rule.sides
            )
            note(rule.curve, i, i // k, 0.5 * plane, n_left, count - n_left, cost)
        rule.costs[i], rule.winners[i] = cost, i


@kernel
def reduction_step(costs, winners, stride):
    """Compare pairs of places `stride` apart; a GPU compares all of them at once.

    Place i, a multiple of twice the stride, stands for the best of as many candidates then. Of
    equal costs the lower candidate wins.
    """
    for i in range(0, len(winners) - stride, 2 * stride):
        a, b = winners[i], winners[i + stride]
        if costs[b] < costs[a]:
            winners[i] = b


@inner
def best_candidate(rule):
    """Reduce the candidates to one; return it as :func:`.recursion.choose` does."""
    stride = 1
    while stride < len(rule.winners):
        reduction_step(rule.costs, rule.winners, stride)
        stride *= 2
    best = rule.winners[0]
    if rule.costs[best] == np.inf:
        return whole(-1), EVERY, 0.0, np.inf
    axis = best // (len(rule.planes) // 3)
    return axis, rule.lasts[best], 0.5 * rule.planes[best], rule.costs[best]


@implements(choose, DataParallel)
def choose_parallel(rule, first, count, depth):
    """Evaluate all candidates and reduce them; `place` is the last triangle in the plane."""
    place_candidates(rule, first, count, depth)
    evaluate_candidates(rule, first, count, 0, len(rule.planes))
    return best_candidate(rule)


@implements(divide, DataParallel)
def divide_parallel(rule, first, count, axis, place, position):
    """Move every triangle to where the scan of the flags says; their order stays on both sides."""
    boxes, order, scan = rule.boxes, rule.order, rule.scan
    plane = 2.0 * position
    n_left = 0
    for i in range(first, first + count):
        scan[i] = n_left
        if goes_left(boxes[i], order[i], axis, plane, place):
            n_left += 1
    for i in range(first, first + count):
        to = first + n_left + (i - first - scan[i])
        if goes_left(boxes[i], order[i], axis, plane, place):
            to = first + scan[i]
        rule.spare_order[to] = order[i]
        for side in range(6):
            rule.spare_boxes[to, side] = boxes[i, side]
    for i in range(first, first + count):
        order[i] = rule.spare_order[i]
        for side in range(6):
            boxes[i, side] = rule.spare_boxes[i, side]
    return n_left


def data_parallel_rules(
    primitives: Primitives, settings: BinnedSettings, curve_rows: int = 0
) -> tuple[Callable[[], DataParallel], np.ndarray]:
    """Return what makes a rule for one thread, and the order of the triangles while they are split.

    The boxes of the primitives are reordered.
    """
    limits, boxes, n_candidates = limits_of(settings), primitives.boxes, 3 * settings.bins
    n = len(boxes)
    order = np.arange(n, dtype=np.int32)
    curve = np.full((curve_rows, 5), np.nan)
    spare = np.empty((n, 6)), np.empty(n, np.int32), np.empty(n, np.int32)

    def make_rule() -> DataParallel:
        return DataParallel(
            limits, np.empty((2, 6)), np.empty((2, 6)), curve,
            np.empty(n_candidates), np.empty(n_candidates, np.int64),
            np.empty(n_candidates), np.empty(n_candidates, np.int64),
            boxes, order, *spare,
        )  # fmt: skip

    return make_rule, order
