"""A disc, or, seen through a matrix, the inside of an ellipse.

The ray crosses the disc's plane at one point, which is in the circle or is not. Seen edge-on,
t is uncertain, but the point that is looked at lies on the ray and in the plane all the same: a hit
is never off the disc.
"""

from __future__ import annotations

from ...kernels import inner
from .mixed import SHAPE
from .unit_space import NOWHERE


@inner
def cross_disc(rows, index, ray):
    """Return twice the u at which a ray crosses the disc in the plane z = 0.

    A ray along the plane misses: what is divided by zero is in no circle.
    """
    u = -ray.z / ray.dz
    x, y = ray.x + u * ray.dx, ray.y + u * ray.dy
    radius = rows[index, SHAPE, 0]
    if x * x + y * y <= radius * radius:
        return u, u
    return NOWHERE
