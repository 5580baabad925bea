"""Beams: everything that the rays of a cell of ray space pass.

With the origins in a box O and the slopes in intervals, all rays together fill a convex polyhedron
without an end: the box, carried away along a pyramid of directions. It is the intersection of
half-spaces. With A along the root's axis, the way the rays run, and y, u for either of the others:

    y <= O1y + u1 (A - A0 if u1 >= 0, else A1)      y >= O0y + u0 (A - A1 if u0 >= 0, else A0)
    A >= A0      y >= O0y if u0 >= 0      y <= O1y if u1 <= 0

and, where the direction straight along the axis is not among them, the two planes along the axis
that touch the pyramid beside its edges.

J. Arvo, D. Kirk: Fast Ray Tracing by Ray Classification, SIGGRAPH 1987. The five half-spaces that
bound a beam coarsely are theirs; with the others it is bounded exactly.
"""

from __future__ import annotations

import numpy as np

from ...kernels import inner, whole
from .ray_space import TIME, U, V

MOST_PLANES = 13
"""Half-spaces of a beam: one across the axis, four slanting, four and four along it."""

CERTAIN = 4.0
"""So many slacks must a ray pass within an item's border for it to hit the item for certain."""


@inner
def add_plane(planes, count, b, c, a, sign, nb, nc, na, position):
    """Write a half-space in axes b, c and A as one of x, y and z, its normal made a unit vector."""
    length = (nb * nb + nc * nc + na * na) ** 0.5
    plane = planes[count]
    plane[a], plane[b], plane[c] = sign * na / length, nb / length, nc / length
    plane[3] = position / length
    return count + 1


@inner
def bound_beam(root, bounds, planes):
    """Write the half-spaces of a beam, of points with n x <= position; return how many.

    Parameters
    ----------
    root : int
    bounds : (2, 6) float64
        The intervals of the cell.
    planes : (MOST_PLANES, 4) float64
        Unit normal and position.
    """
    a = whole(root // 2)
    sign = 1.0 if root % 2 == 0 else -1.0
    a0 = bounds[0, a] if sign > 0.0 else -bounds[1, a]
    a1 = bounds[1, a] if sign > 0.0 else -bounds[0, a]
    b, c = (a + 1) % 3, (a + 2) % 3
    u0, u1, v0, v1 = bounds[0, U], bounds[1, U], bounds[0, V], bounds[1, V]
    b0, b1, c0, c1 = bounds[0, b], bounds[1, b], bounds[0, c], bounds[1, c]
    count = add_plane(planes, whole(0), b, c, a, sign, 0.0, 0.0, -1.0, -a0)
    for which in range(2):
        s0, s1, o0, o1 = (u0, u1, b0, b1) if which == 0 else (v0, v1, c0, c1)
        nb, nc = (1.0, 0.0) if which == 0 else (0.0, 1.0)
        from_a = a0 if s1 >= 0.0 else a1
        count = add_plane(planes, count, b, c, a, sign, nb, nc, -s1, o1 - s1 * from_a)
        from_a = a1 if s0 >= 0.0 else a0
        count = add_plane(planes, count, b, c, a, sign, -nb, -nc, s0, s0 * from_a - o0)
        if s0 >= 0.0:
            count = add_plane(planes, count, b, c, a, sign, -nb, -nc, 0.0, -o0)
        if s1 <= 0.0:
            count = add_plane(planes, count, b, c, a, sign, nb, nc, 0.0, o1)
    # Seen along the axis the pyramid is a rectangle; a line through the middle and one of its
    # corners touches it if the other corners lie on one side.
    for corner in range(4):
        u, v = u1 if corner % 2 == 1 else u0, v1 if corner // 2 == 1 else v0
        if u == 0.0 and v == 0.0:
            continue
        for side in range(2):
            nb, nc = (v, -u) if side == 0 else (-v, u)
            most = max(nb * u0, nb * u1) + max(nc * v0, nc * v1)
            if most <= 0.0 and count < MOST_PLANES:
                position = max(nb * b0, nb * b1) + max(nc * c0, nc * c1)
                count = add_plane(planes, count, b, c, a, sign, nb, nc, 0.0, position)
    return count


@inner
def box_in_beam(boxes, item, planes, count, slack):
    """Say whether the box of an item is inside of a beam (1), outside (-1), or neither (0)."""
    where = 1
    for number in range(count):
        lowest, highest = 0.0, 0.0
        for axis in range(3):
            n = planes[number, axis]
            low, high = n * boxes[item, axis], n * boxes[item, 3 + axis]
            lowest += low if low < high else high
            highest += high if low < high else low
        position = planes[number, 3] + slack
        if lowest > position:
            return -1
        if highest > position:
            where = 0
    return where


@inner
def reaches_beam(shapes, item, bounds, planes, count, slack, polygon):
    """Say whether an item reaches into a beam, within a slack.

    Of what is cut (:mod:`....geometry.shapes`) that is known exactly: it is clipped to the beam. Of
    others more may be said to than do.

    Parameters
    ----------
    polygon : (2, k, 3) float64
        Scratch.
    """
    begin, size, points = shapes.start[item], shapes.size[item], shapes.points
    n_points = size
    half = size // 2
    for i in range(size):
        for axis in range(3):
            polygon[0, i, axis] = points[begin + i, axis]
    if shapes.is_moving[item]:
        # Where its corners are at the first and the last time of the cell.
        for i in range(half):
            for axis in range(3):
                start, end = points[begin + i, axis], points[begin + half + i, axis]
                for key in range(2):
                    time = bounds[key, TIME]
                    polygon[0, key * half + i, axis] = start + time * (end - start)
    is_cut = shapes.is_cut[item]
    now = 0
    for number in range(count):
        nx, ny, nz = planes[number, 0], planes[number, 1], planes[number, 2]
        position = planes[number, 3] + slack
        here, after = polygon[now], polygon[1 - now]
        lowest, highest = np.inf, -np.inf
        for i in range(n_points):
            h = nx * here[i, 0] + ny * here[i, 1] + nz * here[i, 2] - position
            lowest = h if h < lowest else lowest
            highest = h if h > highest else highest
        if lowest > 0.0:
            return False
        if not is_cut or highest <= 0.0:
            continue
        last, kept = n_points - 1, 0
        before = nx * here[last, 0] + ny * here[last, 1] + nz * here[last, 2] - position
        for i in range(n_points):
            h = nx * here[i, 0] + ny * here[i, 1] + nz * here[i, 2] - position
            if (h < 0.0 < before or before < 0.0 < h) and kept < len(after):
                share = before / (before - h)
                for axis in range(3):
                    after[kept, axis] = here[last, axis] + share * (
                        here[i, axis] - here[last, axis]
                    )
                kept += 1
            if h <= 0.0 and kept < len(after):
                for axis in range(3):
                    after[kept, axis] = here[i, axis]
                kept += 1
            last, before = i, h
        n_points, now = kept, 1 - now
    return True


@inner
def blocks_beam(shapes, item, root, bounds, slack, ray):
    """Say whether every ray of a beam hits a flat item for certain, and beyond all its origins.

    A ray from o along d passes an edge from p to q on the side that the sign says of the product
    d ((p - o) x (q - o)). That is linear in each of the numbers that make o and d, and so is on
    which side of the plane a ray begins, and to which it goes. So it is enough to ask the rays that
    begin in corners of the box and run along edges of the pyramid.

    Parameters
    ----------
    ray : (2, 3) float64
        Scratch.
    """
    if not shapes.is_own[item]:
        return False
    a = whole(root // 2)
    b, c = (a + 1) % 3, (a + 2) % 3
    begin, size, points = shapes.start[item], shapes.size[item], shapes.points
    o, d = ray[0], ray[1]
    d[a] = 1.0 if root % 2 == 0 else -1.0
    turn = 0.0
    for corner in range(32):
        for axis in range(3):
            o[axis] = bounds[(corner >> axis) & 1, axis]
        d[b], d[c] = bounds[(corner >> 3) & 1, U], bounds[(corner >> 4) & 1, V]
        length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) ** 0.5
        last = begin + size - 1
        px, py, pz = points[last, 0] - o[0], points[last, 1] - o[1], points[last, 2] - o[2]
        nx, ny, nz = 0.0, 0.0, 0.0
        for i in range(begin, begin + size):
            qx, qy, qz = points[i, 0] - o[0], points[i, 1] - o[1], points[i, 2] - o[2]
            x, y, z = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
            side = d[0] * x + d[1] * y + d[2] * z
            ex, ey, ez = qx - px, qy - py, qz - pz
            turn = side if turn == 0.0 else turn
            least = CERTAIN * slack * length * (ex * ex + ey * ey + ez * ez) ** 0.5
            if not abs(side) > least or (side > 0.0) != (turn > 0.0):
                return False
            nx, ny, nz = nx + x, ny + y, nz + z
            px, py, pz = qx, qy, qz
        # Twice the area along the normal; the same from wherever it is seen.
        height = nx * px + ny * py + nz * pz
        rate = nx * d[0] + ny * d[1] + nz * d[2]
        if not abs(height) > CERTAIN * slack * (nx * nx + ny * ny + nz * nz) ** 0.5:
            return False
        if (height > 0.0) != (rate > 0.0):
            return False
    return True
