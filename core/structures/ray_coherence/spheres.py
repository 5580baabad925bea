"""Spheres around items and lights, and a tree of them in which those that a cell sees are found.

The condition (:mod:`.condition`) is asked of all pairs of spheres. Not one by one: what a sphere
does not see of a larger one, it does not see of those within. So the spheres of all items are put
into a tree, halved at the median again and again along the axis in which the centres of a part
extend farthest, and whatever lies in a part that is not seen is not asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...geometry.fit import fit_all
from ...geometry.geometry import boxes_around, hulls_of
from ...geometry.solids.mixed import POLYGON, SPHERE, Mixed
from ...geometry.triangles import Triangles
from ...progress import Progress
from ...scene import SUN, Light

NONE = -1

ROUNDED = 1.0 + 8 * np.finfo(np.float64).eps
"""By how much radii are larger that were computed, for rounding."""


class Tree(NamedTuple):
    """A complete binary tree of spheres: node k has the children 2 k and 2 k + 1, the root is 1.

    Attributes
    ----------
    balls : (2 m, 4) float64
        Centre and radius; the radius is NaN where there is nothing.
    largest : (2 m,) float64
        The largest radius of an item below.
    items : (m,) int32
        Which item each of the m leaves is; NONE for nothing.
    """

    balls: np.ndarray
    largest: np.ndarray
    items: np.ndarray


def balls_of(geometry: Any, progress: Progress) -> np.ndarray:
    """Return a sphere around each item, (n, 4): centre and radius.

    The smallest around the corners of its hull, or the one around its box where that is smaller. A
    ball is its own.
    """
    if isinstance(geometry, Triangles):
        return balls_of_triangles(geometry.corners)
    boxes = boxes_around(geometry)
    centres, half = 0.5 * (boxes[:, :3] + boxes[:, 3:]), 0.5 * (boxes[:, 3:] - boxes[:, :3])
    balls = np.column_stack([centres, np.linalg.norm(half, axis=1) * ROUNDED])
    corners, offsets = hulls_of(geometry)
    fitted = fit_all("smallest_sphere", corners, offsets[:-1], offsets[1:], progress).rows
    is_smaller = fitted[:, 3] < balls[:, 3]
    if isinstance(geometry, Mixed):
        # The corners of a polygon may lie off its plane; its box has room for that.
        is_smaller &= geometry.kinds != POLYGON
        for i in np.flatnonzero(geometry.kinds == SPHERE):
            half_axes = geometry.points[geometry.first[i] : geometry.first[i] + 3]
            balls[i, 3] = min(balls[i, 3], np.linalg.norm(half_axes, 2) * (1.0 + 1e-12))
            is_smaller[i] = False
    balls[is_smaller] = fitted[is_smaller]
    return balls


def balls_of_triangles(corners: np.ndarray) -> np.ndarray:
    """Return the smallest spheres around triangles, (n, 3, 3), as (n, 4).

    If one of the angles is a right one or more, it is around the longest edge; else through all
    three corners.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    squares = (edges * edges).sum(axis=2)
    longest = squares.argmax(axis=1)
    row = np.arange(len(corners))
    centres = corners[row, longest] + 0.5 * edges[row, longest]
    is_acute = 2.0 * squares.max(axis=1) < squares.sum(axis=1)
    # Barycentric coordinates of the centre: of a corner, the square of the edge that is opposite
    # times what those of both others are more than that.
    opposite = np.roll(squares, -1, axis=1)[is_acute]
    opposite /= opposite.max(axis=1, keepdims=True)
    weights = opposite * (opposite.sum(axis=1, keepdims=True) - 2.0 * opposite)
    weights /= weights.sum(axis=1, keepdims=True)
    centres[is_acute] = (weights[:, :, None] * corners[is_acute]).sum(axis=1)
    away = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    return np.column_stack([centres, away * ROUNDED])


def balls_of_lights(lights: Sequence[Light]) -> np.ndarray:
    """Return a sphere around each light, (n, 4): a point, but for one with an area.

    A sun has no place, and so no sphere: its radius is NaN.
    """
    balls = np.zeros((len(lights), 4))
    for row, light in zip(balls, lights, strict=True):
        row[:3] = light.position
        if light.kind == SUN:
            row[3] = np.nan
        elif light.half_axes is not None:
            u, v = np.asarray(light.half_axes, float)
            row[3] = max(np.linalg.norm(u + v), np.linalg.norm(u - v)) * ROUNDED
    return balls


def tree_of(balls: np.ndarray, progress: Progress) -> Tree:
    """Return the tree of some spheres, (n, 4).

    Raises
    ------
    Cancelled
        From `progress`.
    """
    count = len(balls)
    levels = (count - 1).bit_length()
    order = np.arange(count)
    for level in range(levels):
        progress.report(level, levels, "Sorting spheres")
        parts = 1 << level
        begins = count * np.arange(parts + 1) // parts
        part = np.repeat(np.arange(parts), np.diff(begins))
        centres = balls[order, :3]
        extent = np.maximum.reduceat(centres, begins[:-1])
        extent -= np.minimum.reduceat(centres, begins[:-1])
        along = centres[np.arange(count), extent.argmax(axis=1)[part]]
        order = order[np.lexsort((along, part))]
    n_leaves = 1 << levels
    begins = count * np.arange(n_leaves + 1) // n_leaves
    items = np.where(np.diff(begins) > 0, order[np.minimum(begins[:-1], count - 1)], NONE)
    rows = np.full((2 * n_leaves, 4), np.nan)
    rows[n_leaves:][items >= 0] = balls[items[items >= 0]]
    largest = rows[:, 3].copy()
    for level in reversed(range(levels)):
        nodes = np.arange(1 << level, 2 << level)
        rows[nodes] = around_both(rows[2 * nodes], rows[2 * nodes + 1])
        largest[nodes] = np.fmax(largest[2 * nodes], largest[2 * nodes + 1])
    return Tree(rows, largest, items.astype(np.int32))


def around_both(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the smallest spheres around two each, (n, 4); around one if the other is nothing."""
    way = second[:, :3] - first[:, :3]
    distance = np.linalg.norm(way, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        radius = 0.5 * (distance + first[:, 3] + second[:, 3]) * ROUNDED
        share = np.maximum(radius - first[:, 3], 0.0) / distance
        both = np.column_stack([first[:, :3] + share[:, None] * way, radius])
        has_second = (distance + second[:, 3] <= first[:, 3]) | np.isnan(second[:, 3])
        has_first = (distance + first[:, 3] <= second[:, 3]) | np.isnan(first[:, 3])
    both[has_second] = first[has_second]
    both[has_first & ~has_second] = second[has_first & ~has_second]
    return both
