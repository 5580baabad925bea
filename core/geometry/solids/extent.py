"""How far items of a mixed geometry extend: whole, in a direction, and within a cell.

Cells of a subdivision want to know what reaches into them and how much of it. Whatever is answered
is conservative: rather too large than too small.
"""

from __future__ import annotations

import math

import numpy as np

from ...kernels import implements, inner, unsigned, whole
from ..clip import ROUNDING, clip, fit
from ..geometry import clip_box, overlaps, support
from ..triangle import NO_HIT, overlaps_box
from .mixed import (
    BOX,
    CENTRE,
    CONE,
    DISC,
    MATRIX,
    MOVING_TRIANGLE,
    NORMAL,
    POLYGON,
    SHAPE,
    SPHERE,
    TRIANGLE,
    Mixed,
)
from .polygon import cross_polygon

# ------------------------------------------------------------------------------ in a direction


@implements(support, Mixed)
def support_mixed(geometry, index, x, y, z):
    """Take the farthest corner; in unit space, where the direction has other components."""
    kind, rows, points = geometry.kinds[index], geometry.rows, geometry.points
    first = whole(geometry.first[index])
    if kind <= MOVING_TRIANGLE:
        corner, far = 0, -np.inf
        for k in range(6):
            along = x * rows[index, k, 0] + y * rows[index, k, 1] + z * rows[index, k, 2]
            corner, far = (k, along) if along > far else (corner, far)
        return rows[index, corner, 0], rows[index, corner, 1], rows[index, corner, 2]
    if kind == POLYGON:
        if geometry.size[index] == 0:
            # Without area; its box says where it would be.
            box = geometry.boxes[index]
            return box[3 if x > 0.0 else 0], box[4 if y > 0.0 else 1], box[5 if z > 0.0 else 2]
        corner, far = 0, -np.inf
        for k in range(geometry.size[index]):
            px, py, pz = points[first + k, 0], points[first + k, 1], points[first + k, 2]
            along = x * px + y * py + z * pz
            corner, far = (k, along) if along > far else (corner, far)
        return points[first + corner, 0], points[first + corner, 1], points[first + corner, 2]
    u = x * points[first, 0] + y * points[first, 1] + z * points[first, 2]
    v = x * points[first + 1, 0] + y * points[first + 1, 1] + z * points[first + 1, 2]
    w = x * points[first + 2, 0] + y * points[first + 2, 1] + z * points[first + 2, 2]
    u, v, w = support_of_unit_solid(rows, index, kind, u, v, w)
    return (
        rows[index, CENTRE, 0] + u * points[first, 0] + v * points[first + 1, 0]
        + w * points[first + 2, 0],
        rows[index, CENTRE, 1] + u * points[first, 1] + v * points[first + 1, 1]
        + w * points[first + 2, 1],
        rows[index, CENTRE, 2] + u * points[first, 2] + v * points[first + 1, 2]
        + w * points[first + 2, 2],
    )  # fmt: skip


@inner
def support_of_unit_solid(rows, index, kind, u, v, w):
    """Return the point of a unit solid that is farthest in a direction."""
    if kind == BOX:
        return 1.0 if u > 0.0 else -1.0, 1.0 if v > 0.0 else -1.0, 1.0 if w > 0.0 else -1.0
    if kind == SPHERE:
        length = math.sqrt(u * u + v * v + w * w)
        length = length if length > 0.0 else 1.0
        return u / length, v / length, w / length
    # On a circle: a disc's, or that of the base or apex of a cone.
    length = math.sqrt(u * u + v * v)
    radius, end = 1.0, 0.0
    if kind == CONE:
        base, apex = rows[index, SHAPE, 0], rows[index, SHAPE, 1]
        radius, end = (apex, 1.0) if apex * length + w > base * length - w else (base, -1.0)
    length = length if length > 0.0 else 1.0
    return radius * u / length, radius * v / length, end


# -------------------------------------------------------------------------------- within a cell


@implements(overlaps, Mixed)
def overlaps_mixed(geometry, index, box):
    """Look for a direction that separates: an axis, a normal, or from the box to the centre."""
    kind, boxes, rows = geometry.kinds[index], geometry.boxes, geometry.rows
    if kind == TRIANGLE:
        return overlaps_box(rows, index, box)
    for axis in range(3):
        if boxes[index, axis] > box[3 + axis] or boxes[index, 3 + axis] < box[axis]:
            return False
    if kind == MOVING_TRIANGLE:
        return True
    if kind == POLYGON:
        return not is_beyond(geometry, index, box, NORMAL)
    # Across the sides of the parallelepiped around it: across a disc, along the axis of a cone.
    for side in range(3):
        if kind != SPHERE and is_beyond(geometry, index, box, MATRIX + side):
            return False
    # For a ball, the direction from the nearest point of the box is the right one.
    x, y, z = rows[index, CENTRE, 0], rows[index, CENTRE, 1], rows[index, CENTRE, 2]
    x -= min(max(x, box[0]), box[3])
    y -= min(max(y, box[1]), box[4])
    z -= min(max(z, box[2]), box[5])
    return not separates(geometry, index, box, x, y, z)


@inner
def is_beyond(geometry, index, box, row):
    """Say whether an item and a box lie on two sides of a plane across a row of its numbers."""
    rows = geometry.rows
    x, y, z = rows[index, row, 0], rows[index, row, 1], rows[index, row, 2]
    return separates(geometry, index, box, x, y, z) or separates(geometry, index, box, -x, -y, -z)


@inner
def separates(geometry, index, box, x, y, z):
    """Say whether an item lies farther in a direction, of any length, than a box, (6,), does."""
    length = max(abs(x), abs(y), abs(z))
    if length == 0.0:
        return False
    x, y, z = x / length, y / length, z / length
    px, py, pz = support(geometry, index, -x, -y, -z)
    # The nearest point of the item, from the farthest of the box.
    bx, by, bz = box[3 if x > 0.0 else 0], box[4 if y > 0.0 else 1], box[5 if z > 0.0 else 2]
    slack = (abs(px) + abs(bx)) * abs(x) + (abs(py) + abs(by)) * abs(y)
    slack += (abs(pz) + abs(bz)) * abs(z)
    size = 0.0
    for side in range(6):
        size = max(size, abs(geometry.boxes[index, side]))
    return x * (px - bx) + y * (py - by) + z * (pz - bz) > ROUNDING * (slack + size)


@implements(clip_box, Mixed)
def clip_mixed(geometry, index, cell, box, polygon):
    """Cut the item's own box; of what is flat or round, less is left."""
    kind = geometry.kinds[index]
    for axis in range(3):
        polygon[0, axis] = geometry.boxes[index, axis]
        polygon[1, axis] = geometry.boxes[index, 3 + axis]
    fit(box, polygon, 0, 2)
    if kind == TRIANGLE:
        first, end = clip(geometry.rows, index, cell, polygon)
        fit(box, polygon, first, end)
    elif kind == POLYGON:
        for axis in range(3):
            polygon[0, axis], polygon[1, axis] = np.inf, -np.inf
        first, count = whole(geometry.first[index]), whole(geometry.size[index])
        bound_edges(geometry.points, first, count, cell, polygon)
        bound_inside(geometry.points, first, count, cell, polygon)
        if polygon[0, 0] <= polygon[1, 0]:
            fit(box, polygon, 0, 2)
    elif kind in (SPHERE, DISC):
        first = whole(geometry.first[index])
        bound_ellipsoid(geometry.rows, index, geometry.points, first, cell, box)


@inner
def bound_edges(points, first, count, cell, bounds):
    """Enlarge bounds, lower and upper, so that they hold what is of a polygon's edges in a cell.

    Each edge is cut at the planes of the cell (Y.-D. Liang, B. Barsky: A New Concept and Method for
    Line Clipping, 1984), which are taken to be further out by what is rounded.
    """
    last = first + count - 1
    for i in range(first, first + count):
        start, end = 0.0, 1.0
        for axis in range(3):
            a, b = points[last, axis], points[i, axis]
            reach = max(abs(a), abs(b), abs(cell[axis]), abs(cell[3 + axis]))
            low, high = cell[axis] - ROUNDING * reach, cell[3 + axis] + ROUNDING * reach
            if a == b:
                if a < low or a > high:
                    end = -1.0
                continue
            low, high = (low - a) / (b - a), (high - a) / (b - a)
            low, high = (high, low) if high < low else (low, high)
            start, end = low if low > start else start, high if high < end else end
        if start <= end:
            for axis in range(3):
                a, b = points[last, axis], points[i, axis]
                include(bounds, axis, a + start * (b - a) if start > 0.0 else a)
                include(bounds, axis, a + end * (b - a) if end < 1.0 else b)
        last = i


@inner
def bound_inside(points, first, count, cell, bounds):
    """Enlarge bounds so that they hold where the edges of a cell go through a polygon."""
    for axis in range(3):
        u, v = unsigned((axis + 1) % 3), unsigned((axis + 2) % 3)
        reach = max(abs(cell[axis]), abs(cell[3 + axis]))
        for corner in range(4):
            x, y = cell[u + unsigned(3 * (corner % 2))], cell[v + unsigned(3 * (corner // 2))]
            z = cross_polygon(points, first, count, u, v, unsigned(axis), x, y, 0.0, 0.0, 0.0)
            slack = ROUNDING * max(reach, abs(z)) if z < NO_HIT else 0.0
            if cell[axis] - slack <= z <= cell[3 + axis] + slack:
                include(bounds, u, x)
                include(bounds, v, y)
                include(bounds, unsigned(axis), z)


@inner
def include(bounds, axis, x):
    """Enlarge bounds, rows of lower and upper, along one axis."""
    bounds[0, axis] = x if x < bounds[0, axis] else bounds[0, axis]
    bounds[1, axis] = x if x > bounds[1, axis] else bounds[1, axis]


@inner
def bound_ellipsoid(rows, index, points, first, cell, box):
    """Shrink a box to what is of an ellipsoid, or of an elliptic disc, between planes of the cell.

    Seen along a third axis it is an ellipse, with the matrix S of sums of products of half-axes.
    Farthest along b it is at ``S_ab / sqrt(S_bb)`` along a, from its centre. If that is between the
    planes across a, they take nothing away along b; else it extends to where it crosses the nearer
    one.
    """
    for a in range(3):
        centre = rows[index, CENTRE, a]
        low, high = cell[a] - centre, cell[3 + a] - centre
        for b in range(3):
            aa, bb, ab = 0.0, 0.0, 0.0
            for k in range(3):
                p, q = points[first + k, a], points[first + k, b]
                aa, bb, ab = aa + p * p, bb + q * q, ab + p * q
            if a == b or aa == 0.0 or bb == 0.0:
                continue
            extent = math.sqrt(aa)
            # Where the ellipse is steep, rounding a plane's place counts: it moves outward.
            step = ROUNDING * (abs(centre) + extent)
            for side in range(2):
                sign = 1.0 if side == 1 else -1.0
                widest = sign * ab / math.sqrt(bb)
                if low - step <= widest <= high + step:
                    continue
                at = low - step if widest < low else high + step
                if abs(at) > extent:
                    continue
                rest = max(bb - ab * ab / aa, 0.0) * ((extent - at) * (extent + at) / aa)
                y = rows[index, CENTRE, b] + ab / aa * at + sign * math.sqrt(rest)
                slack = ROUNDING * (abs(rows[index, CENTRE, b]) + math.sqrt(bb))
                if side == 1 and box[b] <= y + slack < box[3 + b]:
                    box[3 + b] = y + slack
                elif side == 0 and box[b] < y - slack <= box[3 + b]:
                    box[b] = y - slack
