"""Unit space: where solids are round, upright and of about size 1, whatever they are in the scene.

A solid is a *unit solid* around the origin, of coordinates between -1 and 1, seen through an affine
matrix. Its widths there are between 1/2 and 1, because lengths are measured in powers of two: that
rounds nothing, and round numbers stay round.

Not the solid is brought to the ray, but the ray to the solid: origin and direction are moved by the
inverse matrix. The direction is not renormalised, so t is the same in both spaces.

Two measures against rounding. The origin is first moved along the ray to where that is nearest to
the solid's centre: from far away, coordinates of the origin would swamp the solid's. And the
direction is scaled to a largest component of 1, so that no square leaves the range of numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inner

BEYOND = 4.0
"""A squared distance that no point of a unit solid has from the origin: the farthest is a corner
of the box, at 3."""

NOWHERE = np.inf, -np.inf
"""Where a ray enters and leaves what it misses."""


class UnitRay(NamedTuple):
    """A ray in unit space, as ``(x, y, z) + u (dx, dy, dz)``.

    Attributes
    ----------
    x, y, z : float
        The point nearest to the origin.
    dx, dy, dz : float
        The largest is 1 or -1.
    start : float
        The u from the ray's own origin to that point.
    rate : float
        What t grows by along u: ``t = rate (start + u)``.
    """

    x: float
    y: float
    z: float
    dx: float
    dy: float
    dz: float
    start: float
    rate: float


@inner
def to_unit_space(rows, index, ray):
    """Return a ray as solid `index` sees it.

    If the matrix is zero, which stands for a singular one, all is NaN.

    Parameters
    ----------
    rows : (n, 6, 3) float64
    """
    x, y, z = ray.ox - rows[index, 3, 0], ray.oy - rows[index, 3, 1], ray.oz - rows[index, 3, 2]
    px = rows[index, 0, 0] * x + rows[index, 0, 1] * y + rows[index, 0, 2] * z
    py = rows[index, 1, 0] * x + rows[index, 1, 1] * y + rows[index, 1, 2] * z
    pz = rows[index, 2, 0] * x + rows[index, 2, 1] * y + rows[index, 2, 2] * z
    # The direction divided by its largest component, as the triangle test has it.
    sx, sy = ray.shear_x, ray.shear_y
    dx = rows[index, 0, ray.kx] * sx + rows[index, 0, ray.ky] * sy + rows[index, 0, ray.kz]
    dy = rows[index, 1, ray.kx] * sx + rows[index, 1, ray.ky] * sy + rows[index, 1, ray.kz]
    dz = rows[index, 2, ray.kx] * sx + rows[index, 2, ray.ky] * sy + rows[index, 2, ray.kz]
    size = abs(dx)
    size = abs(dy) if abs(dy) > size else size
    size = abs(dz) if abs(dz) > size else size
    size = size if ray.shear_z > 0.0 else -size
    dx, dy, dz = dx / size, dy / size, dz / size
    start = -(px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz)
    return UnitRay(
        px + start * dx, py + start * dy, pz + start * dz, dx, dy, dz, start, ray.shear_z / size
    )


@inner
def cross_slab(x, dx, half):
    """Return where a ray enters and leaves the strip of points with ``-half <= x <= half``."""
    if dx == 0.0:
        return (-np.inf, np.inf) if abs(x) <= half else NOWHERE
    low, high = (-half - x) / dx, (half - x) / dx
    return (high, low) if high < low else (low, high)
