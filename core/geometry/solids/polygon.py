"""A planar polygon of any number of corners, convex or not.

As in the triangle test, corners are moved so that the ray starts at the origin, and sheared so that
it runs along z; whether the polygon contains the origin is then a question in the plane. A line
through the origin, y = 0, crosses the polygon's border at some edges; with an odd number of them to
the right, the origin is inside (even-odd rule; E. Haines: Point in Polygon Strategies, in Graphics
Gems IV, 1994).

To look along the ray, instead of along the axis next to the polygon's normal, has two advantages.
Two polygons that share an edge, in whatever planes, see it at the same place and agree on which
side of the ray it is: no ray slips through between them. And there is no need of the plane: z is
interpolated between the nearest crossings to the left and to the right, which lie on edges. So a
hit is on the polygon also where that is seen edge-on, and where its corners are slightly off a
plane. Seen exactly edge-on it is a line, and not hit.
"""

from __future__ import annotations

import numpy as np

from ...kernels import inner
from ..triangle import NO_HIT


@inner
def intersect_polygon(points, first, count, ray):
    """Return the t at which a ray hits a polygon, or NO_HIT; edges and corners belong to it."""
    z = cross_polygon(
        points, first, count, ray.kx, ray.ky, ray.kz, ray.okx, ray.oky, ray.okz,
        ray.shear_x, ray.shear_y,
    )  # fmt: skip
    return ray.shear_z * z if z < NO_HIT else NO_HIT


@inner
def cross_polygon(points, first, count, kx, ky, kz, ox, oy, oz, shear_x, shear_y):
    """Return the z at which a line crosses a polygon, counted from its origin, or NO_HIT.

    Parameters
    ----------
    points : (m, 3) float64
        The polygon has the corners ``first <= i < first + count``.
    kx, ky, kz : int
        Which axes of the points are taken as x, y and z, the line's main axis.
    ox, oy, oz : float
        The line's origin, in these axes.
    shear_x, shear_y : float
        How far it goes along x and y for each unit of z.
    """
    is_inside = False
    left, left_z, right, right_z = np.inf, 0.0, np.inf, 0.0
    bx, by, bz = 0.0, 0.0, 0.0
    # Once around: the last corner is that before the first one.
    for step in range(-1, count):
        i = first + (step if step >= 0 else count - 1)
        ax, ay, az = bx, by, bz
        bz = points[i, kz] - oz
        bx = points[i, kx] - ox - shear_x * bz
        by = points[i, ky] - oy - shear_y * bz
        if step < 0:
            continue
        if bx == 0.0 and by == 0.0:
            return bz
        if (ay > 0.0) != (by > 0.0):
            share = ay / (ay - by)
            x, z = abs(ax + share * (bx - ax)), az + share * (bz - az)
            # Which side the edge is on must not depend on which of its ends comes first.
            side = ax * by - ay * bx
            if side == 0.0:
                return z
            if (side > 0.0) == (by > ay):
                is_inside = not is_inside
                right, right_z = (x, z) if x < right else (right, right_z)
            else:
                left, left_z = (x, z) if x < left else (left, left_z)
        elif ay == 0.0 and by == 0.0 and (ax < 0.0) != (bx < 0.0):
            return az + ax / (ax - bx) * (bz - az)
    if not is_inside:
        return NO_HIT
    share = left / (left + right) if left > 0.0 else 0.0
    return left_z + share * (right_z - left_z)
