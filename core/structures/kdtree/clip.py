"""Clipping triangles to cells: what makes the splits of a kd-tree "perfect".

A triangle that straddles a plane belongs to both children. The box of the part inside a child is
mostly smaller than the triangle's own box cut at the plane, and where the part is empty the
triangle would be listed for nothing. So the triangle is clipped to the cell (Sutherland and
Hodgman) and the polygon that is left is cut at the plane, which gives both boxes at once.

The original triangle is clipped anew for every cell, so rounding does not build up: a corner of
the polygon is off by a few units in the last place, which the slack of rays covers. A box still
never leaves the cell or the box it had before; if rounding would turn it inside out, the former
box, cut at the plane, stands in.

V. Havran, J. Bittner: On Improving KD-Trees for Ray Shooting, WSCG 2002 (split clipping).
"""

from __future__ import annotations

import numpy as np

from ...kernels import inlined, inner, kernel

POLYGON_SIZE = 10
"""Corners of a polygon: three, and one more for each of six planes, with room."""


@inlined
def cut_edge(polygon, p, q, axis, position, other):
    """Return coordinate `other` of the point where the edge from p to q crosses a plane."""
    share = (position - polygon[p, axis]) / (polygon[q, axis] - polygon[p, axis])
    return polygon[p, other] + share * (polygon[q, other] - polygon[p, other])


@inner
def keep_side(polygon, first, count, axis, position, sign, target):
    """Write to row `target` on what is left of a polygon on one side; return its corner count.

    The side is ``sign * x >= sign * position``; the polygon starts at row `first`.
    """
    kept = target
    previous = first + count - 1
    for corner in range(first, first + count):
        here = sign * (polygon[corner, axis] - position)
        before = sign * (polygon[previous, axis] - position)
        if (here < 0.0 and before > 0.0) or (here > 0.0 and before < 0.0):
            for other in range(3):
                polygon[kept, other] = cut_edge(polygon, previous, corner, axis, position, other)
            polygon[kept, axis] = position
            kept += 1
        if here >= 0.0:
            for other in range(3):
                polygon[kept, other] = polygon[corner, other]
            kept += 1
        previous = corner
    return kept - target


@inner
def clip(corners, triangle, cell, polygon):
    """Clip a triangle to a cell, (6,); return the first row and the number of corners.

    `polygon` is (2 * POLYGON_SIZE, 3) scratch; every plane moves the polygon to its other half.
    """
    first, count = np.int64(0), np.int64(3)  # not literals: one compiled form of keep_side
    for corner in range(3):
        for axis in range(3):
            polygon[corner, axis] = corners[triangle, corner, axis]
    for axis in range(3):
        a = corners[triangle, 0, axis]
        b = corners[triangle, 1, axis]
        c = corners[triangle, 2, axis]
        if min(a, b, c) < cell[axis]:
            target = POLYGON_SIZE - first
            count = keep_side(polygon, first, count, axis, cell[axis], 1.0, target)
            first = target
        if max(a, b, c) > cell[3 + axis]:
            target = POLYGON_SIZE - first
            count = keep_side(polygon, first, count, axis, cell[3 + axis], -1.0, target)
            first = target
    return first, count


@inner
def fit_sides(polygon, first, count, axis, position, bounds):
    """Write the boxes of a polygon's parts below and above a plane to `bounds`, (2, 6).

    A side with no part gets a box that is inside out.
    """
    for side in range(2):
        for other in range(3):
            bounds[side, other], bounds[side, 3 + other] = np.inf, -np.inf
    previous = first + count - 1
    for corner in range(first, first + count):
        here, before = polygon[corner, axis], polygon[previous, axis]
        crosses = (here < position and before > position) or (here > position and before < position)
        for other in range(3):
            x = polygon[corner, other]
            if here <= position:
                bounds[0, other] = min(bounds[0, other], x)
                bounds[0, 3 + other] = max(bounds[0, 3 + other], x)
            if here >= position:
                bounds[1, other] = min(bounds[1, other], x)
                bounds[1, 3 + other] = max(bounds[1, 3 + other], x)
            if crosses:
                x = position
                if other != axis:
                    x = cut_edge(polygon, previous, corner, axis, position, other)
                for side in range(2):
                    bounds[side, other] = min(bounds[side, other], x)
                    bounds[side, 3 + other] = max(bounds[side, 3 + other], x)
        previous = corner


@inner
def divide_reference(corners, triangle, cell, axis, position, boxes, low, high, polygon, bounds):
    """Give a triangle that straddles a plane its boxes on both sides.

    Parameters
    ----------
    cell : (6,) float64
        The cell that is split.
    boxes : (n, 6) float64
        Row `low` holds the box inside the cell. Afterwards it is the box below the plane, and row
        `high` the box above.
    polygon, bounds : (2 * POLYGON_SIZE, 3) and (2, 6) float64
        Scratch.
    """
    first, count = clip(corners, triangle, cell, polygon)
    fit_sides(polygon, first, count, axis, position, bounds)
    # The new boxes lie inside the former one ...
    is_sound_low, is_sound_high = True, True
    for other in range(3):
        before_low, before_high = boxes[low, other], boxes[low, 3 + other]
        for side in range(2):
            bounds[side, other] = max(bounds[side, other], before_low)
            bounds[side, 3 + other] = min(bounds[side, 3 + other], before_high)
        is_sound_low = is_sound_low and bounds[0, other] <= bounds[0, 3 + other]
        is_sound_high = is_sound_high and bounds[1, other] <= bounds[1, 3 + other]
    # ... or are that one, cut at the plane.
    for other in range(3):
        before_low, before_high = boxes[low, other], boxes[low, 3 + other]
        is_axis = other == axis
        if is_sound_high:
            boxes[high, other], boxes[high, 3 + other] = bounds[1, other], bounds[1, 3 + other]
        else:
            boxes[high, other] = position if is_axis else before_low
            boxes[high, 3 + other] = before_high
        if is_sound_low:
            boxes[low, other], boxes[low, 3 + other] = bounds[0, other], bounds[0, 3 + other]
        else:
            boxes[low, 3 + other] = position if is_axis else before_high


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
        first, count = clip(corners, triangle, boxes[leaf_of[entry]], polygon)
        for i in range(first + 1, first + count - 1):
            area = 0.0
            for axis in range(3):
                u, v = (axis + 1) % 3, (axis + 2) % 3
                eu, ev = polygon[i, u] - polygon[first, u], polygon[i, v] - polygon[first, v]
                fu = polygon[i + 1, u] - polygon[first, u]
                fv = polygon[i + 1, v] - polygon[first, v]
                area += (eu * fv - ev * fu) ** 2
            areas[triangle] += 0.5 * area**0.5
