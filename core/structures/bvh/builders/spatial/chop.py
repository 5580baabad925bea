"""Chopping: the boxes of what of a triangle is on either side of a plane.

What SBVH keeps of a triangle is a *reference*: its number, and the box of the part that is meant.
The part of a triangle on one side of a plane is spanned by the corners on that side and the two
points where its edges cross the plane. A crossing is off by eleven roundings at most; the boxes are
widened by 16 (:data:`.rays.ULPS`). So a box holds its part for certain, and the slack of rays,
which has room for what a hit is off its triangle, needs no more. Boxes of the same triangle may be
intersected: what is on both sides of two planes is in both boxes.

M. Stich, H. Friedrich, A. Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .....geometry.geometry import clip_box
from .....geometry.solids.mixed import Mixed
from .....geometry.triangles import Triangles
from .....kernels import dispatched, implements, inner, whole

LEFT, RIGHT, BOTH = whole(0), whole(1), whole(2)
"""Where a reference goes, and rows of `Bins.parts`: of the reference that is being chopped."""


class References(NamedTuple):
    """The references of a builder.

    Attributes
    ----------
    geometry : NamedTuple of arrays
    slack : (3,) float64
        By how much a crossing is widened, per axis.
    triangle : (capacity,) int32
    boxes : (capacity, 6) float64
    """

    geometry: Any
    slack: np.ndarray
    triangle: np.ndarray
    boxes: np.ndarray


# ------------------------------------------------------------------------------------------ boxes


@inner
def clear(boxes, row):
    """Make a box contain nothing."""
    for axis in range(3):
        boxes[row, axis], boxes[row, 3 + axis] = np.inf, -np.inf


@inner
def enlarge(boxes, row, others, other):
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


# --------------------------------------------------------------------------------------- one plane


@inner
def include(boxes, row, axis, low, high):
    """Make a box contain an interval along one axis."""
    boxes[row, axis] = low if low < boxes[row, axis] else boxes[row, axis]
    boxes[row, 3 + axis] = high if high > boxes[row, 3 + axis] else boxes[row, 3 + axis]


@inner
def restrict(boxes, row, axis, low, high):
    """Cut a box to an interval along one axis."""
    boxes[row, axis] = low if low > boxes[row, axis] else boxes[row, axis]
    boxes[row, 3 + axis] = high if high < boxes[row, 3 + axis] else boxes[row, 3 + axis]


@inner
def chop(corners, slack, triangle, boxes, row, axis, plane, parts):
    """Write the boxes of what of a triangle, in a box, is LEFT and RIGHT of a plane.

    Either may be empty, which :func:`is_empty` tells.

    Parameters
    ----------
    corners : (n_triangles, 3, 3) float64
    slack
        As in :class:`References`.
    boxes, row
        Where the box is.
    parts : (2 or more, 6) float64
    """
    clear(parts, LEFT)
    clear(parts, RIGHT)
    for corner in range(3):
        following = corner + 1 if corner < 2 else 0
        a, b = corners[triangle, corner, axis], corners[triangle, following, axis]
        crosses = (a < plane and b > plane) or (a > plane and b < plane)
        share = (plane - a) / (b - a) if crosses else 0.0
        for k in range(3):
            x = corners[triangle, corner, k]
            crossing = x + share * (corners[triangle, following, k] - x)
            for side in range(2):
                if a <= plane if side == LEFT else a >= plane:
                    include(parts, side, k, x, x)
                if crosses:
                    include(parts, side, k, crossing - slack[k], crossing + slack[k])
    restrict(parts, LEFT, axis, -np.inf, plane)
    restrict(parts, RIGHT, axis, plane, np.inf)
    for side in range(2):
        for k in range(3):
            restrict(parts, side, k, boxes[row, k], boxes[row, 3 + k])


@dispatched
def chop_item(geometry, slack, item, boxes, row, axis, plane, parts, polygon):
    """Write the boxes of what of an item, in a box, is LEFT and RIGHT of a plane.

    Parameters
    ----------
    boxes, row
        Where the box is.
    parts : (2 or more, 6) float64
    polygon : (2 * POLYGON_SIZE, 3) float64
        Scratch.
    """
    raise TypeError(f"nothing of {type(geometry).__name__} can be chopped")


@implements(chop_item, Triangles)
def chop_triangle(geometry, slack, item, boxes, row, axis, plane, parts, polygon):
    """Look at the edges."""
    chop(geometry.corners, slack, item, boxes, row, axis, plane, parts)


@implements(chop_item, Mixed)
def chop_solid(geometry, slack, item, boxes, row, axis, plane, parts, polygon):
    """Cut the box, then shrink both parts as far as the item's kind can tell."""
    low, high = boxes[row, axis], boxes[row, 3 + axis]
    copy(parts, LEFT, boxes, row)
    copy(parts, RIGHT, parts, LEFT)
    restrict(parts, LEFT, axis, low, plane)
    restrict(parts, RIGHT, axis, plane, high)
    for side in range(2):
        if not is_empty(parts, side):
            clip_box(geometry, item, parts[side], parts[side], polygon)
