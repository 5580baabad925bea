"""From descriptions of items to the arrays of :class:`.mixed.Mixed`.

Every kind has a function that does all its items at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from ..geometry import in_order, joined
from ..triangles import reach_of

# Imported for what they register: triangles around items, normals, lines to draw.
from . import hulls as hulls
from . import lines as lines
from . import normals as normals
from .description import Item, MovingTriangle, Placed, Polygon, Triangle
from .frames import DEPENDENT, FRAMES, place
from .mixed import MOVING_TRIANGLE, NORMAL, POLYGON, TRIANGLE, Mixed
from .reading import LARGEST, Part

PLANAR = 1e-6
"""How far corners of a polygon may lie from its plane, relative to its size."""


def mixed_of(items: Sequence[Item]) -> Mixed:
    """Return described items for kernels.

    Raises
    ------
    InputError
        If an item is not one: a number is not finite, a radius or a size is negative, an axis is
        zero, a polygon has fewer than three corners or is not planar.
    """
    if len(items) == 0:
        raise InputError("there are no items; ask for at least one")
    sorted_out: dict[tuple[type, bool], tuple[list[Any], list[int]]] = {}
    for number, item in enumerate(items):
        key = (type(item.solid), True) if isinstance(item, Placed) else (type(item), False)
        if key[0] not in FRAMES and (key[1] or key[0] not in MAKERS):
            kinds = ", ".join(k.__name__ for k in (*FRAMES, *(() if key[1] else MAKERS)))
            what = "a matrix places" if key[1] else "a scene is made of"
            raise InputError(f"item {number} is a {key[0].__name__}; {what} one of {kinds}")
        of_this_kind, places = sorted_out.setdefault(key, ([], []))
        of_this_kind.append(item)
        places.append(number)
    mixed = unwritten(len(items))
    points, n_points = [], 0
    for (kind, is_placed), (chosen, numbers) in sorted_out.items():
        matrices = None
        if is_placed:
            matrices = Part(chosen, numbers).read("the matrix", (3, 4), "matrix")
            chosen = [item.solid for item in chosen]
        part = Part(chosen, numbers)
        if kind in FRAMES:
            more, counts = place(mixed, part, kind, matrices), np.full(len(chosen), 3)
        else:
            more, counts = MAKERS[kind](mixed, part)
        mixed.size[numbers] = counts
        mixed.first[numbers] = n_points + np.cumsum(counts) - counts
        points.append(more)
        n_points += len(more)
        boxes = mixed.boxes[numbers]
        part.refuse(
            ~(np.abs(boxes) < LARGEST).all(axis=1), f"it reaches beyond {LARGEST:g}; scale it"
        )
    return mixed._replace(points=np.concatenate(points), reach=reach_of_boxes(mixed.boxes))


def mixed_of_triangles(corners: np.ndarray) -> Mixed:
    """Return triangles, (n, 3, 3) float64, for kernels: many, and all of them finite."""
    mixed = unwritten(len(corners))
    write_triangles(mixed, np.arange(len(corners)), corners)
    return mixed._replace(points=NO_POINTS, reach=reach_of_boxes(mixed.boxes))


def unwritten(count: int) -> Mixed:
    """Return arrays for some items, to be written."""
    return Mixed(
        np.empty(count, np.uint8), np.zeros((count, 6, 3)), np.zeros(count, np.int32),
        np.zeros(count, np.int32), NO_POINTS, np.empty((count, 6)),
        np.arange(count, dtype=np.int32), np.empty(3),
    )  # fmt: skip


def reach_of_boxes(boxes: np.ndarray) -> np.ndarray:
    """Return the reach, (3,), of items with some boxes; 0 of none."""
    if not len(boxes):
        return np.zeros(3)
    return reach_of(boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0))


def in_turn(parts: Sequence[Mixed], order: np.ndarray) -> Mixed:
    """Return the items of several geometries as those of one scene, in an order of all of them."""
    mixed = in_order(joined(parts[0], parts[1:]), order)
    return mixed._replace(
        ids=np.arange(len(order), dtype=np.int32), reach=reach_of_boxes(mixed.boxes)
    )


# ------------------------------------------------------------------------------- what has corners

Made = tuple[np.ndarray, np.ndarray]
"""Points, (m, 3), and how many of them are each item's, (k,)."""

NO_POINTS = np.empty((0, 3))


def make_triangles(mixed: Mixed, part: Part) -> Made:
    """Write the corners twice; collinear ones drawn together, as with all triangles."""
    corners = part.read("a triangle", (3, 3), "corners")
    write_triangles(mixed, part.numbers, corners)
    return NO_POINTS, np.zeros(len(corners), np.int64)


def write_triangles(mixed: Mixed, numbers: np.ndarray, corners: np.ndarray) -> None:
    """Write triangles, (k, 3, 3), at some places."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    is_flat = (u[:, [1, 2, 0]] * v[:, [2, 0, 1]] == u[:, [2, 0, 1]] * v[:, [1, 2, 0]]).all(axis=1)
    rows = np.where(is_flat[:, None, None], corners[:, :1], corners)
    mixed.kinds[numbers] = TRIANGLE
    mixed.rows[numbers] = np.hstack([rows, rows])
    mixed.boxes[numbers] = np.hstack([corners.min(axis=1), corners.max(axis=1)])


def make_moving_triangles(mixed: Mixed, part: Part) -> Made:
    """Write the corners of both keys."""
    keys = part.read("a moving triangle", (3, 3), "start", "end").reshape(-1, 6, 3)
    mixed.kinds[part.numbers] = MOVING_TRIANGLE
    mixed.rows[part.numbers] = keys
    mixed.boxes[part.numbers] = np.hstack([keys.min(axis=1), keys.max(axis=1)])
    return NO_POINTS, np.zeros(len(keys), np.int64)


def make_polygons(mixed: Mixed, part: Part) -> Made:
    """Write the normals; those of zero area get no corners."""
    corners = []
    for polygon, number in zip(part.items, part.numbers, strict=True):
        try:
            own = np.asarray(polygon.corners, dtype=np.float64)
        except (TypeError, ValueError):
            own = np.empty(0)
        if own.ndim != 2 or own.shape[1] != 3:
            raise InputError(f"item {number}: corners of a polygon must be n x 3 numbers")
        if len(own) < 3:
            raise InputError(f"item {number}: a polygon needs three corners, it has {len(own)}")
        corners.append(own)
    counts = np.array([len(own) for own in corners])
    points = np.concatenate(corners)
    starts = np.cumsum(counts) - counts
    owners = np.repeat(np.arange(len(counts)), counts)
    is_bad = np.zeros(len(counts), bool)
    is_bad[owners[~(np.abs(points) < LARGEST).all(axis=1)]] = True
    part.refuse(is_bad, f"corners must be finite and below {LARGEST:g}; repair or scale it")
    lower, upper = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
    size = (upper - lower).max(axis=1)
    # Newell's normal, of the polygon scaled to size 1: twice the area of its three projections.
    unit = (points - points[starts][owners]) / np.where(size > 0.0, size, 1.0)[owners, None]
    following = np.arange(1, len(points) + 1)
    following[starts + counts - 1] = starts
    normals = np.add.reduceat(np.cross(unit, unit[following]), starts)
    lengths = np.linalg.norm(normals, axis=1)
    has_area = lengths > DEPENDENT * np.sqrt(counts)
    normals /= np.where(has_area, lengths, 1.0)[:, None]
    normals[~has_area] = 0.0
    heights = (unit * normals[owners]).sum(axis=1)
    off = np.maximum.reduceat(heights, starts) - np.minimum.reduceat(heights, starts)
    # The normal of a needle is rounded.
    rounding = DEPENDENT * counts / np.where(has_area, lengths, 1.0)
    part.refuse(
        off > PLANAR + rounding,
        f"corners of a polygon must lie in a plane, within {PLANAR:g} of its size; divide it into "
        "triangles",
    )
    mixed.kinds[part.numbers] = POLYGON
    mixed.rows[part.numbers, NORMAL] = normals
    mixed.boxes[part.numbers] = np.hstack([lower, upper])
    is_kept = has_area[owners]
    # Without corners it is nowhere to be hit; its box says where it would be.
    return points[is_kept], np.where(has_area, counts, 0)


MAKERS: dict[type, Callable[[Mixed, Part], Made]] = {
    Triangle: make_triangles,
    MovingTriangle: make_moving_triangles,
    Polygon: make_polygons,
}
"""What makes the items that have corners, per kind of description."""
