"""Shapes of items, as points: what planes divide that bound the cells of BSP trees, or ray pencils.

- Of what is flat, a triangle or a polygon, it is a convex polygon, and planes cut it. A polygon
  with hollow corners stands for its convex hull in its plane.
- What has an inside, moves, or is an instance has a hull (:func:`.geometry.hulls_of`), whose points
  planes only send to one side or to both. So a cell may list such an item although only two planes
  together keep it out; none that reaches into the cell is missing.
- The corners of a polygon may lie off its plane by a little (:mod:`.solids.making`).
  Where that is not small beside the shell, cuts of it would lose what bulges out: it is not cut.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..ranges import ranges
from .geometry import hulls_of
from .solids.mixed import MOVING_TRIANGLE, NORMAL, POLYGON, TRIANGLE, Mixed
from .triangle import areas_of
from .triangles import Triangles

FLAT = 1.0 / 16
"""How far off its plane a polygon may be to be cut, in shells."""


class Shapes(NamedTuple):
    """The shapes of all items.

    Attributes
    ----------
    points : (m, 3) float64
    start, size : (n,) int64
        Item i has ``points[start[i]:start[i] + size[i]]``.
    is_cut : (n,) bool
        Whether these go once around a convex polygon, which planes cut.
    is_own : (n,) bool
        Of what is cut, whether its polygon is the item itself, not a hull of hollow corners.
    is_moving : (n,) bool
        Whether half of its points are the corners at time 0, the others those at time 1.
    facets : (n, 3, 3) float64
        A triangle of each, the largest of its hull: its plane, and those through its edges, are
        tried as planes of the tree.
    """

    points: np.ndarray
    start: np.ndarray
    size: np.ndarray
    is_cut: np.ndarray
    is_own: np.ndarray
    is_moving: np.ndarray
    facets: np.ndarray


def shapes_of(geometry: Any, shell: float) -> Shapes:
    """Return the shapes of the items of any geometry."""
    count = len(geometry.ids)
    if isinstance(geometry, Triangles):
        start, size = 3 * np.arange(count), np.full(count, 3)
        points, all_are = geometry.corners.reshape(-1, 3), np.ones(count, np.bool_)
        return Shapes(points, start, size, all_are, all_are, ~all_are, geometry.corners)
    hulls, offsets = hulls_of(geometry)
    start, size = 3 * offsets[:-1], 3 * np.diff(offsets)
    # The last of equals would depend on the sort: the first of each item's largest.
    largest = np.lexsort((-areas_of(hulls), np.repeat(np.arange(count), np.diff(offsets))))
    facets = hulls[largest[offsets[:-1]]]
    points, is_cut = hulls.reshape(-1, 3).copy(), np.zeros(count, np.bool_)
    is_own, is_moving = is_cut.copy(), is_cut.copy()
    if isinstance(geometry, Mixed):
        is_cut, is_moving = geometry.kinds == TRIANGLE, geometry.kinds == MOVING_TRIANGLE
        is_own = is_cut.copy()
        for i in np.flatnonzero((geometry.kinds == POLYGON) & (geometry.size > 0)):
            loop = geometry.points[geometry.first[i] :][: geometry.size[i]]
            normal = geometry.rows[i, NORMAL]
            if np.ptp((loop - loop[0]) @ normal) > FLAT * shell:
                continue
            around = loop[convex_loop(np.delete(loop, np.abs(normal).argmax(), axis=1))]
            # The triangles of its hull have three corners for each but two, which is room enough.
            points[start[i] : start[i] + len(around)] = around
            size[i], is_cut[i], is_own[i] = len(around), True, len(around) == len(loop)
    return Shapes(points, start, size, is_cut, is_own, is_moving, facets)


def convex_loop(points: np.ndarray) -> list[int]:
    """Return which of some points, (n, 2), go counter-clockwise around all of them.

    A. M. Andrew: Another Efficient Algorithm for Convex Hulls in Two Dimensions, IPL 1979.
    """
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()
    x, y = points.T.tolist()
    loop: list[int] = []
    for half in (order, order[::-1]):
        begin = len(loop)
        for i in half:
            while len(loop) - begin > 1:
                a, b = loop[-2], loop[-1]
                if (x[b] - x[a]) * (y[i] - y[a]) > (y[b] - y[a]) * (x[i] - x[a]):
                    break
                loop.pop()
            loop.append(i)
        loop.pop()  # it is the first of the other half
    return loop


def areas_and_lengths(shapes: Shapes) -> tuple[np.ndarray, np.ndarray]:
    """Return the areas of the polygons and the lengths of their borders, (n,) each.

    Those of what is no polygon mean nothing.
    """
    begins = np.cumsum(shapes.size) - shapes.size
    points = shapes.points[ranges(shapes.start, shapes.size)]
    following = np.arange(1, len(points) + 1)
    following[begins + shapes.size - 1] = begins
    seen = points - np.repeat(points[begins], shapes.size, axis=0)
    # In units of its own size: squares of products of lengths leave the range of numbers.
    unit = np.maximum.reduceat(np.abs(seen).max(axis=1), begins)
    seen /= np.repeat(np.where(unit > 0.0, unit, 1.0), shapes.size)[:, None]
    areas = 0.5 * np.linalg.norm(np.add.reduceat(np.cross(seen, seen[following]), begins), axis=1)
    lengths = np.add.reduceat(np.linalg.norm(seen[following] - seen, axis=1), begins)
    return areas * unit * unit, lengths * unit
