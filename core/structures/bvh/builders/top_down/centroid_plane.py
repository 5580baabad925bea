"""A plane that divides triangles by their centroids, and what it costs; for kernels.

Triangles whose centroids lie in the plane are told apart by their ids: those up to `last` go left.
So there is a plane between any two triangles. Planes and centroids are doubled here, as the sum of
both sides of a box is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .....geometry.box import area_of, clear, include
from .....kernels import inner, whole
from .....progress import Progress
from ...topology.tree import Grouping, Primitives
from .recursion import TopDownSettings, axis_at, limits_of, split_recursively, swap

EVERY = whole(1 << 31)
"""As `last`: whatever lies in the plane goes left."""


@inner
def goes_left(box, triangle, axis, plane, last):
    """Say whether a triangle belongs to the left side of a plane."""
    centroid = box[axis] + box[3 + axis]
    return centroid < plane or (centroid == plane and triangle <= last)


@inner
def cost_of_plane(boxes, order, first, count, axis, plane, last, sides):
    """Return SA(L) N_L + SA(R) N_R, inf if a side is empty; and N_L.

    `sides`, (2, 6), gets the boxes of both sides.
    """
    clear(sides[0])
    clear(sides[1])
    n_left = 0
    for i in range(first, first + count):
        if goes_left(boxes[i], order[i], axis, plane, last):
            include(sides[0], boxes[i])
            n_left += 1
        else:
            include(sides[1], boxes[i])
    if n_left == 0 or n_left == count:
        return np.inf, n_left
    return n_left * area_of(sides[0]) + (count - n_left) * area_of(sides[1]), n_left


@inner
def divide_by_plane(boxes, order, first, count, axis, plane, last):
    """Swap what goes left to the front; return how many those are."""
    i, j = first, first + count - 1
    while i <= j:
        if goes_left(boxes[i], order[i], axis, plane, last):
            i += 1
        else:
            swap(boxes, order, i, j)
            j -= 1
    return i - first


@inner
def axis_to_divide(limits, centroids, depth):
    """Return the axis along which centroids extend furthest, or that whose turn it is.

    Parameters
    ----------
    centroids : (6,) float64
        Box around them.

    Returns
    -------
    int
        -1 if they are all equal. Axes along which they are equal miss their turn.
    """
    best, longest = -1, 0.0
    for turn in range(3):
        axis = axis_at(limits, depth, turn)
        extent = centroids[3 + axis] - centroids[axis]
        if extent > longest:
            best, longest = axis, extent
            if limits.in_turn:
                break
    return best


def group_by(
    rule: Callable[..., Any],
    primitives: Primitives,
    settings: TopDownSettings,
    progress: Progress,
    log: bool,
) -> Grouping:
    """Build a tree by a rule that has nothing but limits, bounds, sides, boxes and order.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    limits, boxes = limits_of(settings), primitives.boxes
    order = np.arange(len(boxes), dtype=np.int32)

    def make_rule() -> Any:
        return rule(limits, np.empty((2, 6)), np.empty((2, 6)), boxes, order)

    tree, told = split_recursively(make_rule, len(order), progress, log)
    return Grouping(tree, order, log=told)
