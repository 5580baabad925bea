"""Spatial splits: a plane cuts the triangles that straddle it, and both children get a part.

What is kept of a triangle is a *reference*: its number, and the box of the part that is meant.

Chopping a reference at a plane gives the box of what is below and of what is above. The part of a
triangle on one side of a plane is spanned by the corners on that side and the two points where its
edges cross the plane. A crossing is off by eleven roundings at most; the boxes are widened by 16
(:data:`.rays.ULPS`). So a box holds its part for certain, and the slack of rays, which has room for
what a hit is off its triangle, needs no more. Boxes of the same triangle may be intersected: what
is on both sides of two planes is in both boxes.

Binning (:func:`best_spatial_split`) chops each reference at the borders of the bins it reaches
into, counts where it starts and where it ends, and then sweeps over the bins from both sides.

M. Stich, H. Friedrich, A. Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...geometry.box import area_of
from ...kernels import inner

LEFT, RIGHT, REST = np.int64(0), np.int64(1), np.int64(2)


class References(NamedTuple):
    """The references of a builder.

    Attributes
    ----------
    corners : (n_triangles, 3, 3) float64
    slack : (3,) float64
        By how much a crossing is widened, per axis.
    triangle : (capacity,) int32
    boxes : (capacity, 6) float64
    """

    corners: np.ndarray
    slack: np.ndarray
    triangle: np.ndarray
    boxes: np.ndarray


class Bins(NamedTuple):
    """Scratch memory of one thread.

    Attributes
    ----------
    boxes, right_boxes : (bins, 6) float64
        What is in a bin, and in all behind it.
    starts, ends : (bins,) int64
        References whose first, last bin it is.
    parts : (3, 6) float64
        LEFT and RIGHT of a plane; and the REST of a reference that is still to be chopped.
    sides : (2, 6) float64
        What is LEFT and RIGHT of the best plane.
    """

    boxes: np.ndarray
    right_boxes: np.ndarray
    starts: np.ndarray
    ends: np.ndarray
    parts: np.ndarray
    sides: np.ndarray


def make_bins(count: int) -> Bins:
    """Return scratch memory for so many bins."""
    return Bins(
        np.empty((count, 6)), np.empty((count, 6)), np.empty(count, np.int64),
        np.empty(count, np.int64), np.empty((3, 6)), np.empty((2, 6)),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------ boxes


@inner
def clear(boxes, row):
    """Make a box contain nothing."""
    for axis in range(3):
        boxes[row, axis], boxes[row, 3 + axis] = np.inf, -np.inf


@inner
def grow(boxes, row, others, other):
    """Make a box contain another one; one just cleared changes nothing."""
    for axis in range(3):
        low, high = others[other, axis], others[other, 3 + axis]
        boxes[row, axis] = low if low < boxes[row, axis] else boxes[row, axis]
        boxes[row, 3 + axis] = high if high > boxes[row, 3 + axis] else boxes[row, 3 + axis]


@inner
def copy(boxes, row, others, other):
    """Copy a box."""
    for face in range(6):
        boxes[row, face] = others[other, face]


@inner
def is_empty(boxes, row):
    """Say whether a box is turned inside out across some axis."""
    return (
        boxes[row, 0] > boxes[row, 3]
        or boxes[row, 1] > boxes[row, 4]
        or boxes[row, 2] > boxes[row, 5]
    )


@inner
def area_with(boxes, row, others, other):
    """Return the surface area of the box around two boxes."""
    x0, x1 = min(boxes[row, 0], others[other, 0]), max(boxes[row, 3], others[other, 3])
    y0, y1 = min(boxes[row, 1], others[other, 1]), max(boxes[row, 4], others[other, 4])
    z0, z1 = min(boxes[row, 2], others[other, 2]), max(boxes[row, 5], others[other, 5])
    return 2.0 * ((x1 - x0) * (y1 - y0) + (y1 - y0) * (z1 - z0) + (z1 - z0) * (x1 - x0))


# --------------------------------------------------------------------------------------- one plane


@inner
def chop(references, triangle, boxes, row, axis, plane, parts):
    """Write the boxes of what of a triangle, in a box, is LEFT and RIGHT of a plane.

    Either may be empty, which :func:`is_empty` tells.

    Parameters
    ----------
    boxes, row
        Where the box is.
    parts : (2 or more, 6) float64
    """
    corners, slack = references.corners, references.slack
    clear(parts, LEFT)
    clear(parts, RIGHT)
    for corner in range(3):
        following = corner + 1 if corner < 2 else 0
        a, b = corners[triangle, corner, axis], corners[triangle, following, axis]
        crosses = (a < plane and b > plane) or (a > plane and b < plane)
        share = (plane - a) / (b - a) if crosses else 0.0
        for k in range(3):
            x = corners[triangle, corner, k]
            if a <= plane:
                parts[LEFT, k] = min(parts[LEFT, k], x)
                parts[LEFT, 3 + k] = max(parts[LEFT, 3 + k], x)
            if a >= plane:
                parts[RIGHT, k] = min(parts[RIGHT, k], x)
                parts[RIGHT, 3 + k] = max(parts[RIGHT, 3 + k], x)
            if crosses:
                x += share * (corners[triangle, following, k] - x)
                for side in range(2):
                    parts[side, k] = min(parts[side, k], x - slack[k])
                    parts[side, 3 + k] = max(parts[side, 3 + k], x + slack[k])
    parts[LEFT, 3 + axis] = min(parts[LEFT, 3 + axis], plane)
    parts[RIGHT, axis] = max(parts[RIGHT, axis], plane)
    for side in range(2):
        for k in range(3):
            parts[side, k] = max(parts[side, k], boxes[row, k])
            parts[side, 3 + k] = min(parts[side, 3 + k], boxes[row, 3 + k])


@inner
def bin_at(x, low, scale, bins):
    """Return the bin of a coordinate; used alike for counting and for dividing."""
    return min(int((x - low) * scale), bins - 1)


@inner
def scale_of(bounds, axis, bins):
    """Return bins per unit of length across a node; 0 if it has no extent to speak of."""
    extent = bounds[3 + axis] - bounds[axis]
    scale = bins * (1.0 - 1e-6) / extent if extent > 0.0 else 0.0
    return scale if scale < np.inf else 0.0


@inner
def fill_bins(references, first, count, axis, low, scale, used, bins):
    """Chop references at the borders of the bins."""
    boxes, parts = references.boxes, bins.parts
    for b in range(used):
        bins.starts[b], bins.ends[b] = 0, 0
        clear(bins.boxes, b)
    for i in range(first, first + count):
        b = bin_at(boxes[i, axis], low, scale, used)
        last = bin_at(boxes[i, 3 + axis], low, scale, used)
        bins.starts[b] += 1
        bins.ends[last] += 1
        if b == last:
            grow(bins.boxes, b, boxes, i)
            continue
        copy(parts, REST, boxes, i)
        while b < last:
            plane = low + (b + 1) / scale
            chop(references, references.triangle[i], parts, REST, axis, plane, parts)
            if not is_empty(parts, LEFT):
                grow(bins.boxes, b, parts, LEFT)
            copy(parts, REST, parts, RIGHT)
            b += 1
        if not is_empty(parts, REST):
            grow(bins.boxes, last, parts, REST)


@inner
def best_spatial_split(references, first, count, bounds, used, bins):
    """Return the cheapest of 3 (used - 1) planes; `bins.sides` gets the boxes of both sides.

    A plane has to take something away from either side: with all references on one side again,
    splitting might go on for ever.

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
    best_axis, best_bin, best_left, best_right, best_cost = -1, 0, 0, 0, np.inf
    parts = bins.parts
    for axis in range(3):
        scale = scale_of(bounds, axis, used)
        if scale == 0.0:
            continue
        fill_bins(references, first, count, axis, bounds[axis], scale, used, bins)
        # From the right: right_boxes[b] is around everything behind bin b.
        clear(parts, RIGHT)
        for b in range(used - 1, 0, -1):
            grow(parts, RIGHT, bins.boxes, b)
            copy(bins.right_boxes, b - 1, parts, RIGHT)
        # From the left, with the other side at hand.
        clear(parts, LEFT)
        n_left, n_right = 0, count
        for b in range(used - 1):
            grow(parts, LEFT, bins.boxes, b)
            n_left += bins.starts[b]
            n_right -= bins.ends[b]
            if n_left == 0 or n_right == 0 or n_left == count or n_right == count:
                continue
            cost = n_left * area_of(parts[LEFT]) + n_right * area_of(bins.right_boxes[b])
            if cost < best_cost:
                best_axis, best_bin, best_left, best_right = axis, b, n_left, n_right
                best_cost = cost
                copy(bins.sides, LEFT, parts, LEFT)
                copy(bins.sides, RIGHT, bins.right_boxes, b)
    return best_axis, best_bin, best_left, best_right, best_cost


# ---------------------------------------------------------------------------------------- dividing


@inner
def side_of(boxes, row, sides, n_left, n_right, has_room):
    """Return where a straddling reference is cheapest: LEFT, RIGHT, or REST for both.

    *Reference unsplitting*: leaving it whole on one side makes that side's box larger, but saves a
    reference on the other.
    """
    left, right = area_of(sides[LEFT]), area_of(sides[RIGHT])
    both = left * n_left + right * n_right if has_room else np.inf
    only_left = area_with(sides, LEFT, boxes, row) * n_left + right * (n_right - 1)
    only_right = left * (n_left - 1) + area_with(sides, RIGHT, boxes, row) * n_right
    if both <= only_left and both <= only_right:
        return REST
    return LEFT if only_left <= only_right else RIGHT


@inner
def swap(references, i, j):
    """Swap two references."""
    triangle, boxes = references.triangle, references.boxes
    triangle[i], triangle[j] = triangle[j], triangle[i]
    for face in range(6):
        boxes[i, face], boxes[j, face] = boxes[j, face], boxes[i, face]


@inner
def divide_spatially(
    references, first, count, room, bounds, axis, last_left, n_left, n_right, used, bins
):
    """Divide references by a plane: left ones first, right ones next, behind the end what is new.

    Parameters
    ----------
    room : int
        References that may be there in the end.
    axis, last_left, n_left, n_right
        As :func:`best_spatial_split` returned them, with `bins.sides`.

    Returns
    -------
    n_left, n_right : int
    plane : float
        Where it is.
    """
    triangle, boxes, parts, sides = references.triangle, references.boxes, bins.parts, bins.sides
    scale = scale_of(bounds, axis, used)
    plane = bounds[axis] + (last_left + 1) / scale
    i, j, end = first, first + count, first + count
    while i < j:
        where = REST
        if bin_at(boxes[i, 3 + axis], bounds[axis], scale, used) <= last_left:
            where = LEFT
        elif bin_at(boxes[i, axis], bounds[axis], scale, used) > last_left:
            where = RIGHT
        else:
            chop(references, triangle[i], boxes, i, axis, plane, parts)
            # The box may straddle the plane though nothing of the triangle in it does.
            if is_empty(parts, LEFT):
                where = RIGHT
                n_left -= 1
            elif is_empty(parts, RIGHT):
                where = LEFT
                n_right -= 1
            else:
                where = side_of(boxes, i, sides, n_left, n_right, end < first + room)
                if where == LEFT:
                    grow(sides, LEFT, boxes, i)
                    n_right -= 1
                elif where == RIGHT:
                    grow(sides, RIGHT, boxes, i)
                    n_left -= 1
        if where == REST:
            copy(boxes, i, parts, LEFT)
            copy(boxes, end, parts, RIGHT)
            triangle[end] = triangle[i]
            end += 1
        if where == RIGHT:
            j -= 1
            swap(references, i, j)
        else:
            i += 1
    return i - first, end - i, plane
