"""Marks made of segments: stars at points, arrows along ways, cones."""

from __future__ import annotations

import numpy as np


def stars(points: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return marks of three crossing lines at points (n, 3), as segments (3 n, 2, 3)."""
    arms = 0.5 * sizes[:, None, None, None] * np.stack([-np.eye(3), np.eye(3)], axis=1)
    return (points[:, None, None] + arms).reshape(-1, 2, 3)


def arrows(segments: np.ndarray) -> np.ndarray:
    """Return segments (n, 2, 3) with heads of four lines at their second ends, (5 n, 2, 3)."""
    begin, end = segments[:, 0], segments[:, 1]
    along = end - begin
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    # Across: from the axis that the segment leans to least; then across both, as long as it is.
    across = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    across *= length / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), length * 1e-9)
    other = np.cross(along, across) / length
    heads = [
        np.stack([end, end - 0.12 * along + 0.05 * side], axis=1)
        for side in (across, -across, other, -other)
    ]
    return np.concatenate([segments, *heads])


SIDE_LINES = 12
"""Of a cone that is drawn."""

CIRCLE = 48
"""Sides of the circles at its ends."""


def cone_lines(
    origin: np.ndarray, direction: np.ndarray, half_angle: float, begin: float, end: float
) -> np.ndarray:
    """Return a cone from t = `begin` to t = `end` along its axis, as segments (k, 2, 3).

    Parameters
    ----------
    origin, direction : (3,) float64
    half_angle : float
        Between axis and side, in radians.
    """
    length = float(np.linalg.norm(direction))
    across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    across /= np.linalg.norm(across)
    other = np.cross(direction / length, across)
    angle = 2.0 * np.pi * np.arange(CIRCLE) / CIRCLE
    around = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * other
    rims = [origin + t * direction + t * length * np.tan(half_angle) * around for t in (begin, end)]
    circles = [np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in rims]
    sides = np.stack(rims, axis=1)[:: CIRCLE // SIDE_LINES]
    return np.concatenate([*circles, sides])
