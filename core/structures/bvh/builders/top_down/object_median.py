"""Top-down construction by the object median: half of the triangles goes to each side.

The tree is as low as it can be, whatever the scene. By default it is divided across the longest
extent of the centroids; in turn it is x, y, z, but for axes along which all centroids are equal. Of
equal centroids the lower ids go left.

The median is found without sorting, by selection: divide by a triangle picked at random, and go on
with the side that has the middle. C. A. R. Hoare: Algorithm 65: Find, CACM 4(7), 1961.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....kernels import implements, kernel, whole
from .....progress import Progress
from ...topology.tree import Builder, Grouping, Primitives
from .centroid_plane import axis_to_divide, cost_of_plane, goes_left, group_by
from .recursion import Limits, TopDownSettings, choose, divide, enclose, enclose_boxes, swap


class Selection(NamedTuple):
    """The rule, with the scratch memory of one thread.

    Attributes
    ----------
    limits : Limits
    bounds : (2, 6) float64
    sides : (2, 6) float64
    boxes : (n, 6) float64
    order : (n,) int32
        Reordered together.
    """

    limits: Limits
    bounds: np.ndarray
    sides: np.ndarray
    boxes: np.ndarray
    order: np.ndarray


@implements(enclose, Selection)
def enclose_selection(rule, first, count):
    """Fit both boxes."""
    enclose_boxes(rule.boxes, first, count, rule.bounds)


@kernel
def select(boxes, order, first, count, axis, wanted):
    """Reorder a range so that its triangle number `wanted`, if it were sorted, is in its place.

    What belongs before it comes before it, what belongs behind it behind.
    """
    end, target, random = first + count, first + wanted, count
    while end - first > 1:
        # Pseudo-random, so that no order of the triangles is a bad one; the same every time.
        random = (random * 1664525 + 1013904223) % 4294967296
        last = end - 1
        swap(boxes, order, first + random % (end - first), last)
        plane, triangle = boxes[last, axis] + boxes[last, 3 + axis], order[last]
        middle = first
        for i in range(first, last):
            if goes_left(boxes[i], order[i], axis, plane, triangle):
                swap(boxes, order, i, middle)
                middle += 1
        swap(boxes, order, middle, last)
        if middle == target:
            break
        if middle < target:
            first = middle + 1
        else:
            end = middle


@implements(choose, Selection)
def choose_selection(rule, first, count, depth):
    """Select the last triangle of the left half; `place` is its id."""
    boxes, order = rule.boxes, rule.order
    axis = axis_to_divide(rule.limits, rule.bounds[1], depth)
    if axis < 0:
        return axis, 0, 0.0, np.inf
    half = count // 2
    select(boxes, order, first, count, axis, half - 1)
    last = first + half - 1
    triangle, plane = whole(order[last]), boxes[last, axis] + boxes[last, 3 + axis]
    cost, _ = cost_of_plane(boxes, order, first, count, axis, plane, triangle, rule.sides)
    return axis, triangle, 0.5 * plane, cost


@implements(divide, Selection)
def divide_selection(rule, first, count, axis, place, position):
    """Do nothing: the selection has divided them."""
    return count // 2


def build_object_median(
    primitives: Primitives, settings: TopDownSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree; the boxes of the primitives are reordered.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    return group_by(Selection, primitives, settings, progress, log)


BUILDER = Builder(
    "From the top down, half of the triangles to each side",
    TopDownSettings,
    build_object_median,
    bytes_per_triangle=350,
)
