"""Triangles around items of a mixed geometry: what bounding volumes are fitted to.

Volumes hold corners of triangles. What is round has none; so it gets a polyhedron around it, and
whatever volume holds that one holds the item.
"""

from __future__ import annotations

import numpy as np

from ..box_shape import SIDES, corners_of
from ..geometry import hulls_of
from .mixed import BOX, CENTRE, CONE, DISC, MOVING_TRIANGLE, POLYGON, SHAPE, SPHERE, TRIANGLE, Mixed

CIRCLE = 12
"""Sides of the polygon around a circle."""

OUTSIDE = 1.0 + 32 * np.finfo(np.float64).eps
"""By how much hulls are larger than their items, for rounding."""


@hulls_of.register
def _(geometry: Mixed) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles around every item.

    Those of polygons, boxes and triangles are exact. A circle has a polygon of CIRCLE sides around
    it, at most 4% wider; a ball the polyhedron whose sides have the 26 directions of k-DOPs, at
    most 13%, none along an axis.
    """
    sizes = np.empty(len(geometry.kinds), np.int64)
    for kind, triangles in UNIT_HULLS.items():
        sizes[geometry.kinds == kind] = len(triangles)
    is_polygon = geometry.kinds == POLYGON
    sizes[geometry.kinds == TRIANGLE] = 1
    sizes[geometry.kinds == MOVING_TRIANGLE] = 2
    sizes[is_polygon] = np.maximum(geometry.size[is_polygon] - 2, 1)
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    corners = np.empty((int(offsets[-1]), 3, 3))
    for kind in (TRIANGLE, MOVING_TRIANGLE):
        which = np.flatnonzero(geometry.kinds == kind)
        keys = geometry.rows[which].reshape(-1, 2, 3, 3)[:, : 1 + kind]
        corners[offsets[which][:, None] + np.arange(1 + kind)] = keys
    for kind, triangles in UNIT_HULLS.items():
        which = np.flatnonzero(geometry.kinds == kind)
        unit = np.broadcast_to(triangles, (len(which), *triangles.shape)).copy()
        if kind == CONE:
            radii = geometry.rows[which, SHAPE, :2]
            is_apex = triangles[:, :, 2] > 0.0
            unit[..., :2] *= np.where(is_apex, radii[:, 1, None, None], radii[:, 0, None, None])[
                ..., None
            ]
        half_axes = geometry.points[geometry.first[which][:, None] + np.arange(3)]
        hulls = np.einsum("ntcj,nja->ntca", unit * OUTSIDE, half_axes)
        hulls += geometry.rows[which, CENTRE][:, None, None]
        corners[offsets[which][:, None] + np.arange(len(triangles))] = hulls
    for index in np.flatnonzero(is_polygon):
        own = geometry.points[geometry.first[index] :][: geometry.size[index]]
        if len(own) == 0:  # of zero area: its box, by two corners of it
            box = geometry.boxes[index].reshape(2, 3)
            own = box[[0, 1, 1]]
        fan = np.stack([np.broadcast_to(own[0], (len(own) - 2, 3)), own[1:-1], own[2:]], axis=1)
        corners[offsets[index] : offsets[index + 1]] = fan
    return corners, offsets


def around_ball() -> np.ndarray:
    """Return triangles, (16, 3, 3), with the corners of the polyhedron around the unit sphere.

    It has a hexagon in every octant, here with the two triangles of every other corner.
    """
    corner = np.array([1.0, 2.0**0.5 - 1.0, 3.0**0.5 - 2.0**0.5])
    hexagon = np.stack([corner[[[0, 1, 2], [1, 2, 0], [2, 0, 1]]],
                        corner[[[0, 2, 1], [2, 1, 0], [1, 0, 2]]]])  # fmt: skip
    signs = 2.0 * corners_of(np.array([[0.0, 0, 0, 1, 1, 1]]))[0] - 1.0
    return (signs[:, None, None] * hexagon).reshape(-1, 3, 3)


def around_circle() -> np.ndarray:
    """Return the corners, (CIRCLE, 2), of a polygon around the unit circle, with sides across x."""
    angles = 2.0 * np.pi * (np.arange(CIRCLE) + 0.5) / CIRCLE
    return np.stack([np.cos(angles), np.sin(angles)], axis=1) / np.cos(np.pi / CIRCLE)


def around_cylinder() -> np.ndarray:
    """Return triangles, (2 CIRCLE, 3, 3), around the side of the unit cylinder."""
    circle = around_circle()
    base = np.column_stack([circle, np.full(CIRCLE, -1.0)])
    apex = np.column_stack([circle, np.full(CIRCLE, 1.0)])
    beside = np.roll(np.arange(CIRCLE), -1)
    return np.concatenate(
        [
            np.stack([base, base[beside], apex], axis=1),
            np.stack([apex[beside], apex, base[beside]], axis=1),
        ]
    )


def around_disc() -> np.ndarray:
    """Return triangles, (CIRCLE - 2, 3, 3), around the unit disc."""
    circle = np.column_stack([around_circle(), np.zeros(CIRCLE)])
    first = np.broadcast_to(circle[0], (CIRCLE - 2, 3))
    return np.stack([first, circle[1:-1], circle[2:]], axis=1)


def around_cube() -> np.ndarray:
    """Return the triangles, (12, 3, 3), of the cube of half-width 1."""
    sides = corners_of(np.array([[-1.0, -1, -1, 1, 1, 1]]))[0][SIDES]
    return np.concatenate([sides[:, [0, 1, 2]], sides[:, [2, 3, 0]]])


UNIT_HULLS = {
    SPHERE: around_ball(), CONE: around_cylinder(), DISC: around_disc(), BOX: around_cube(),
}  # fmt: skip
"""Triangles around unit solids; those of a cone are narrowed at its ends."""
