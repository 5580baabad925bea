"""Object and spatial splits, found by the same binning.

A spatial split is a plane that cuts the references that straddle it (:mod:`.chop`); both children
get a part. Binning chops each reference at the borders of the bins it reaches into, counts where it
starts and where it ends, and then sweeps over the bins from both sides. For an object split a
reference is in one bin, that of its centroid, whole; everything else is the same.

M. Stich, H. Friedrich, A. Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....geometry.box import area_of
from .....geometry.clip import POLYGON_SIZE
from .....kernels import inner, whole
from ..top_down.recursion import axis_at, swap
from .chop import BOTH, LEFT, RIGHT, chop_item, clear, copy, enlarge, is_empty, restrict

SPATIAL, OBJECT = whole(0), whole(1)
"""Kinds of splits, and which row of a node's bounds has the box that is cut into bins: that around
the references, or that around their centroids (:func:`..top_down.recursion.enclose_boxes`)."""

REST, TRIAL = whole(2), whole(3)
"""Rows of `Bins.parts`: what is still to be chopped, and for trying out."""

SIDES = whole(4)
"""Row of `Bins.parts`: everything left of the best plane, and behind it everything right."""


class Bins(NamedTuple):
    """Scratch memory of one thread.

    Attributes
    ----------
    boxes : (2 * bins, 6) float64
        What is in each of the bins that are used; then, what is in all behind it.
    counts : (2 * bins,) int64
        References whose first bin it is; then, those whose last bin it is.
    parts : (6, 6) float64
        LEFT, RIGHT, REST, TRIAL, and two rows from SIDES on.
    polygon : (2 * POLYGON_SIZE, 3) float64
        For clipping.
    """

    boxes: np.ndarray
    counts: np.ndarray
    parts: np.ndarray
    polygon: np.ndarray


def make_bins(count: int) -> Bins:
    """Return scratch memory for so many bins."""
    return Bins(
        np.empty((2 * count, 6)), np.empty(2 * count, np.int64), np.empty((6, 6)),
        np.empty((2 * POLYGON_SIZE, 3)),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------ binning


@inner
def scale_of(bounds, kind, axis, used):
    """Return bins per unit of length across a node; 0 if it has no extent to speak of."""
    extent = bounds[kind, 3 + axis] - bounds[kind, axis]
    scale = used * (1.0 - 1e-6) / extent if extent > 0.0 else 0.0
    return scale if scale < np.inf else 0.0


@inner
def bins_of(boxes, i, kind, axis, low, scale, used):
    """Return the first and the last bin of a reference; used alike for counting and dividing."""
    if kind == OBJECT:
        place = int((boxes[i, axis] + boxes[i, 3 + axis] - low) * scale)
        place = place if place < used else used - 1
        return place, place
    start, end = int((boxes[i, axis] - low) * scale), int((boxes[i, 3 + axis] - low) * scale)
    return start if start < used else used - 1, end if end < used else used - 1


@inner
def fill_bins(references, first, count, kind, axis, low, scale, used, bins):
    """Chop references at the borders of the bins."""
    geometry, slack, triangle = references.geometry, references.slack, references.triangle
    boxes, parts = references.boxes, bins.parts
    for b in range(used):
        bins.counts[b] = bins.counts[used + b] = 0
        clear(bins.boxes, b)
    for i in range(first, first + count):
        b, last = bins_of(boxes, i, kind, axis, low, scale, used)
        bins.counts[b] += 1
        bins.counts[used + last] += 1
        if b == last:
            enlarge(bins.boxes, b, boxes, i)
            continue
        copy(parts, REST, boxes, i)
        while b < last:
            plane = low + (b + 1) / scale
            chop_item(geometry, slack, triangle[i], parts, REST, axis, plane, parts, bins.polygon)
            if not is_empty(parts, LEFT):
                enlarge(bins.boxes, b, parts, LEFT)
            copy(parts, REST, parts, RIGHT)
            b += 1
        if not is_empty(parts, REST):
            enlarge(bins.boxes, last, parts, REST)


@inner
def best_split(references, first, count, room, kind, bounds, used, bins, limits, depth, best_cost):
    """Return the cheapest of 3 (used - 1) planes; the boxes of both sides go to SIDES.

    A spatial split may leave all references on both sides: of diagonal ones, each has a quarter of
    the area then. What puts an end to that is the overlap from which on it is looked for.

    Parameters
    ----------
    room : int
        References that there may be in the children together.
    kind : int
        OBJECT or SPATIAL.
    bounds : (2, 6) float64
        Of the node, see :data:`OBJECT`.
    used : int
        How many bins.
    limits, depth
        Decide the order of the axes (:func:`..top_down.recursion.axis_at`).
    best_cost : float
        Only cheaper ones count.

    Returns
    -------
    axis : int
        -1 if there is none.
    last_left : int
        The plane is behind this bin.
    n_left, n_right : int
        References on either side, those on both counted twice.
    cost : float
        SA(L) N_L + SA(R) N_R.
    """
    best_axis, best_bin, best_left, best_right = -1, 0, 0, 0
    parts = bins.parts
    for turn in range(3):
        axis = axis_at(limits, depth, turn)
        scale = scale_of(bounds, kind, axis, used)
        if scale == 0.0:
            continue
        fill_bins(references, first, count, kind, axis, bounds[kind, axis], scale, used, bins)
        # From the right.
        clear(parts, RIGHT)
        for b in range(used - 1, 0, -1):
            enlarge(parts, RIGHT, bins.boxes, b)
            copy(bins.boxes, used + b - 1, parts, RIGHT)
        # From the left, with the other side at hand.
        clear(parts, LEFT)
        n_left, n_right = 0, count
        for b in range(used - 1):
            enlarge(parts, LEFT, bins.boxes, b)
            n_left += bins.counts[b]
            n_right -= bins.counts[used + b]
            if n_left == 0 or n_right == 0 or n_left + n_right > room:
                continue
            cost = n_left * area_of(parts[LEFT]) + n_right * area_of(bins.boxes[used + b])
            if cost < best_cost:
                best_axis, best_bin, best_left, best_right = axis, b, n_left, n_right
                best_cost = cost
                copy(parts, SIDES + LEFT, parts, LEFT)
                copy(parts, SIDES + RIGHT, bins.boxes, used + b)
        if limits.in_turn and best_axis >= 0:
            break
    return best_axis, best_bin, best_left, best_right, best_cost


@inner
def overlap_of(parts):
    """Return the surface area of what the two SIDES have in common."""
    copy(parts, TRIAL, parts, SIDES + LEFT)
    for axis in range(3):
        restrict(parts, TRIAL, axis, parts[SIDES + RIGHT, axis], parts[SIDES + RIGHT, 3 + axis])
    return 0.0 if is_empty(parts, TRIAL) else area_of(parts[TRIAL])


# ---------------------------------------------------------------------------------------- dividing


@inner
def side_of(boxes, row, parts, n_left, n_right):
    """Return where a straddling reference is cheapest: LEFT, RIGHT or BOTH.

    *Reference unsplitting*: leaving it whole on one side makes that side's box larger, but saves a
    reference on the other.
    """
    left, right = area_of(parts[SIDES + LEFT]), area_of(parts[SIDES + RIGHT])
    cost, side = left * n_left + right * n_right, BOTH
    copy(parts, TRIAL, boxes, row)
    enlarge(parts, TRIAL, parts, SIDES + LEFT)
    only_left = area_of(parts[TRIAL]) * n_left + right * (n_right - 1)
    if only_left < cost:
        cost, side = only_left, LEFT
    copy(parts, TRIAL, boxes, row)
    enlarge(parts, TRIAL, parts, SIDES + RIGHT)
    only_right = left * (n_left - 1) + area_of(parts[TRIAL]) * n_right
    return RIGHT if only_right < cost else side


@inner
def divide(references, first, count, kind, bounds, axis, last_left, n_left, n_right, used, bins):
    """Divide references by a plane: left ones first, right ones next, behind the end what is new.

    Parameters
    ----------
    axis, last_left, n_left, n_right
        As :func:`best_split` returned them, with SIDES of the bins.

    Returns
    -------
    n_left, n_right : int
        One may be 0, if all straddle and are cheapest on the same side.
    plane : float
        Where it is.
    """
    triangle, boxes, parts = references.triangle, references.boxes, bins.parts
    low, scale = bounds[kind, axis], scale_of(bounds, kind, axis, used)
    plane = low + (last_left + 1) / scale
    i, j, end = first, first + count, first + count
    while i < j:
        start, last = bins_of(boxes, i, kind, axis, low, scale, used)
        if last <= last_left:
            where = LEFT
        elif start > last_left:
            where = RIGHT
        else:
            chop_item(
                references.geometry, references.slack, triangle[i], boxes, i, axis, plane, parts,
                bins.polygon,
            )  # fmt: skip
            # The box may straddle the plane though nothing of the triangle in it does.
            if is_empty(parts, LEFT):
                where = RIGHT
            elif is_empty(parts, RIGHT):
                where = LEFT
            else:
                where = side_of(boxes, i, parts, n_left, n_right)
            if where == LEFT:
                enlarge(parts, SIDES + LEFT, boxes, i)
                n_right -= 1
            elif where == RIGHT:
                enlarge(parts, SIDES + RIGHT, boxes, i)
                n_left -= 1
        if where == BOTH:
            copy(boxes, i, parts, LEFT)
            copy(boxes, end, parts, RIGHT)
            triangle[end] = triangle[i]
            end += 1
        if where == RIGHT:
            j -= 1
            swap(boxes, triangle, i, j)
        else:
            i += 1
    return i - first, end - i, plane
