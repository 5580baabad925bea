"""Whether a cone or a pyramid meets a triangle.

A triangle meets a cone if a part of an edge does, or if the axis pierces it. That is exact.
"""

from __future__ import annotations

import numpy as np

from ...kernels import implements, inner, whole
from ..geometry import intersect
from ..rays import Ray
from ..triangle import NO_HIT
from ..triangles import Triangles
from .cone import Cone


@inner
def meets_segment(cone, ax, ay, az, bx, by, bz):
    """Say whether a segment, from a to b as seen from the apex and not behind it, meets a cone.

    With coordinates x and y in half-widths, a cone is where ``along^2 - x^2 - y^2 >= 0``: on the
    segment a parabola; a pyramid where neither of |x| and |y| is more than `along`.
    """
    along = ax * cone.ux + ay * cone.uy + az * cone.uz
    x = ax * cone.ax + ay * cone.ay + az * cone.az
    y = ax * cone.bx + ay * cone.by + az * cone.bz
    to_along = bx * cone.ux + by * cone.uy + bz * cone.uz
    to_x = bx * cone.ax + by * cone.ay + bz * cone.az
    to_y = bx * cone.bx + by * cone.by + bz * cone.bz
    if cone.is_square:
        begin, end = 0.0, 1.0
        for side in range(4):
            sign = 1.0 if side < 2 else -1.0
            h = along + sign * (x if side % 2 == 0 else y)
            to_h = to_along + sign * (to_x if side % 2 == 0 else to_y)
            if h < 0.0 and to_h < 0.0:
                return False
            if h < 0.0:
                begin = max(begin, h / (h - to_h))
            elif to_h < 0.0:
                end = min(end, h / (h - to_h))
        return begin <= end
    at_a = along * along - x * x - y * y
    at_b = to_along * to_along - to_x * to_x - to_y * to_y
    if at_a >= 0.0 or at_b >= 0.0:
        return True
    e, ex, ey = to_along - along, to_x - x, to_y - y
    curvature = e * e - ex * ex - ey * ey
    rise = along * e - x * ex - y * ey
    if curvature >= 0.0 or rise <= 0.0 or rise >= -curvature:
        return False
    return at_a - rise * rise / curvature >= 0.0


@inner
def axis_of(c):
    """Return a cone's axis as a ray."""
    return Ray(
        c.ox, c.oy, c.oz, c.dx, c.dy, c.dz, c.ix, c.iy, c.iz, c.low_x, c.low_y, c.low_z,
        c.high_x, c.high_y, c.high_z, c.kx, c.ky, c.kz, c.okx, c.oky, c.okz,
        c.shear_x, c.shear_y, c.shear_z, c.t_min, c.t_max, c.query, c.time, c.mask, c.source,
        c.target,
    )  # fmt: skip


@implements(intersect, Triangles, beside=Cone)
def triangle_and_cone(geometry, index, cone, limit, number, workspace, log):
    """Return the least t at which a triangle may meet a cone, NO_HIT if it does not, and its id.

    A plane cuts a cone in a curve. Where that does not meet the border of the triangle, the whole
    of it lies inside, and the axis with it, or outside.
    """
    primitive = whole(geometry.ids[index])
    t = border_met(geometry.corners, index, cone)
    if t == NO_HIT:
        t, _ = intersect(geometry, index, axis_of(cone), cone.t_max, 0, 0, 0)
        t = t if t <= cone.t_max else NO_HIT
    return t, primitive


@inner
def border_met(corners, index, cone):
    """Return the least t at which a triangle may meet a cone, NO_HIT if its border does not.

    Ask the parts of its edges that lie between the cone's ends, and its parts there.

    Parameters
    ----------
    corners : (n, 3 or more, 3) float64
        The first three are a triangle's.
    """
    low, high = cone.t_min * cone.length, cone.t_max * cone.length
    nearest, is_met, n_low, n_high = np.inf, False, 0, 0
    # Where the border crosses the two ends.
    lx, ly, lz, hx, hy, hz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for corner in range(3):
        following = corner + 1 if corner < 2 else 0
        ax = corners[index, corner, 0] - cone.ox
        ay = corners[index, corner, 1] - cone.oy
        az = corners[index, corner, 2] - cone.oz
        bx = corners[index, following, 0] - cone.ox
        by = corners[index, following, 1] - cone.oy
        bz = corners[index, following, 2] - cone.oz
        a = ax * cone.ux + ay * cone.uy + az * cone.uz
        b = bx * cone.ux + by * cone.uy + bz * cone.uz
        nearest = a if a < nearest else nearest
        if (a < low and b < low) or (a > high and b > high):
            continue
        begin, end = 0.0, 1.0
        if (a < low) != (b < low):
            share = (low - a) / (b - a)
            x, y, z = ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az)
            if n_low == 1:
                is_met = is_met or meets_segment(cone, lx, ly, lz, x, y, z)
            lx, ly, lz, n_low = x, y, z, n_low + 1
            begin, end = (share, end) if a < low else (begin, share)
        if (a > high) != (b > high):
            share = (high - a) / (b - a)
            x, y, z = ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az)
            if n_high == 1:
                is_met = is_met or meets_segment(cone, hx, hy, hz, x, y, z)
            hx, hy, hz, n_high = x, y, z, n_high + 1
            begin, end = (max(begin, share), end) if a > high else (begin, min(end, share))
        ex, ey, ez = bx - ax, by - ay, bz - az
        is_met = is_met or meets_segment(
            cone, ax + begin * ex, ay + begin * ey, az + begin * ez,
            ax + end * ex, ay + end * ey, az + end * ez,
        )  # fmt: skip
    t = nearest / cone.length
    t = t if t > cone.t_min else cone.t_min
    return t if is_met else NO_HIT
