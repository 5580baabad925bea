"""Where rays go on from a surface: mirrored, or refracted by Snell's law.

Only sums, products, quotients and square roots: the same rays on every machine.
"""

from __future__ import annotations

import numpy as np


def mirrored(directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the directions of reflection.

    Parameters
    ----------
    directions : (n, 3) float64
        Unit vectors towards the surface.
    normals : (n, 3) float64
        Unit vectors on the side that these come from.
    """
    cosines = -(directions * normals).sum(axis=1)
    return directions + 2.0 * cosines[:, None] * normals


def refracted(
    directions: np.ndarray, normals: np.ndarray, ratios: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions of refraction, and where there is none: total reflection.

    Parameters
    ----------
    directions, normals
        As of :func:`mirrored`.
    ratios : (n,) float64
        The index of refraction of where the ray comes from, over that of where it goes to.

    Returns
    -------
    through : (n, 3) float64
        Unit vectors; of no meaning where reflection is total.
    is_total : (n,) bool
    """
    cosines = -(directions * normals).sum(axis=1)
    beyond = 1.0 - ratios * ratios * (1.0 - cosines * cosines)  # cosine of the other angle, squared
    is_total = beyond < 0.0
    bent = ratios * cosines - np.sqrt(np.maximum(beyond, 0.0))
    return ratios[:, None] * directions + bent[:, None] * normals, is_total


def whole_power(bases: np.ndarray, exponents: np.ndarray) -> np.ndarray:
    """Return bases, (n,), to the power of whole exponents, (n,) int64, at least 0, by squaring.

    The last digits of the mathematical library's power differ from machine to machine.
    """
    powers, squares, left = np.ones_like(bases), bases, exponents
    with np.errstate(under="ignore"):
        while left.any():
            powers = np.where(left & 1, powers * squares, powers)
            squares, left = squares * squares, left >> 1
    return powers
