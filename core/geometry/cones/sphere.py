"""Whether a round cone meets an item of a mixed geometry: a sphere, or a triangle.

Around the axis all is alike, so a sphere and a cone with two ends are, in the half-plane that has
the sphere's centre, a circle and a trapezium: along the axis from one end to the other, across it
up to the cone's side. They meet if the nearest point of the trapezium is not farther from the
centre than the radius, nor the farthest one nearer: a sphere is a surface, and a cone may end
within. That is exact. Ellipses and rectangles are not alike around the axis; those are not asked
for spheres, nor is any cone for ellipsoids and other solids.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kernels import implements, inner, whole
from ..geometry import intersect
from ..solids.mixed import CENTRE, SPHERE, TRIANGLE, Mixed
from ..solids.moving_triangle import intersect_moving_triangle
from ..triangle import NO_HIT
from ..triangles import Triangles
from .cone import Cone, Spread
from .triangle import axis_of, border_met

ROUNDING = 1e-9
"""By how much the half-axes of an ellipsoid that is a sphere may differ, relative to its radius."""


def are_spheres(geometry: Mixed) -> np.ndarray:
    """Say of each item whether it is a sphere, (n,) bool; an ellipsoid is none."""
    are = geometry.kinds == SPHERE
    which = np.flatnonzero(are)
    half_axes = geometry.points[geometry.first[which][:, None] + np.arange(3)]
    products = half_axes @ half_axes.transpose(0, 2, 1)
    squares = products[:, 0, 0]
    apart = np.abs(products - squares[:, None, None] * np.eye(3)).max(axis=(1, 2))
    are[which] = apart <= ROUNDING * squares
    return are


def meets_all(geometry: Any, spread: Spread) -> bool:
    """Say whether a cone can be asked for every item: a round one for triangles and spheres."""
    if not isinstance(geometry, Mixed):
        return isinstance(geometry, Triangles)
    are_triangles = geometry.kinds == TRIANGLE
    if not spread.is_circular:
        return bool(are_triangles.all())
    return bool((are_triangles | are_spheres(geometry)).all())


@implements(intersect, Mixed, beside=Cone)
def mixed_and_cone(geometry, index, cone, limit, number, workspace, log):
    """Return the least t at which an item may meet a cone, NO_HIT if it does not, and its id."""
    primitive, rows = whole(geometry.ids[index]), geometry.rows
    if geometry.kinds[index] == TRIANGLE:
        t = border_met(rows, index, cone)
        if t == NO_HIT:
            t = intersect_moving_triangle(rows, index, axis_of(cone), geometry.reach)
            t = t if cone.t_min <= t <= cone.t_max else NO_HIT
        return t, primitive
    first = geometry.first[index]
    x, y, z = geometry.points[first]
    radius = (x * x + y * y + z * z) ** 0.5
    x, y, z = rows[index, CENTRE, 0], rows[index, CENTRE, 1], rows[index, CENTRE, 2]
    return sphere_met(cone, x - cone.ox, y - cone.oy, z - cone.oz, radius), primitive


@inner
def sphere_met(cone, x, y, z, radius):
    """Return the least t at which a sphere may meet a round cone, NO_HIT if it does not.

    Parameters
    ----------
    x, y, z : float
        Its centre as seen from the apex.
    """
    slope, low, high = cone.slope, cone.t_min * cone.length, cone.t_max * cone.length
    along = x * cone.ux + y * cone.uy + z * cone.uz
    px, py, pz = x - along * cone.ux, y - along * cone.uy, z - along * cone.uz
    across = (px * px + py * py + pz * pz) ** 0.5
    # The nearest point of the trapezium: straight along the axis if it is wide enough there, else
    # on its side, at the foot of the perpendicular.
    a = min(max(along, low), high)
    w = across
    if across > a * slope:
        a = min(max((along + across * slope) / (1.0 + slope * slope), low), high)
        w = a * slope
    if (along - a) ** 2 + (across - w) ** 2 > radius * radius:
        return NO_HIT
    # The farthest is a corner, on the other side of the axis.
    farthest = max(
        (low - along) ** 2 + (low * slope + across) ** 2,
        (high - along) ** 2 + (high * slope + across) ** 2,
    )
    if farthest < radius * radius:
        return NO_HIT
    t = (along - radius) / cone.length
    return t if t > cone.t_min else cone.t_min
