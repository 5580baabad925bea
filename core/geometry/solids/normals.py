"""Which way the surfaces of a mixed geometry look, where rays have hit them.

A point of unit space satisfies some ``f(x) = 0``; in the scene that is ``f(M (x - c)) = 0``, so its
normal there is the gradient of f times the transposed matrix M. What has several sides is hit on
that whose plane or mantle is nearest to the point. Distances are those in the scene, and not in
unit space: points are rounded by the same length whatever side they are on, and a thin box would
find that length large across and small along itself.
"""

from __future__ import annotations

import numpy as np

from ..geometry import moved_by, normals_at
from .frames import units_of
from .mixed import (
    BOX,
    CAPPED,
    CENTRE,
    CONE,
    DISC,
    MATRIX,
    MOVING_TRIANGLE,
    NORMAL,
    POLYGON,
    SHAPE,
    SPHERE,
    TRIANGLE,
    Mixed,
    corners_at,
)


@normals_at.register
def _(geometry: Mixed, primitives: np.ndarray, points: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Ask all items of a kind at once; what has no area, and is never hit, has the normal zero."""
    kinds, gradients = geometry.kinds[primitives], np.empty((len(primitives), 3))
    for kind in np.unique(kinds):
        here = np.flatnonzero(kinds == kind)
        rows = geometry.rows[primitives[here]]
        if kind in (TRIANGLE, MOVING_TRIANGLE):
            gradients[here] = _across_corners(rows, times[here])
        elif kind == POLYGON:
            gradients[here] = rows[:, NORMAL]
        elif kind == DISC:
            gradients[here] = rows[:, MATRIX + 2]
        else:
            matrices = rows[:, MATRIX:CENTRE]
            local = moved_by(matrices, points[here] - rows[:, CENTRE])
            gradient = GRADIENTS[int(kind)](rows, matrices, local)
            # Rows of very small items are very long.
            sizes = np.abs(matrices).max(axis=(1, 2), keepdims=True)
            matrices = matrices / np.where(sizes > 0.0, sizes, 1.0)
            gradients[here] = moved_by(matrices.transpose(0, 2, 1), gradient)
    return units_of(gradients)[0]


def _across_corners(rows: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return vectors at right angles to triangles where they are at some times."""
    corners = corners_at(rows, times)
    return np.cross(
        units_of(corners[:, 1] - corners[:, 0])[0], units_of(corners[:, 2] - corners[:, 0])[0]
    )


def _of_sphere(rows: np.ndarray, matrices: np.ndarray, local: np.ndarray) -> np.ndarray:
    return local


def _of_box(rows: np.ndarray, matrices: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return the normals of the nearest sides, (k, 3), in unit space."""
    distances = np.abs(np.abs(local) - rows[:, SHAPE]) * _thickness(matrices)
    nearest = distances.argmin(axis=1)
    gradients = np.zeros_like(local)
    each = np.arange(len(local))
    gradients[each, nearest] = np.where(local[each, nearest] < 0.0, -1.0, 1.0)
    return gradients


def _of_cone(rows: np.ndarray, matrices: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return the normals of the mantle or of the nearer cap, (k, 3), in unit space."""
    base, apex, height = rows[:, SHAPE].T
    slope = 0.5 * (apex - base) / height
    rho = np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2)  # rounded alike everywhere
    mantle = np.column_stack([local[:, :2] / np.where(rho > 0.0, rho, 1.0)[:, None], -slope])
    # At a tip all directions of the mantle meet; outward they have the axis in common.
    is_tip = ~mantle.any(axis=1)
    mantle[is_tip, 2] = 1.0
    steepness = np.linalg.norm(moved_by(matrices.transpose(0, 2, 1), mantle), axis=1)
    off_mantle = np.abs(rho - 0.5 * (base + apex) - slope * local[:, 2]) / steepness
    off_cap = np.abs(np.abs(local[:, 2]) - height) * _thickness(matrices)[:, 2]
    is_high = local[:, 2] > 0.0
    has_cap = (rows[:, CAPPED, 0] != 0.0) & (np.where(is_high, apex, base) > 0.0)
    is_cap = has_cap & (off_cap < off_mantle)
    caps = np.zeros_like(local)
    caps[:, 2] = np.where(is_high, 1.0, -1.0)
    return np.where(is_cap[:, None], caps, mantle)


def _thickness(matrices: np.ndarray) -> np.ndarray:
    """Return how far apart in the scene planes are that are 1 apart in unit space, (k, 3)."""
    return 1.0 / np.linalg.norm(matrices, axis=2)


GRADIENTS = {SPHERE: _of_sphere, CONE: _of_cone, BOX: _of_box}
"""The gradient in unit space, (k, 3), of kinds where it differs from point to point."""
