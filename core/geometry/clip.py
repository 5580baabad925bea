"""Clipping triangles to boxes: what makes the splits of a kd-tree "perfect".

A triangle that straddles a plane belongs to both children. The box of the part inside a child is
mostly smaller than the triangle's own box cut at the plane, and the smaller the boxes, the better
the planes that are found below. So the triangle is clipped to the child's cell (Sutherland and
Hodgman), and the box is fitted to the polygon that is left.

The original triangle is clipped anew for every cell, so rounding does not build up: a corner of
the polygon is off by a few units in the last place, which the slack of rays covers.

V. Havran, J. Bittner: On Improving KD-Trees for Ray Shooting, WSCG 2002 (split clipping).
"""

from __future__ import annotations

import numpy as np

from ..kernels import inner, kernel
from .geometry import clip_box
from .length import polygon_area

POLYGON_SIZE = 10
"""Corners of a polygon: three, and one more for each of six planes, with room. A plane crosses the
border of a convex polygon twice, one with rounding as well: what is within it counts as on the
plane."""

ROUNDING = 8 * np.finfo(np.float64).eps
"""How far a corner may be off by rounding, relative to the largest coordinate along its axis."""


@inner
def clip(corners, triangle, box, polygon):
    """Clip a triangle to a cell; return the first row and the end of what is left.

    Parameters
    ----------
    corners : (n, 3, 3) float64
    box : (6,) float64
    polygon : (2 * POLYGON_SIZE, 3) float64
        Scratch; every plane moves the polygon to the other half.
    """
    first, end = 0, 3
    for corner in range(3):
        for axis in range(3):
            polygon[corner, axis] = corners[triangle, corner, axis]
    for face in range(6):
        axis, plane = face % 3, box[face]
        inward = 1.0 if face < 3 else -1.0
        target = POLYGON_SIZE - first
        reach = abs(plane)
        for corner in range(3):
            x = abs(corners[triangle, corner, axis])
            reach = x if x > reach else reach
        slack = ROUNDING * reach
        kept, last, crossings = target, end - 1, 0
        before = inward * (polygon[last, axis] - plane)
        before = before if abs(before) > slack else 0.0
        for corner in range(first, end):
            here = inward * (polygon[corner, axis] - plane)
            here = here if abs(here) > slack else 0.0
            if (here < 0.0 < before or before < 0.0 < here) and crossings < 2:
                crossings += 1
                share = before / (before - here)
                for other in range(3):
                    start = polygon[last, other]
                    polygon[kept, other] = start + share * (polygon[corner, other] - start)
                polygon[kept, axis] = plane
                kept += 1
            if here >= 0.0:
                for other in range(3):
                    polygon[kept, other] = polygon[corner, other]
                kept += 1
            last, before = corner, here
        first, end = target, kept
    return first, end


@inner
def fit(box, polygon, first, end):
    """Shrink a box, (6,), to a polygon.

    Where rounding would turn the box inside out, it stays as it is.
    """
    for axis in range(3):
        low, high = np.inf, -np.inf
        for corner in range(first, end):
            x = polygon[corner, axis]
            low = x if x < low else low
            high = x if x > high else high
        low = low if low > box[axis] else box[axis]
        high = high if high < box[3 + axis] else box[3 + axis]
        if low <= high:
            box[axis], box[3 + axis] = low, high


@inner
def divide_reference(geometry, item, cells, left, axis, boxes, old, new, polygon):
    """Fit the boxes of an item's two parts, below and above the plane that it straddles.

    They stay inside the box before, which is inside the cell.

    Parameters
    ----------
    item : int
    left, axis : int
        The cell below the plane, that above is the next; and across which axis.
    boxes : (m, 6) float64
        Row `old` has the box of both parts and gets that of the part below, row `new` that of the
        part above.
    """
    for face in range(6):
        boxes[new, face] = boxes[old, face]
    boxes[old, 3 + axis] = boxes[new, axis] = cells[left + 1, axis]
    for side in range(2):
        part = boxes[new if side == 1 else old]
        clip_box(geometry, item, cells[left + side], part, polygon)


@kernel
def add_clipped_areas(corners, references, leaf_of, boxes, areas, polygon):
    """Add to `areas`, per triangle, the areas of its parts in the leaves that list it.

    Parameters
    ----------
    references, leaf_of : (m,) int
        The triangle and the leaf of each entry.
    boxes : (n_leaves, 6) float64
    """
    for entry in range(len(references)):
        triangle = references[entry]
        first, end = clip(corners, triangle, boxes[leaf_of[entry]], polygon)
        areas[triangle] += polygon_area(polygon, first, end)
