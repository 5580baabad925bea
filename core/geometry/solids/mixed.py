"""Elementary solids of every kind in one geometry: its arrays.

One geometry that branches by kind, and not one for every kind: each would be compiled into every
walk anew. An item has eighteen numbers, `rows`, which its kind reads in its own way:

- A triangle has its corners twice, a moving triangle those of both keys.
- A sphere, cone, box or disc has the matrix into unit space (see :mod:`.unit_space`), its centre
  and its widths there. The three *half-axes*, columns of the matrix out of unit space,
  lie in `points`.
- A polygon has the normal of its plane; its corners lie in `points`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..geometry import boxes_around, in_order, joined

TRIANGLE, MOVING_TRIANGLE, POLYGON, SPHERE, CONE, BOX, DISC = range(7)
"""Kinds of items; from SPHERE on they live in unit space."""

MATRIX, CENTRE, SHAPE, CAPPED = 0, 3, 4, 5
"""Rows of the numbers of what lives in unit space: three of the matrix; the point that becomes the
origin; half-widths there, or the radii of a cone and its half-height; first of the last row,
whether a cone is capped."""

NORMAL = 0
"""The row of a polygon's numbers that has the unit normal of its plane."""


class Mixed(NamedTuple):
    """Items of all kinds, in any order.

    Attributes
    ----------
    kinds : (n,) uint8
    rows : (n, 6, 3) float64
    first, size : (n,) int32
        Which of the points are the item's.
    points : (m, 3) float64
        Corners of polygons, half-axes of what lives in unit space.
    boxes : (n, 6) float64
        The box of each item, rounded outward; of one that moves, at any time.
    ids : (n,) int32
        Index of each in the scene; decides ties.
    reach : (3,) float64
        As that of triangles.
    """

    kinds: np.ndarray
    rows: np.ndarray
    first: np.ndarray
    size: np.ndarray
    points: np.ndarray
    boxes: np.ndarray
    ids: np.ndarray
    reach: np.ndarray


@in_order.register
def _(geometry: Mixed, order: np.ndarray) -> Mixed:
    return Mixed(
        geometry.kinds[order], geometry.rows[order], geometry.first[order], geometry.size[order],
        geometry.points, geometry.boxes[order], geometry.ids[order], geometry.reach,
    )  # fmt: skip


@joined.register
def _(first: Mixed, others: Sequence[Mixed]) -> Mixed:
    parts = [first, *others]
    n_points = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    places = [part.first + n for part, n in zip(parts, n_points.astype(np.int32), strict=True)]
    return Mixed(
        np.concatenate([part.kinds for part in parts]),
        np.concatenate([part.rows for part in parts]),
        np.concatenate(places),
        np.concatenate([part.size for part in parts]),
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.boxes for part in parts]),
        np.concatenate([part.ids for part in parts]),
        np.maximum.reduce([part.reach for part in parts]),
    )


@boxes_around.register
def _(geometry: Mixed) -> np.ndarray:
    return geometry.boxes.copy()  # builders sort them in place


def can_be_clipped(geometry: Mixed) -> np.ndarray:
    """Say of each item whether clipping is of use for it, (n,) bool.

    What moves has been nearly everywhere in its box.
    """
    return geometry.kinds != MOVING_TRIANGLE


def corners_at(keys: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the corners, (n, 3, 3), of moving triangles, (n, 6, 3), each at a time of its own."""
    start, end, time = keys[:, :3], keys[:, 3:], times[:, None, None]
    return np.where(time == 1.0, end, start + time * (end - start))
