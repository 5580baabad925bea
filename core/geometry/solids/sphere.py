"""A sphere, or, seen through a matrix, an ellipsoid.

Points of the ray as far from the origin as the radius are the roots of a quadratic. From the point
of the ray that is nearest to the origin, both coefficients and roots are small, so no digits cancel
(E. Haines, J. Günther, T. Akenine-Möller: Precision Improvements for Ray/Sphere Intersection, in
Ray Tracing Gems, 2019).
"""

from __future__ import annotations

import math

from ...kernels import inner
from .mixed import SHAPE
from .unit_space import NOWHERE


@inner
def cross_sphere(rows, index, ray):
    """Return the u at which a ray enters and leaves the sphere."""
    a = ray.dx * ray.dx + ray.dy * ray.dy + ray.dz * ray.dz
    # Zero but for rounding, since the ray's point is the one nearest to the centre.
    b = ray.x * ray.dx + ray.y * ray.dy + ray.z * ray.dz
    radius = rows[index, SHAPE, 0]
    c = ray.x * ray.x + ray.y * ray.y + ray.z * ray.z - radius * radius
    discriminant = b * b - a * c
    if not (discriminant >= 0.0):
        return NOWHERE
    root = math.sqrt(discriminant)
    return (-b - root) / a, (-b + root) / a
