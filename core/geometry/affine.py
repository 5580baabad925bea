"""Affine maps of points, with a bound on what they round."""

from __future__ import annotations

import numpy as np

from ..errors import InputError

EPS = np.finfo(np.float64).eps


def checked(matrix: np.ndarray) -> np.ndarray:
    """Return an affine map as a (4, 4) float64 matrix.

    Raises
    ------
    InputError
        If it is no such matrix: finite, with 0 0 0 1 as its last row.
    """
    matrix = np.asarray(matrix, dtype=np.float64)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise InputError(f"a transformation is a finite 4 x 4 matrix, not {matrix.shape}")
    if (matrix[3] != (0.0, 0.0, 0.0, 1.0)).any():
        raise InputError("the last row of a transformation must be 0 0 0 1: it must be affine")
    return matrix


def moved(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return points (..., 3) under an affine map."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def rounding(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return more than :func:`moved` rounds of sets of points, (n, k, 3) to (n,).

    A hundred roundings where it has four: room for a user who multiplies otherwise.
    """
    largest = np.abs(points) @ np.abs(matrix[:3, :3]).T + np.abs(matrix[:3, 3])
    return 100.0 * EPS * largest.sum(axis=2).max(axis=1)
