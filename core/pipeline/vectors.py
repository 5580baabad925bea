"""Vectors of three numbers, as tuples: what HLSL has operators and intrinsics for."""

from __future__ import annotations

import math

from ..kernels import inner


@inner
def add(a, b):
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inner
def subtract(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def scale(a, factor):
    """Return a vector times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@inner
def mix(a, b, share):
    """Return a + share (b - a): HLSL's ``lerp``."""
    return (
        a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])
    )  # fmt: skip


@inner
def dot(a, b):
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def cross(a, b):
    """Return the cross product."""
    return (
        a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    )  # fmt: skip


@inner
def normalize(a):
    """Return the unit vector in a direction; zero for zero."""
    length = math.sqrt(dot(a, a))
    return scale(a, 1.0 / length if length > 0.0 else 0.0)


@inner
def reflect(direction, normal):
    """Return a direction mirrored at a plane with this unit normal."""
    return subtract(direction, scale(normal, 2.0 * dot(direction, normal)))


@inner
def along(origin, direction, t):
    """Return origin + t direction."""
    return add(origin, scale(direction, t))


@inner
def moved_normal(matrix, normal):
    """Return a normal of object space in world space, of length one.

    Parameters
    ----------
    matrix : (12,) float
        World to object, row by row: normals are moved by its transpose.
    """
    return normalize(
        (
            matrix[0] * normal[0] + matrix[4] * normal[1] + matrix[8] * normal[2],
            matrix[1] * normal[0] + matrix[5] * normal[1] + matrix[9] * normal[2],
            matrix[2] * normal[0] + matrix[6] * normal[1] + matrix[10] * normal[2],
        )
    )
