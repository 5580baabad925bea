"""Solids as triangles: what is drawn of them where only meshes can be.

Corners lie on the surface, so that what is round becomes a little smaller; what rays are tested
with is the solid itself.
"""

from __future__ import annotations

import numpy as np

from ...ranges import ranges
from ..box_shape import SIDES, corners_of
from ..icosphere import icosphere
from ..triangulation import triangulate
from .mixed import (
    BOX,
    CAPPED,
    CENTRE,
    CONE,
    DISC,
    MOVING_TRIANGLE,
    POLYGON,
    SHAPE,
    SPHERE,
    TRIANGLE,
    Mixed,
)

SUBDIVISIONS = 2
"""Of the icosphere that stands for a ball."""

CIRCLE = 16
"""Sides of the polygon that stands for a circle."""


def tessellated(geometry: Mixed) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles on the surface of every item.

    Of a moving triangle they are those at time 0.

    Returns
    -------
    corners : (m, 3, 3) float64
        Item after item; those of solids turn counter-clockwise seen from outside.
    owners : (m,) int64
        The place of each one's item in the geometry.
    """
    parts, owners = [], []
    for kind in np.unique(geometry.kinds):
        which = np.flatnonzero(geometry.kinds == kind)
        if kind in (TRIANGLE, MOVING_TRIANGLE):
            parts.append(geometry.rows[which, :3])
            owners.append(which)
        elif kind == POLYGON:
            sizes = geometry.size[which]
            corners = ranges(geometry.first[which], sizes)
            parts.append(geometry.points[triangulate(geometry.points, corners, sizes)])
            owners.append(np.repeat(which, np.maximum(sizes - 2, 0)))
        elif kind == CONE:
            is_capped = geometry.rows[which, CAPPED, 0] != 0.0
            for chosen, unit in ((which[~is_capped], side()), (which[is_capped], capped())):
                parts.append(_placed(geometry, chosen, _narrowed(geometry, chosen, unit)))
                owners.append(np.repeat(chosen, len(unit)))
        else:
            unit = {SPHERE: icosphere(SUBDIVISIONS), BOX: cube(), DISC: disc(0.0)}[int(kind)]
            parts.append(_placed(geometry, which, unit[None]))
            owners.append(np.repeat(which, len(unit)))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(parts)[order], owner[order]


def _narrowed(geometry: Mixed, which: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Return triangles of unit cylinders with the radii of cones at both ends, (k, t, 3, 3)."""
    radii = geometry.rows[which, SHAPE, :2]
    narrowed = np.repeat(unit[None], len(which), axis=0)
    at_apex = (unit[:, :, 2] > 0.0).astype(np.intp)
    narrowed[..., :2] *= radii[:, at_apex][..., None]
    return narrowed


def _placed(geometry: Mixed, which: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Return triangles of unit solids in the scene, (k t, 3, 3)."""
    half_axes = geometry.points[geometry.first[which][:, None] + np.arange(3)]
    placed = np.einsum(
        "ntcj,nja->ntca", np.broadcast_to(unit, (len(which), *unit.shape[1:])), half_axes
    )
    return (placed + geometry.rows[which, CENTRE][:, None, None]).reshape(-1, 3, 3)


def circle(z: float) -> np.ndarray:
    """Return the corners of a regular polygon in the unit circle, (CIRCLE, 3) float64."""
    angles = 2.0 * np.pi * np.arange(CIRCLE) / CIRCLE
    return np.stack([np.cos(angles), np.sin(angles), np.full(CIRCLE, z)], axis=1)


def disc(z: float) -> np.ndarray:
    """Return the triangles of a unit disc, (CIRCLE - 2, 3, 3); from above, counter-clockwise."""
    rim = circle(z)
    first = np.broadcast_to(rim[0], (CIRCLE - 2, 3))
    return np.stack([first, rim[1:-1], rim[2:]], axis=1)


def side() -> np.ndarray:
    """Return the triangles of the side of a unit cylinder, (2 CIRCLE, 3, 3)."""
    low, high = circle(-1.0), circle(1.0)
    next_low, next_high = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    return np.concatenate(
        [np.stack([low, next_low, high], axis=1), np.stack([next_high, high, next_low], axis=1)]
    )


def capped() -> np.ndarray:
    """Return the triangles of a unit cylinder with both of its ends."""
    return np.concatenate([side(), disc(1.0), disc(-1.0)[:, ::-1]])


def cube() -> np.ndarray:
    """Return the triangles, (12, 3, 3), of the cube of half-width 1."""
    sides = corners_of(np.array([[-1.0, -1, -1, 1, 1, 1]]))[0][SIDES]
    triangles = np.concatenate([sides[:, [0, 1, 2]], sides[:, [2, 3, 0]]])
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    is_turned = (normals * triangles[:, 0]).sum(axis=1) < 0.0
    triangles[is_turned] = triangles[is_turned, ::-1]
    return triangles
