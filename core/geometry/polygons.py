"""Lists of convex polygons: what is drawn of cells and volumes that are not boxes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..ranges import ranges
from .box_shape import SIDES


class Polygons(NamedTuple):
    """Convex polygons in lists.

    Attributes
    ----------
    points : (m, 3) float64
        Corners, polygon after polygon, each once around.
    offsets : (k + 1,) int64
        Polygon i has ``points[offsets[i]:offsets[i + 1]]``.
    owners : (k,) int64
        Whose polygon it is, ascending: the place of a cell in :class:`.cells.Cells`, or of a volume
        among those asked for.
    """

    points: np.ndarray
    offsets: np.ndarray
    owners: np.ndarray


def of_equal_size(corners: np.ndarray, owners: np.ndarray) -> Polygons:
    """Return polygons with as many corners each, (k, c, 3), whose owners (k,) ascend."""
    offsets = corners.shape[1] * np.arange(len(corners) + 1, dtype=np.int64)
    return Polygons(corners.reshape(-1, 3), offsets, owners)


def sides_of(corners: np.ndarray) -> Polygons:
    """Return the sides of boxes given by their corners, (n, 8, 3), in the order of UNIT_CORNERS."""
    sides = corners[:, SIDES].reshape(-1, 4, 3)
    return of_equal_size(sides, np.repeat(np.arange(len(corners)), 6))


def merged(first: Polygons, second: Polygons) -> Polygons:
    """Return the polygons of two lists as one, those of an owner together."""
    owners = np.concatenate([first.owners, second.owners])
    sizes = np.concatenate([np.diff(first.offsets), np.diff(second.offsets)])
    begins = np.concatenate([first.offsets[:-1], len(first.points) + second.offsets[:-1]])
    points = np.concatenate([first.points, second.points])
    order = np.argsort(owners, kind="stable")
    sizes = sizes[order]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    return Polygons(points[ranges(begins[order], sizes)], offsets, owners[order])
