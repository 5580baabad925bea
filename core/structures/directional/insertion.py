"""Insertion: through which cells of a face an item may be seen.

Asked is whether a cell, a square in u and v, and an item have a direction in common. No answer may
be wrong in one way: a cell that is left out must not see the item. So what is known of the item is
larger than it is, by what rays pass off their lines (:data:`.items.ULPS`) and what is rounded:

- ``cone``: the cone around its ball, against the cone around the cell: two angles are compared.
- ``box``: the rectangle in u and v around its box, clipped to what the face sees.
- ``exact``: the outline of a flat item, clipped and projected, against the cell: no edge of either
  parts them (separating axes). Of other items, rectangle and cone.

A cell that lies inside the projection of one convex item is *covered*: nothing behind is seen
through it (lecture: "some cells might be covered completely by one object").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inner
from .faces import out_of_face
from .lists import step_along
from .projection import (
    ANGLE,
    BALL,
    EVERYWHERE,
    HEIGHT,
    MARGIN_OF,
    NX,
    NY,
    NZ,
    OUTLINE,
    U0,
    U1,
    V0,
    V1,
    Footprints,
    Insertion,
    X,
    Y,
    Z,
)


class View(NamedTuple):
    """A face and what is seen through it, as kernels know them that go through its cells.

    Attributes
    ----------
    footprints : Footprints
    back : (3, 3) float64
    w : (3,) float64
    is_parallel : bool
        Of :class:`.faces.Faces`.
    slack : float
    covers : bool
        Of the insertion.
    """

    footprints: Footprints
    back: np.ndarray
    w: np.ndarray
    is_parallel: bool
    slack: float
    covers: bool


def view_of(insertion: Insertion, face: int, footprints: Footprints) -> View:
    """Return a face with what is seen through it."""
    faces = insertion.faces
    return View(
        footprints, faces.back[face], faces.axes[face, 2], bool(faces.is_parallel[face]),
        insertion.slack, insertion.covers,
    )  # fmt: skip


@inner
def cells_around(row, size):
    """Return the first and last of so many cells, along u and along v, around an item."""
    left, _ = step_along(row[U0], size)
    right, _ = step_along(row[U1], size)
    low, _ = step_along(row[V0], size)
    high, _ = step_along(row[V1], size)
    return left, right, low, high


@inner
def through_cell(view, k, u, v, size):
    """Say whether an item may be seen through the cell at u, v of a size, and what is behind it.

    Returns
    -------
    is_seen : bool
    far : float
        How far an item that covers the cell is away at most: all corners of the cell lie inside of
        all edges of its outline, by a margin. inf if it does not, or covering is not asked for.
    """
    footprints, row = view.footprints, view.footprints.rows[k]
    kind = footprints.kind[k]
    if row[U0] > u + size or row[U1] < u or row[V0] > v + size or row[V1] < v:
        return kind == EVERYWHERE, np.inf
    if kind != OUTLINE:
        return kind != BALL or is_cone_in_cell(view.back, row, u, v, size), np.inf
    covers = view.covers
    for edge in range(footprints.first[k], footprints.first[k + 1]):
        a, b, c, margin = edge_of(footprints, k, edge)
        # The corners of the cell that lie most and least to the inside.
        along, across = abs(a) * size, abs(b) * size
        most = a * u + b * v + c + (along if a > 0.0 else 0.0) + (across if b > 0.0 else 0.0)
        if most < -margin:
            return False, np.inf
        covers = covers and most - along - across > 4.0 * margin
    return True, farthest_in_cell(view, row, u, v, size) if covers else np.inf


@inner
def edge_of(footprints, k, edge):
    """Return a, b, c of an edge of an outline, and by how much it is unsure.

    To the inside ``a u + b v + c >= 0``.
    """
    following = edge + 1 if edge + 1 < footprints.first[k + 1] else footprints.first[k]
    p, q = footprints.outline[edge], footprints.outline[following]
    a, b = p[1] - q[1], q[0] - p[0]
    margin = footprints.rows[k, MARGIN_OF] * (abs(a) + abs(b))
    return a, b, -(a * p[0] + b * p[1]), margin


@inner
def is_cone_in_cell(back, row, u, v, size):
    """Compare the angle between the middles of two cones with the sum of theirs."""
    gx, gy, gz = out_of_face(back, u + 0.5 * size, v + 0.5 * size)
    least = angle_between(gx, gy, gz, row[X], row[Y], row[Z]) - row[ANGLE]
    if least <= 0.0:
        return True
    for corner in range(4):
        hx, hy, hz = out_of_face(
            back, u + (size if corner & 1 else 0.0), v + (size if corner & 2 else 0.0)
        )
        if least <= angle_between(gx, gy, gz, hx, hy, hz) + 1e-9:
            return True
    return False


@inner
def angle_between(ax, ay, az, bx, by, bz):
    """Return the angle between two vectors, as exactly for small ones as for large."""
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return np.arctan2(np.sqrt(x * x + y * y + z * z), ax * bx + ay * by + az * bz)


@inner
def farthest_in_cell(view, row, u, v, size):
    """Return how far the plane of a flat item is away at most; inf if it is not before the face."""
    farthest = -np.inf
    for corner in range(4):
        depth = distance_to_plane(
            view, row, u + (size if corner & 1 else 0.0), v + (size if corner & 2 else 0.0)
        )
        if not abs(depth) < np.inf:
            return np.inf
        farthest = depth if depth > farthest else farthest
    return farthest + 1e-6 * abs(farthest) + view.slack


@inner
def distance_to_plane(view, row, u, v):
    """Return how far away the plane is that a flat item lies in, at a place of the face."""
    x, y, z = out_of_face(view.back, u, v)
    height = row[HEIGHT]
    if view.is_parallel:
        # From that place in the face, which is not its origin, along w.
        w = view.w
        height -= row[NX] * (x - w[0]) + row[NY] * (y - w[1]) + row[NZ] * (z - w[2])
        x, y, z = w[0], w[1], w[2]
    along = row[NX] * x + row[NY] * y + row[NZ] * z
    return height / along * np.sqrt(x * x + y * y + z * z)
