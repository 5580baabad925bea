"""Top-down construction by the spatial median: a plane halves the extent of the centroids.

The oldest rule and the quickest to evaluate: how many triangles there are on either side is not
looked at. By default the longest extent is halved; in turn it is that of x, y, z, but for axes
along which all centroids are equal. The cost of the split only decides whether it is worth while or
a leaf is cheaper (:mod:`.recursion`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....kernels import implements
from .....progress import Progress
from ...topology.tree import Builder, Grouping, Primitives
from .centroid_plane import EVERY, axis_to_divide, cost_of_plane, divide_by_plane, group_by
from .recursion import Limits, TopDownSettings, choose, divide, enclose, enclose_boxes


class Halving(NamedTuple):
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


@implements(enclose, Halving)
def enclose_halving(rule, first, count):
    """Fit both boxes."""
    enclose_boxes(rule.boxes, first, count, rule.bounds)


@implements(choose, Halving)
def choose_halving(rule, first, count, depth):
    """Halve the longest extent, or that of the axis whose turn it is."""
    centroids = rule.bounds[1]
    axis = axis_to_divide(rule.limits, centroids, depth)
    if axis < 0:
        return axis, 0, 0.0, np.inf
    plane = 0.5 * centroids[axis] + 0.5 * centroids[3 + axis]
    cost, _ = cost_of_plane(rule.boxes, rule.order, first, count, axis, plane, EVERY, rule.sides)
    return axis, 0, 0.5 * plane, cost


@implements(divide, Halving)
def divide_halving(rule, first, count, axis, place, position):
    """Swap those up to the plane to the front."""
    return divide_by_plane(rule.boxes, rule.order, first, count, axis, 2.0 * position, EVERY)


def build_spatial_median(
    primitives: Primitives, settings: TopDownSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree; the boxes of the primitives are reordered.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    return group_by(Halving, primitives, settings, progress, log)


BUILDER = Builder(
    "From the top down, every node halved in space",
    TopDownSettings,
    build_spatial_median,
)
