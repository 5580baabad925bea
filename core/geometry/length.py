"""Lengths of vectors whose squares may leave the range of numbers."""

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
