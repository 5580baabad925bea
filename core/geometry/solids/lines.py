"""Lines that show where items of a mixed geometry are, when they are drawn without their faces."""

from __future__ import annotations

import numpy as np

from ...ranges import ranges
from ..box_shape import box_segments
from ..geometry import lines_of
from .mixed import (
    BOX,
    CENTRE,
    CONE,
    DISC,
    MOVING_TRIANGLE,
    POLYGON,
    SHAPE,
    SPHERE,
    TRIANGLE,
    Mixed,
    corners_at,
)

CIRCLE = 24
"""Sides of the polygon that stands for a circle."""

STRAIGHT = 4
"""Lines along the mantle of a cone."""


@lines_of.register
def _(geometry: Mixed, primitives: np.ndarray, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Draw edges and rims; of a ball, three great circles; of a mantle, some straight lines."""
    kinds = geometry.kinds[primitives]
    segments, owners = [np.empty((0, 2, 3))], [np.empty(0, np.int64)]
    for kind in np.unique(kinds):
        here = np.flatnonzero(kinds == kind)
        items = primitives[here]
        if kind in (TRIANGLE, MOVING_TRIANGLE):
            corners = corners_at(geometry.rows[items], np.full(len(items), time))
            segments.append(corners[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2, 3))
            owners.append(np.repeat(here, 3))
        elif kind == POLYGON:
            sizes = geometry.size[items].astype(np.int64)
            places = ranges(geometry.first[items].astype(np.int64), sizes)
            following = places + 1
            is_last = np.cumsum(sizes)[sizes > 0] - 1
            following[is_last] = geometry.first[items][sizes > 0]
            segments.append(geometry.points[np.stack([places, following], axis=1)])
            owners.append(np.repeat(here, sizes))
        else:
            unit = np.repeat(UNIT_LINES[int(kind)][None], len(items), axis=0)
            if kind == CONE:
                radii = geometry.rows[items, SHAPE, :2]
                unit[..., :2] *= radii[:, (UNIT_LINES[CONE][:, :, 2] > 0.0).astype(int)][..., None]
            half_axes = geometry.points[geometry.first[items][:, None] + np.arange(3)]
            placed = np.einsum("nsej,nja->nsea", unit, half_axes)
            placed += geometry.rows[items, CENTRE][:, None, None]
            segments.append(placed.reshape(-1, 2, 3))
            owners.append(np.repeat(here, unit.shape[1]))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(segments)[order], owner[order]


def circle(z: float) -> np.ndarray:
    """Return the unit circle at a height, (CIRCLE, 2, 3)."""
    angles = 2.0 * np.pi * np.arange(CIRCLE) / CIRCLE
    points = np.stack([np.cos(angles), np.sin(angles), np.full(CIRCLE, z)], axis=1)
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def cylinder() -> np.ndarray:
    """Return the lines of a unit cylinder."""
    rims = circle(-1.0), circle(1.0)
    straight = np.stack([rim[:: CIRCLE // STRAIGHT, 0] for rim in rims], axis=1)
    return np.concatenate([*rims, straight])


UNIT_LINES = {
    SPHERE: np.concatenate([np.roll(circle(0.0), axis, axis=2) for axis in range(3)]),
    CONE: cylinder(),
    BOX: box_segments(np.array([[-1.0, -1, -1, 1, 1, 1]])),
    DISC: circle(0.0),
}
"""Segments of what lives in unit space; those of a cone are narrowed at its ends."""
