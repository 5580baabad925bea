"""Top-down construction by the surface area heuristic (SAH), evaluated between all centroids.

The best that one plane can do: n - 1 candidates per axis instead of a few bin borders. For each
axis a sweep from the right knows the areas of all that may go right, then one from the left finds
the cheapest place to cut (:mod:`.recursion` has the cost).

The triangles are sorted along each axis once. A split divides all three lists without disturbing
their order, so there is nothing to sort again, and the whole takes O(N log N). Of centroids that
are equal the one with the lower id comes first, so any two triangles can be told apart.

I. Wald, V. Havran: On building fast kd-trees for ray tracing, and on doing that in O(N log N),
RT 2006; here with centroids for events.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from .....geometry.box import area_of, clear, include
from .....kernels import implements, inner
from .....parallel import core_count
from .....progress import Progress
from ...topology.tree import Builder, Grouping, Primitives
from .recursion import (
    TEXT,
    Limits,
    TopDownSettings,
    axis_at,
    choose,
    divide,
    enclose,
    limits_of,
    note,
    split_recursively,
)

SUBTREE = 1 << 14
"""As in :mod:`.recursion`; a sweep takes a few times as long as binning."""


class Sweep(NamedTuple):
    """The rule. All threads share its arrays but `bounds`: each writes to the ranges it splits.

    Attributes
    ----------
    limits : Limits
    bounds : (2, 6) float64
    curve : (rows, 5) float64
        The candidate with i + 1 triangles on the left has row ``axis * (count - 1) + i``.
    boxes : (n, 6) float64
        By triangle.
    lists : (3, n) int32
        The triangles sorted by centroid along x, y and z; a node has the same range of all three.
    right_areas : (n,) float64
        Area of the triangles of a node from each place of a list to the end.
    goes_left : (n,) bool
        By triangle.
    spare : (n,) int32
    """

    limits: Limits
    bounds: np.ndarray
    curve: np.ndarray
    boxes: np.ndarray
    lists: np.ndarray
    right_areas: np.ndarray
    goes_left: np.ndarray
    spare: np.ndarray


@implements(enclose, Sweep)
def enclose_sweep(rule, first, count):
    """Fit the box of the node; boxes of centroids are not needed."""
    clear(rule.bounds[0])
    for i in range(first, first + count):
        include(rule.bounds[0], rule.boxes[rule.lists[0, i]])


@inner
def centroid(rule, axis, i):
    """Return the centroid of the triangle at a place of a list, doubled."""
    box = rule.boxes[rule.lists[axis, i]]
    return box[axis] + box[3 + axis]


@inner
def position_before(rule, axis, i):
    """Return the middle between the centroids at a place of a list and before it."""
    return 0.25 * (centroid(rule, axis, i - 1) + centroid(rule, axis, i))


@implements(choose, Sweep)
def choose_sweep(rule, first, count, depth):
    """Take the cheapest of 3 (count - 1) cuts; `place` is how many triangles go left."""
    boxes, curve, right_areas = rule.boxes, rule.curve, rule.right_areas
    side, last = rule.bounds[1], first + count - 1
    best_axis, best_n, best_cost = -1, count // 2, np.inf
    for turn in range(3):
        axis = axis_at(rule.limits, depth, turn)
        if rule.limits.in_turn and centroid(rule, axis, first) == centroid(rule, axis, last):
            continue
        clear(side)
        for i in range(last, first, -1):
            include(side, boxes[rule.lists[axis, i]])
            right_areas[i] = area_of(side)
        clear(side)
        for n in range(1, count):
            i = first + n
            include(side, boxes[rule.lists[axis, i - 1]])
            cost = n * area_of(side) + (count - n) * right_areas[i]
            if len(curve) > 0:
                position = position_before(rule, axis, i)
                note(curve, axis * (count - 1) + n - 1, axis, position, n, count - n, cost)
            if cost < best_cost:
                best_axis, best_n, best_cost = axis, n, cost
        if rule.limits.in_turn:
            break
    # Where no cost is finite, too, the lists have to be divided.
    best_axis = max(best_axis, 0)
    return best_axis, best_n, position_before(rule, best_axis, first + best_n), best_cost


@implements(divide, Sweep)
def divide_sweep(rule, first, count, axis, place, position):
    """Divide all three lists as the one of `axis` is cut; none changes its order."""
    lists, goes_left, spare = rule.lists, rule.goes_left, rule.spare
    for i in range(first, first + count):
        goes_left[lists[axis, i]] = i < first + place
    for other in range(3):
        if other == axis:
            continue
        n_left, n_right = 0, 0
        for i in range(first, first + count):
            triangle = lists[other, i]
            if goes_left[triangle]:
                lists[other, first + n_left] = triangle
                n_left += 1
            else:
                spare[first + n_right] = triangle
                n_right += 1
        for i in range(n_right):
            lists[other, first + n_left + i] = spare[first + i]
    return place


def sorted_lists(boxes: np.ndarray) -> np.ndarray:
    """Return the triangles sorted by centroid along x, y and z, ties by id: (3, n) int32."""
    lists = np.empty((3, len(boxes)), np.int32)

    def sort(axis: int) -> None:
        lists[axis] = np.argsort(boxes[:, axis] + boxes[:, 3 + axis], kind="stable")

    with ThreadPoolExecutor(core_count()) as pool:
        list(pool.map(sort, range(3)))
    return lists


def sweep_rules(
    primitives: Primitives, settings: TopDownSettings, curve_rows: int = 0
) -> tuple[Callable[[], Sweep], np.ndarray]:
    """Return what makes a rule for one thread, and the order of the triangles while they are split.

    That is the list along x.
    """
    limits, boxes = limits_of(settings), primitives.boxes
    n = len(boxes)
    lists, curve = sorted_lists(boxes), np.full((curve_rows, 5), np.nan)
    right_areas, goes_left, spare = np.empty(n), np.empty(n, np.bool_), np.empty(n, np.int32)

    def make_rule() -> Sweep:
        bounds = np.empty((2, 6))
        return Sweep(limits, bounds, curve, boxes, lists, right_areas, goes_left, spare)

    return make_rule, lists[0]


def build_sweep_sah(
    primitives: Primitives, settings: TopDownSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    progress.report(0, len(primitives.boxes), TEXT)
    make_rule, order = sweep_rules(primitives, settings)
    tree, told = split_recursively(make_rule, len(order), progress, log, SUBTREE)
    return Grouping(tree, order, log=told)


BUILDER = Builder(
    "From the top down, SAH evaluated between all centroids",
    TopDownSettings,
    build_sweep_sah,
    bytes_per_triangle=350,
)
