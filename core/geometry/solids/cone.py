"""A cone, truncated or not, capped or open; with equal radii, a cylinder.

In unit space the axis runs from z = -h to z = h, and the radius there is ``r(z) = m + k z``. Points
of the ray with ``x² + y² = r²`` are the roots of a quadratic.

Its discriminant ``b² - a c`` would be a difference of nearly equal products wherever the ray passes
near the apex or along the side. By Lagrange's identity, for vectors whose third component counts
negative, it is a sum of squares of 2 x 2 determinants instead: two of them with r, one subtracted.
They are small themselves where the discriminant is. Near a tip all of x, y and r are small; so that
they are not small differences of large numbers, the ray's point is the one nearest to the tip.

A capped cone is the intersection of the endless cone and the strip between its ends, both of them
convex: the ray is inside where it is inside both. Where it passes a rim, the same two numbers, of
side and of strip, say which of them it enters first and whether at all; so it cannot slip through
between side and cap. An open cone is left of its side what lies in that strip, by the same numbers.
"""

from __future__ import annotations

import math

import numpy as np

from ...kernels import inner
from .mixed import CAPPED, SHAPE
from .unit_space import NOWHERE, cross_slab


@inner
def cross_cone(rows, index, ray):
    """Return the u at which a ray enters and leaves the cone, or crosses the side of an open one.

    Of two equal ones it crosses the side of an open cone only once.
    """
    base, apex, height = rows[index, SHAPE, 0], rows[index, SHAPE, 1], rows[index, SHAPE, 2]
    is_capped = rows[index, CAPPED, 0] != 0.0
    low, high = cross_slab(ray.z, ray.dz, height)
    if low > high:
        return NOWHERE
    slope = 0.5 * (apex - base) / height
    # Relative to the middle of the smaller end, and from the point of the ray nearest to it.
    end, r = (height, apex) if apex < base else (-height, base)
    x, y, z, dx, dy, dz = ray.x, ray.y, ray.z - end, ray.dx, ray.dy, ray.dz
    shift = -(x * dx + y * dy + z * dz) / (dx * dx + dy * dy + dz * dz)
    x, y, z = x + shift * dx, y + shift * dy, z + shift * dz
    r, dr = r + slope * z, slope * dz
    a = dx * dx + dy * dy - dr * dr
    b = x * dx + y * dy - r * dr
    c = x * x + y * y - r * r
    p, q, w = r * dx - x * dr, r * dy - y * dr, x * dy - y * dx
    discriminant = p * p + q * q - w * w
    # Steeper than the side, a ray cannot miss the double cone: it is rounded at the apex.
    if discriminant < 0.0 and a >= 0.0:
        return NOWHERE
    root = math.sqrt(discriminant) if discriminant > 0.0 else 0.0
    # The root of the larger sum first; the product of both is c / a.
    s = -b - root if b > 0.0 else root - b
    if s == 0.0:
        if a == 0.0:
            # Along the axis of a cylinder, or along the side itself.
            return (low, high) if is_capped and c <= 0.0 else NOWHERE
        near, far = shift, shift
    else:
        near, far = shift + s / a, shift + c / s
        near, far = (far, near) if far < near else (near, far)
    if is_capped:
        if a < 0.0:
            # Inside both halves of the double cone; this is the one with the positive radii.
            near, far = (far, np.inf) if dr > 0.0 else (-np.inf, near)
        near, far = low if low > near else near, high if high < far else far
        if near <= far:
            return near, far
        return NOWHERE
    if a < 0.0:
        # It crosses each half once, and this one not beyond the tip, whatever is rounded there.
        near = far if dr > 0.0 else near
        if base == 0.0 or apex == 0.0:
            if dr > 0.0:
                near = low if low > near else near
            else:
                near = high if high < near else near
        far = near
    if low <= near <= high:
        return near, far if low <= far <= high else near
    if low <= far <= high:
        return far, far
    return NOWHERE
