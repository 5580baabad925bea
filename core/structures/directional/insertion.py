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

import numpy as np

from ...kernels import inner
from .faces import out_of_face
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
    X,
    Y,
    Z,
)


@inner
def is_in_cell(footprints, faces, face, k, u, v, size):
    """Say whether an item may be seen through the cell at u, v of a size."""
    kind, row = footprints.kind[k], footprints.rows[k]
    if row[U0] > u + size or row[U1] < u or row[V0] > v + size or row[V1] < v:
        return kind == EVERYWHERE
    if kind == BALL:
        return is_cone_in_cell(faces, face, row, u, v, size)
    if kind == OUTLINE:
        for edge in range(footprints.first[k], footprints.first[k + 1]):
            a, b, c = edge_of(footprints, k, edge)
            # The corner of the cell that lies most to the inside.
            most = c + a * (u + size if a > 0.0 else u) + b * (v + size if b > 0.0 else v)
            if most < -row[MARGIN_OF] * (abs(a) + abs(b)):
                return False
    return True


@inner
def edge_of(footprints, k, edge):
    """Return a, b, c of an edge of an outline: ``a u + b v + c >= 0`` to its inside."""
    following = edge + 1 if edge + 1 < footprints.first[k + 1] else footprints.first[k]
    p, q = footprints.outline[edge], footprints.outline[following]
    a, b = p[1] - q[1], q[0] - p[0]
    return a, b, -(a * p[0] + b * p[1])


@inner
def is_cone_in_cell(faces, face, row, u, v, size):
    """Compare the angle between the middles of two cones with the sum of theirs."""
    gx, gy, gz = out_of_face(faces, face, u + 0.5 * size, v + 0.5 * size)
    least = angle_between(gx, gy, gz, row[X], row[Y], row[Z]) - row[ANGLE]
    if least <= 0.0:
        return True
    for corner in range(4):
        hx, hy, hz = out_of_face(
            faces, face, u + (size if corner & 1 else 0.0), v + (size if corner & 2 else 0.0)
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
def covered_to(footprints, faces, face, slack, k, u, v, size):
    """Return how far an item that covers a cell is away at most; inf if it does not cover it.

    All corners of the cell lie inside of all edges of the outline, by a margin.
    """
    if footprints.kind[k] != OUTLINE:
        return np.inf
    row, w = footprints.rows[k], faces.axes[face, 2]
    for edge in range(footprints.first[k], footprints.first[k + 1]):
        a, b, c = edge_of(footprints, k, edge)
        least = c + a * (u if a > 0.0 else u + size) + b * (v if b > 0.0 else v + size)
        if least <= 4.0 * row[MARGIN_OF] * (abs(a) + abs(b)):
            return np.inf
    farthest = -np.inf
    for corner in range(4):
        x, y, z = out_of_face(
            faces, face, u + (size if corner & 1 else 0.0), v + (size if corner & 2 else 0.0)
        )
        if faces.is_parallel[face]:
            # From the place in the plane, along w, to the item's plane.
            x, y, z = x - w[0], y - w[1], z - w[2]
            along = row[NX] * w[0] + row[NY] * w[1] + row[NZ] * w[2]
            depth = (row[HEIGHT] - (row[NX] * x + row[NY] * y + row[NZ] * z)) / along
        else:
            along = row[NX] * x + row[NY] * y + row[NZ] * z
            depth = row[HEIGHT] / along * np.sqrt(x * x + y * y + z * z)
        if not abs(depth) < np.inf:
            return np.inf
        farthest = depth if depth > farthest else farthest
    return farthest + 1e-6 * abs(farthest) + slack
