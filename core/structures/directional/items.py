"""Items as they are put into directional cells: boxes, outlines, balls."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...geometry.geometry import boxes_around
from ...geometry.solids.mixed import POLYGON, SPHERE, TRIANGLE, Mixed
from ...geometry.triangles import Triangles
from ...ranges import ranges

ULPS = 256 * np.finfo(np.float64).eps
"""How far off its line a ray may pass, relative to the largest coordinate: a ray to a light passes
it by the roundings of the difference of two points, and a hit lies as far off its item as the slack
of rays allows (:data:`...geometry.rays.ULPS`)."""


class Items(NamedTuple):
    """Items as they are put into cells.

    Attributes
    ----------
    boxes : (n, 6) float64
    first : (n + 1,) int64
        Item i has the outline ``points[first[i]:first[i + 1]]`` if it is flat and convex; others
        have none.
    points : (m, 3) float64
    normals : (n, 3) float64
        Of outlines, twice their area long; 0 of others.
    balls : (n, 4) float64
        Centre and radius of balls that hold the items.
    """

    boxes: np.ndarray
    first: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    balls: np.ndarray


def items_of(geometry: Any) -> Items:
    """Return the items of a geometry, in its order.

    Of what is neither a triangle, a convex polygon nor a sphere only the box is known: of other
    solids, of what moves, of instances. A sphere that a matrix has made an ellipsoid has the ball
    around its box.
    """
    boxes = boxes_around(geometry)
    centres, half = 0.5 * (boxes[:, :3] + boxes[:, 3:]), 0.5 * (boxes[:, 3:] - boxes[:, :3])
    balls = np.column_stack([centres, np.linalg.norm(half, axis=1)])
    count = len(boxes)
    if isinstance(geometry, Triangles):
        points = geometry.corners.reshape(-1, 3)
        first = np.arange(0, 3 * count + 1, 3)
        return Items(boxes, first, points, normals_of(first, points), balls)
    if not isinstance(geometry, Mixed):
        nothing = np.zeros(count + 1, np.int64), np.zeros((0, 3)), np.zeros((count, 3))
        return Items(boxes, *nothing, balls)
    kinds = geometry.kinds
    for i in np.flatnonzero(kinds == SPHERE):
        half_axes = geometry.points[geometry.first[i] : geometry.first[i] + 3]
        products = half_axes @ half_axes.T
        square = products[0, 0]
        if np.abs(products - square * np.eye(3)).max() <= 1e-9 * square:
            balls[i, 3] = half[i].max()  # of the box, which is rounded outward
    is_triangle, is_polygon = kinds == TRIANGLE, kinds == POLYGON
    for i in np.flatnonzero(is_polygon):
        begin = geometry.first[i]
        is_polygon[i] = is_convex_outline(geometry.points[begin : begin + geometry.size[i]])
    sizes = np.select([is_triangle, is_polygon], [3, geometry.size], 0).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(sizes)])
    points = np.empty((int(first[-1]), 3))
    corners = geometry.rows[is_triangle, :3].reshape(-1, 3)
    points[ranges(first[:-1][is_triangle], sizes[is_triangle])] = corners
    corners = geometry.points[ranges(geometry.first[is_polygon], sizes[is_polygon])]
    points[ranges(first[:-1][is_polygon], sizes[is_polygon])] = corners
    return Items(boxes, first, points, normals_of(first, points), balls)


def normals_of(first: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the normals of outlines, twice their area long (Newell); 0 where there is none."""
    sizes = np.diff(first)
    normals = np.zeros((len(sizes), 3))
    if len(points):
        begin = np.repeat(first[:-1], sizes)
        following = np.arange(1, len(points) + 1)
        following[first[1:][sizes > 0] - 1] = first[:-1][sizes > 0]
        corners = points - points[begin]
        terms = np.cross(corners, points[following] - points[begin])
        normals[sizes > 0] = np.add.reduceat(terms, first[:-1][sizes > 0])
    return normals


def is_convex_outline(corners: np.ndarray) -> bool:
    """Say whether a polygon, (k, 3), is flat, turns to one side only, and goes round once."""
    corners = corners - corners.mean(axis=0)
    edges = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(edges, np.roll(edges, -1, axis=0))
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    normal /= np.linalg.norm(normal) or 1.0
    if np.abs(corners @ normal).max() > 1e-9 * np.abs(corners).max():
        return False
    along = turns @ normal
    if not (along >= -1e-12 * np.abs(along).max(initial=0.0)).all():
        return False
    lengths = np.linalg.norm(edges, axis=1) * np.linalg.norm(np.roll(edges, -1, axis=0), axis=1)
    following = (edges * np.roll(edges, -1, axis=0)).sum(axis=1)
    angles = np.arctan2(along, following)[lengths > 0.0]
    return bool(abs(angles.sum() - 2.0 * np.pi) < 1e-6)
