"""Axis-aligned bounding box (AABB), stored as six numbers ``[x0, y0, z0, x1, y1, z1]``.

The ray test is the slab test: the box is the intersection of three strips, and the ray is inside
it where it is inside all three (lecture: "intersection of strips").
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..kernels import call, implements, inlined, inner, kernel
from ..parallel import Team
from ..progress import SILENT, Progress
from .box_shape import corners_of, surface_area
from .half_spaces import every_other
from .polygons import Polygons, sides_of
from .volume import MISS, fit, outside, prepare, span


@inlined
def span_box(boxes, index, ray, limit):
    """Return the t at which the ray enters a box, at least t_min, and leaves it, at most `limit`.

    A ray that misses enters after it leaves. Each slab is crossed from `low` to `high` or the other
    way round. Where the ray lies in a slab's plane, 0 * inf is NaN: it is passed on by ``b if b < a
    else a`` and then ignored, so that this plane is no restriction.
    """
    enter, leave = ray.t_min, limit
    low = (boxes[index, 0] - ray.low_x) * ray.ix
    high = (boxes[index, 3] - ray.high_x) * ray.ix
    t = high if high < low else low
    enter = t if t > enter else enter
    t = low if high < low else high
    leave = t if t < leave else leave
    low = (boxes[index, 1] - ray.low_y) * ray.iy
    high = (boxes[index, 4] - ray.high_y) * ray.iy
    t = high if high < low else low
    enter = t if t > enter else enter
    t = low if high < low else high
    leave = t if t < leave else leave
    low = (boxes[index, 2] - ray.low_z) * ray.iz
    high = (boxes[index, 5] - ray.high_z) * ray.iz
    t = high if high < low else low
    enter = t if t > enter else enter
    t = low if high < low else high
    leave = t if t < leave else leave
    return enter, leave


@inlined
def enter_box(boxes, index, ray, limit):
    """Return the t at which the ray enters a box, or MISS if it does not by t = `limit`.

    A ray that starts inside enters at 0.
    """
    enter, leave = span_box(boxes, index, ray, limit)
    return enter if enter <= leave else MISS


@inner
def area_of(box):
    """Return the surface area of a box, (6,), in kernels."""
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return 2.0 * (x * y + y * z + z * x)


@inner
def clear(box):
    """Make a box, (6,), contain nothing."""
    for side in range(3):
        box[side], box[3 + side] = np.inf, -np.inf


@inner
def include(box, other):
    """Enlarge a box so that it contains another one, (6,) each."""
    for side in range(3):
        low, high = other[side], other[3 + side]
        box[side] = low if low < box[side] else box[side]
        box[3 + side] = high if high > box[3 + side] else box[3 + side]


NOTHING = (np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf)
"""The box that contains nothing."""


@inlined
def box_at(boxes, i):
    """Return a row of boxes, (n, 6), as six numbers, which a loop can keep out of memory."""
    return boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3], boxes[i, 4], boxes[i, 5]


@inlined
def put_box(boxes, i, box):
    """Write a box into a row of boxes, (n, 6)."""
    boxes[i, 0], boxes[i, 1], boxes[i, 2] = box[0], box[1], box[2]
    boxes[i, 3], boxes[i, 4], boxes[i, 5] = box[3], box[4], box[5]


@inlined
def around(a, b):
    """Return the box around two boxes of six numbers each."""
    return (
        b[0] if b[0] < a[0] else a[0],
        b[1] if b[1] < a[1] else a[1],
        b[2] if b[2] < a[2] else a[2],
        b[3] if b[3] > a[3] else a[3],
        b[4] if b[4] > a[4] else a[4],
        b[5] if b[5] > a[5] else a[5],
    )


@inner
def boxes_overlap(a, b):
    """Say whether two boxes, (6,) each, have a common point."""
    x = a[0] <= b[3] and b[0] <= a[3]
    y = a[1] <= b[4] and b[1] <= a[4]
    return x and y and a[2] <= b[5] and b[2] <= a[5]


@inner
def union_area(a, b):
    """Return the surface area of the box around two boxes, (6,) each; for kernels."""
    x = (a[3] if a[3] > b[3] else b[3]) - (a[0] if a[0] < b[0] else b[0])
    y = (a[4] if a[4] > b[4] else b[4]) - (a[1] if a[1] < b[1] else b[1])
    z = (a[5] if a[5] > b[5] else b[5]) - (a[2] if a[2] < b[2] else b[2])
    return 2.0 * (x * y + y * z + z * x)


def boxes_of(triangles: np.ndarray) -> np.ndarray:
    """Return the boxes of triangles.

    Parameters
    ----------
    triangles : (n, 3, 3) float64

    Returns
    -------
    (n, 6) float64
    """
    boxes = np.empty((len(triangles), 6))
    with Team(SILENT, "Boxes") as team:
        team.run(lambda first, last: call(fit_each, triangles, boxes, first, last), len(boxes))
    return boxes


@kernel
def fit_each(triangles, boxes, first, last):
    """Write the boxes of the triangles ``first <= i < last``."""
    for i in range(first, last):
        for axis in range(3):
            a, b, c = triangles[i, 0, axis], triangles[i, 1, axis], triangles[i, 2, axis]
            low, high = (b, a) if b < a else (a, b)
            boxes[i, axis] = c if c < low else low
            boxes[i, 3 + axis] = c if c > high else high


# -------------------------------------------------------------------------- as a bounding volume


class Boxes(NamedTuple):
    """Axis-aligned boxes as bounding volumes.

    Attributes
    ----------
    rows : (n, 6) float64, or float32 where nothing is lost
    """

    rows: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, items: Any) -> Boxes:
        """Return boxes around some items: as float32 where those of the items are instances' own.

        Unions of such are numbers of float32, too, so that nothing is lost; a tree over instances
        takes half the memory. Of what else there is, a walk is compiled once, for float64.
        """
        if getattr(items, "boxes", rows).dtype == np.float32:
            single = rows.astype(np.float32)
            if (single == rows).all():
                return cls(single)
        return cls(rows)

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas, (n,)."""
        return surface_area(self.boxes())

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,)."""
        rows = self.boxes()
        return (rows[:, 3:] - rows[:, :3]).prod(axis=1)

    def boxes(self) -> np.ndarray:
        """Return the axis-aligned boxes around them, (n, 6)."""
        return self.rows.astype(np.float64, copy=False)

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the six sides of some boxes; the owner of a side is its place in `numbers`."""
        return sides_of(corners_of(self.boxes()[numbers]))

    def half_spaces(self, numbers: np.ndarray) -> np.ndarray:
        """Return some boxes as half-spaces ``n . p <= h``: (k, 6, 4), each [nx, ny, nz, h]."""
        rows = self.rows[numbers]
        planes = np.zeros((len(rows), 6, 4))
        planes[:, :3, :3], planes[:, 3:, :3] = -np.eye(3), np.eye(3)
        planes[:, :3, 3], planes[:, 3:, 3] = -rows[:, :3], rows[:, 3:]
        return planes

    def contain(self, parents: np.ndarray, children: np.ndarray) -> np.ndarray:
        """Say of pairs whether the one contains the other, (k,) bool."""
        a, b = self.rows[parents], self.rows[children]
        return (a[:, :3] <= b[:, :3]).all(1) & (a[:, 3:] >= b[:, 3:]).all(1)

    def neighbours(self) -> np.ndarray:
        """Return the half-spaces that may cut each face, (6, 5) int64."""
        return every_other(6)


@implements(fit, Boxes)
def fit_box(volumes, index, corners, first, last):
    """Take the minimum and maximum of every coordinate."""
    row = volumes.rows[index]
    for axis in range(3):
        low, high = corners[first, 0, axis], corners[first, 0, axis]
        for i in range(first, last):
            for k in range(3):
                x = corners[i, k, axis]
                low = x if x < low else low
                high = x if x > high else high
        row[axis], row[3 + axis] = low, high


@implements(outside, Boxes)
def outside_box(volumes, index, x, y, z):
    """Take the farthest of the six sides."""
    row = volumes.rows[index]
    return max(row[0] - x, x - row[3], row[1] - y, y - row[4], row[2] - z, z - row[5])


@implements(prepare, Boxes)
def prepare_box(volumes, ray, strips):
    """Do nothing: the ray has it all."""


@implements(span, Boxes, inline=True)
def span_boxes(volumes, index, ray, strips, limit):
    """Test the three slabs."""
    return span_box(volumes.rows, index, ray, limit)
