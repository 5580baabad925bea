"""Lengths of vectors whose squares may leave the range of numbers, and areas of polygons."""

from __future__ import annotations

from ..kernels import inner

LEAST, MOST = 1e-280, 1e300
"""Squares in between have lost nothing to underflow, and have not overflown."""


@inner
def length(x, y, z):
    """Return the length of a vector of any size: of a cross product, say, in a scene of 1e90."""
    square = x * x + y * y + z * z
    if LEAST < square < MOST:
        return square**0.5
    largest = max(abs(x), abs(y), abs(z))
    if not largest > 0.0:
        return largest
    x, y, z = x / largest, y / largest, z / largest
    return largest * (x * x + y * y + z * z) ** 0.5


@inner
def polygon_area(points, begin, end):
    """Return the area of a flat polygon without crossings, ``points[begin:end]``, (n, 3) float64.

    It is half the length of what the cross products of a fan of triangles add up to.
    """
    nx, ny, nz = 0.0, 0.0, 0.0
    for i in range(begin + 1, end - 1):
        ax, ay, az = (
            points[i, 0] - points[begin, 0],
            points[i, 1] - points[begin, 1],
            points[i, 2] - points[begin, 2],
        )
        bx, by, bz = (
            points[i + 1, 0] - points[begin, 0],
            points[i + 1, 1] - points[begin, 1],
            points[i + 1, 2] - points[begin, 2],
        )
        nx, ny, nz = nx + ay * bz - az * by, ny + az * bx - ax * bz, nz + ax * by - ay * bx
    return 0.5 * length(nx, ny, nz)
