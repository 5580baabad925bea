"""Clipping triangles to cells: what makes the splits of a kd-tree "perfect".

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

from ...kernels import inner, kernel

POLYGON_SIZE = 10
"""Corners of a polygon: three, and one more for each of six planes, with room."""


@inner
def clip(corners, triangle, cells, cell, polygon):
    """Clip a triangle to a cell; return the first row and the number of corners of what is left.

    Parameters
    ----------
    corners : (n, 3, 3) float64
    cells : (k, 6) float64
    polygon : (2 * POLYGON_SIZE, 3) float64
        Scratch; every plane moves the polygon to the other half.
    """
    first, count = 0, 3
    box = cells[cell]
    for corner in range(3):
        for axis in range(3):
            polygon[corner, axis] = corners[triangle, corner, axis]
    for face in range(6):
        axis, plane = face % 3, box[face]
        inward = 1.0 if face < 3 else -1.0
        target = POLYGON_SIZE - first
        kept, last = target, polygon[first + count - 1]
        for corner in range(first, first + count):
            point = polygon[corner]
            before, here = inward * (last[axis] - plane), inward * (point[axis] - plane)
            if (before < 0.0 and here > 0.0) or (before > 0.0 and here < 0.0):
                share = before / (before - here)
                for other in range(3):
                    polygon[kept, other] = last[other] + share * (point[other] - last[other])
                polygon[kept, axis] = plane
                kept += 1
            if here >= 0.0:
                for other in range(3):
                    polygon[kept, other] = point[other]
                kept += 1
            last = point
        first, count = target, kept - target
    return first, count


@inner
def divide_reference(corners, triangle, cells, left, boxes, old, new, polygon):
    """Fit the boxes of a triangle's two parts, below and above the plane that it straddles.

    A box stays inside its cell and inside the box before. Where rounding would turn it inside out,
    that is all it is cut to.

    Parameters
    ----------
    triangle : (m,) int32
        Of each reference.
    left : int
        The cell below the plane; that above is the next.
    boxes : (m, 6) float64
        Row `old` has the box of both parts and gets that of the part below, row `new` that of the
        part above.
    """
    whole = boxes[old]
    for side in range(1, -1, -1):
        first, count = clip(corners, triangle[old], cells, left + side, polygon)
        box, cell = boxes[new if side == 1 else old], cells[left + side]
        for axis in range(3):
            lower, upper = max(whole[axis], cell[axis]), min(whole[3 + axis], cell[3 + axis])
            low, high = np.inf, -np.inf
            for corner in range(first, first + count):
                x = polygon[corner, axis]
                low, high = min(low, x), max(high, x)
            low, high = max(low, lower), min(high, upper)
            box[axis] = low if low <= high else lower
            box[3 + axis] = high if low <= high else upper


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
        first, count = clip(corners, triangle, boxes, leaf_of[entry], polygon)
        for i in range(first + 1, first + count - 1):
            area = 0.0
            for axis in range(3):
                u, v = (axis + 1) % 3, (axis + 2) % 3
                eu, ev = polygon[i, u] - polygon[first, u], polygon[i, v] - polygon[first, v]
                fu = polygon[i + 1, u] - polygon[first, u]
                fv = polygon[i + 1, v] - polygon[first, v]
                area += (eu * fv - ev * fu) ** 2
            areas[triangle] += 0.5 * area**0.5
