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

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...kernels import call, inner, kernel, whole
from ...ranges import ranges
from .faces import BEYOND, Faces, in_face, out_of_face
from .items import Items

NOWHERE = -1

CONE, BOX, EXACT = range(3)
"""How items are inserted."""

EVERYWHERE, RECTANGLE, BALL, OUTLINE = range(4)
"""What is known of an item in a face."""

NEAREST, U0, V0, U1, V1, MARGIN_OF, X, Y, Z, ANGLE, NX, NY, NZ, HEIGHT, N_COLUMNS = range(15)
"""Columns of what is known of it, see :class:`Footprints`."""

NEAR = 1024.0
"""What is nearer to a face's origin than so many times the slack may be seen in any direction."""

SIDES = 5
"""Planes that what a face sees is clipped by."""

MARGIN = 1e-12
"""Of u and v: what is rounded in finding a ray's place."""

BOX_SIDES = np.array([[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2],
                      [4, 5, 7, 6]])  # fmt: skip
"""Corners of the sides of a box; bit k of a corner says on which side it is along axis k."""


class Insertion(NamedTuple):
    """What is inserted, where, and how.

    Attributes
    ----------
    items : Items
    faces : Faces
    how : int
        CONE, BOX or EXACT.
    slack : float
        How far off an item what hits it may pass.
    covers : bool
        Whether cells are cut off behind what covers them.
    """

    items: Items
    faces: Faces
    how: int
    slack: float
    covers: bool


class Footprints(NamedTuple):
    """What is known of those items that are seen through a face.

    Attributes
    ----------
    item : (n,) int32
    kind : (n,) uint8
        EVERYWHERE, RECTANGLE, BALL or OUTLINE.
    rows : (n, N_COLUMNS) float64
        How far away the item is at least (NEAREST); the rectangle around it (U0 to V1); how far
        beyond its outline it may be (MARGIN_OF); where the cone around its ball goes, and half the
        angle of that (X to ANGLE); the plane that a flat item lies in, from the face's origin: a
        normal, and that times any of its points (NX to HEIGHT).
    first : (n + 1,) int64
        Item k has the outline ``outline[first[k]:first[k + 1]]``, if it has one.
    outline : (m, 2) float64
        In u and v, once around to the left.
    """

    item: np.ndarray
    kind: np.ndarray
    rows: np.ndarray
    first: np.ndarray
    outline: np.ndarray


class Scratch(NamedTuple):
    """Scratch memory of one thread: a polygon before and behind each plane that clips it.

    Attributes
    ----------
    before, after : (k, 3) float64
        In coordinates of the face.
    """

    before: np.ndarray
    after: np.ndarray


@inner
def side_of(side, nearest, a, b, c):
    """Return how far a point of a face lies behind a plane that clips it; negative for before."""
    if side == 0:
        return c - nearest
    if side == 1:
        return (1.0 + BEYOND) * c - a
    if side == 2:
        return (1.0 + BEYOND) * c + a
    if side == 3:
        return (1.0 + BEYOND) * c - b
    return (1.0 + BEYOND) * c + b


@inner
def clip_to_face(scratch, count, nearest):
    """Clip the polygon in ``scratch.before`` to what a face sees; return its number of corners.

    I. Sutherland, G. Hodgman: Reentrant Polygon Clipping, CACM 17(1), 1974.
    """
    before, after = scratch.before, scratch.after
    for side in range(SIDES):
        kept = 0
        for i in range(count):
            j = i + 1 if i + 1 < count else 0
            here = side_of(side, nearest, before[i, 0], before[i, 1], before[i, 2])
            there = side_of(side, nearest, before[j, 0], before[j, 1], before[j, 2])
            if here >= 0.0 and kept < len(after):
                for axis in range(3):
                    after[kept, axis] = before[i, axis]
                kept += 1
            if (here >= 0.0) != (there >= 0.0) and kept < len(after):
                share = here / (here - there)
                for axis in range(3):
                    after[kept, axis] = before[i, axis] + share * (
                        before[j, axis] - before[i, axis]
                    )
                kept += 1
        count = kept
        for i in range(count):
            for axis in range(3):
                before[i, axis] = after[i, axis]
    return count


@inner
def distance_to_box(boxes, i, x, y, z):
    """Return the distance of a point to a box."""
    dx = max(max(boxes[i, 0] - x, x - boxes[i, 3]), 0.0)
    dy = max(max(boxes[i, 1] - y, y - boxes[i, 4]), 0.0)
    dz = max(max(boxes[i, 2] - z, z - boxes[i, 5]), 0.0)
    return np.sqrt(dx * dx + dy * dy + dz * dz)


@inner
def nearest_of(insertion, face, i):
    """Return the least distance of an item from a face's origin; along parallel rays, its depth."""
    faces, boxes, slack = insertion.faces, insertion.items.boxes, insertion.slack
    o = faces.origins[face]
    if faces.is_parallel[face]:
        w = faces.axes[face, 2]
        depth = 0.0
        for axis in range(3):
            depth += w[axis] * (boxes[i, axis if w[axis] > 0.0 else 3 + axis] - o[axis])
        return depth - slack
    return distance_to_box(boxes, i, o[0], o[1], o[2]) - slack


@inner
def is_at_origin(insertion, face, i):
    """Say whether an item may be so near a face's origin that it has no place in it.

    Of a triangle that is inserted exactly not only the box is asked.
    """
    items, faces = insertion.items, insertion.faces
    o, near = faces.origins[face], NEAR * insertion.slack
    if distance_to_box(items.boxes, i, o[0], o[1], o[2]) > near:
        return False
    if items.first[i] == items.first[i + 1] or insertion.how != EXACT:
        return True
    return distance_to_hull(items, i, o[0], o[1], o[2]) <= 2.0 * near


@inner
def distance_to_hull(items, i, x, y, z):
    """Return the distance of a point to a triangle; of other outlines, 0.

    To its plane, if it is above the triangle, else to the nearest of its edges.
    """
    first = items.first[i]
    if items.first[i + 1] - first != 3:
        return 0.0
    p = items.points
    ax, ay, az = p[first, 0] - x, p[first, 1] - y, p[first, 2] - z
    nx, ny, nz = normal_of(items, i)
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    least = np.inf
    is_above = length > 0.0
    for corner in range(3):
        k, following = first + corner, first + (corner + 1 if corner < 2 else 0)
        bx, by, bz = p[k, 0] - x, p[k, 1] - y, p[k, 2] - z
        ex, ey, ez = p[following, 0] - p[k, 0], p[following, 1] - p[k, 1], p[following, 2] - p[k, 2]
        square = ex * ex + ey * ey + ez * ez
        share = -(bx * ex + by * ey + bz * ez) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        cx, cy, cz = bx + share * ex, by + share * ey, bz + share * ez
        least = min(least, np.sqrt(cx * cx + cy * cy + cz * cz))
        # Across the edge, into the triangle: n x e.
        inside = (ny * ez - nz * ey) * bx + (nz * ex - nx * ez) * by + (nx * ey - ny * ex) * bz
        is_above = is_above and inside <= 0.0
    if is_above:
        least = min(least, abs(ax * nx + ay * ny + az * nz) / length)
    return least


@inner
def normal_of(items, i):
    """Return a normal of an outline, as long as twice its area (Newell)."""
    first, last = items.first[i], items.first[i + 1]
    p = items.points
    x, y, z = 0.0, 0.0, 0.0
    for k in range(first + 1, last - 1):
        ax, ay, az = p[k, 0] - p[first, 0], p[k, 1] - p[first, 1], p[k, 2] - p[first, 2]
        bx, by, bz = (
            p[k + 1, 0] - p[first, 0], p[k + 1, 1] - p[first, 1], p[k + 1, 2] - p[first, 2],
        )  # fmt: skip
        x += ay * bz - az * by
        y += az * bx - ax * bz
        z += ax * by - ay * bx
    return x, y, z


@inner
def load_corner(faces, face, x, y, z, scratch, corner):
    """Put a point, as seen from a face's origin, into ``scratch.before``."""
    a, b, c = in_face(faces, face, x, y, z)
    scratch.before[corner, 0], scratch.before[corner, 1] = a, b
    scratch.before[corner, 2] = 1.0 if faces.is_parallel[face] else c


@inner
def load_side(insertion, scratch, face, i, side):
    """Put a side of an item's box into ``scratch.before``, in coordinates of a face."""
    boxes, o = insertion.items.boxes, insertion.faces.origins[face]
    for corner in range(4):
        bits = whole(BOX_SIDES[side, corner])
        x = boxes[i, 3 if bits & 1 else 0] - o[0]
        y = boxes[i, 4 if bits & 2 else 1] - o[1]
        z = boxes[i, 5 if bits & 4 else 2] - o[2]
        load_corner(insertion.faces, face, x, y, z, scratch, corner)
    return 4


@inner
def load_outline(insertion, scratch, face, i):
    """Put an item's outline into ``scratch.before``, in coordinates of a face; count corners."""
    items, o = insertion.items, insertion.faces.origins[face]
    first, last = items.first[i], items.first[i + 1]
    for k in range(first, last):
        p = items.points[k]
        load_corner(
            insertion.faces, face, p[0] - o[0], p[1] - o[1], p[2] - o[2], scratch, k - first
        )
    return last - first


@inner
def is_hidden(insertion, scratch, face, i, nearest):
    """Say whether a box lies behind one of the planes that clip it."""
    boxes, faces = insertion.items.boxes, insertion.faces
    o = faces.origins[face]
    # Bit by bit, the planes that all corners so far are behind.
    behind = (1 << SIDES) - 1
    for bits in range(8):
        x = boxes[i, 3 if bits & 1 else 0] - o[0]
        y = boxes[i, 4 if bits & 2 else 1] - o[1]
        z = boxes[i, 5 if bits & 4 else 2] - o[2]
        a, b, c = in_face(faces, face, x, y, z)
        if faces.is_parallel[face]:
            c = 1.0
        for side in range(SIDES):
            if side_of(side, nearest, a, b, c) >= 0.0:
                behind &= ~(1 << side)
        if behind == 0:
            return False
    return True


@inner
def project_item(insertion, scratch, face, i, row, outline, place):
    """Write what is known of an item in a face into a row, and its outline at a place.

    Returns
    -------
    kind : int
        NOWHERE if it is not seen through the face.
    count : int
        Corners of its outline.
    """
    items, faces, slack = insertion.items, insertion.faces, insertion.slack
    is_parallel = faces.is_parallel[face] != 0
    o = faces.origins[face]
    x, y, z = items.balls[i, 0] - o[0], items.balls[i, 1] - o[1], items.balls[i, 2] - o[2]
    distance, radius = np.sqrt(x * x + y * y + z * z), items.balls[i, 3] + slack
    angle = np.pi
    if distance > radius:
        angle = np.arcsin(radius / distance) + 1e-9
    row[X], row[Y], row[Z], row[ANGLE] = x, y, z, angle
    row[NEAREST] = nearest_of(insertion, face, i)
    if not is_parallel and is_at_origin(insertion, face, i):
        row[U0], row[V0], row[U1], row[V1] = -1.0, -1.0, 1.0, 1.0
        return EVERYWHERE, 0
    nearest = slack / faces.spread[face]
    if is_hidden(insertion, scratch, face, i, nearest):
        return NOWHERE, 0
    is_flat = insertion.how == EXACT and items.first[i] < items.first[i + 1]
    u0, v0, u1, v1 = np.inf, np.inf, -np.inf, -np.inf
    depth, area, count = np.inf, 0.0, 0
    for side in range(1 if is_flat else 6):
        if is_flat:
            count = load_outline(insertion, scratch, face, i)
        else:
            count = load_side(insertion, scratch, face, i, side)
        count = clip_to_face(scratch, count, nearest)
        before = scratch.before
        for k in range(count):
            u, v = before[k, 0] / before[k, 2], before[k, 1] / before[k, 2]
            before[k, 0], before[k, 1] = u, v
            depth = before[k, 2] if before[k, 2] < depth else depth
            u0, u1 = u if u < u0 else u0, u if u > u1 else u1
            v0, v1 = v if v < v0 else v0, v if v > v1 else v1
    if depth == np.inf:
        return NOWHERE, 0
    margin = MARGIN + 2.0 * faces.scale[face] * slack / (1.0 if is_parallel else depth)
    row[U0], row[V0], row[U1], row[V1] = u0 - margin, v0 - margin, u1 + margin, v1 + margin
    row[MARGIN_OF] = margin
    if row[U0] > 1.0 or row[V0] > 1.0 or row[U1] < -1.0 or row[V1] < -1.0:
        return NOWHERE, 0
    if not is_flat:
        # Parallel rays see no cones.
        has_cone = not is_parallel and insertion.how != BOX and angle < np.pi
        return (BALL if has_cone else RECTANGLE), 0
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        area += before[k, 0] * before[j, 1] - before[k, 1] * before[j, 0]
    # Of one seen edge-on the rectangle is as good.
    if abs(area) <= 1e-9 * (u1 - u0) * (v1 - v0):
        return RECTANGLE, 0
    for k in range(count):
        j = k if area > 0.0 else count - 1 - k
        outline[place + k, 0], outline[place + k, 1] = before[j, 0], before[j, 1]
    nx, ny, nz = normal_of(items, i)
    p = items.points[items.first[i]]
    row[NX], row[NY], row[NZ] = nx, ny, nz
    row[HEIGHT] = nx * (p[0] - o[0]) + ny * (p[1] - o[1]) + nz * (p[2] - o[2])
    return OUTLINE, count


@kernel
def project_items(insertion, scratch, face, begin, end, footprints, found):
    """Write what is known of the items ``begin <= i < end`` that are seen through a face.

    Parameters
    ----------
    footprints : Footprints
        With room for all of them, and for their outlines, clipped.
    found : (1,) int64
        Of how many something was written.
    """
    count, place = whole(0), whole(0)
    for i in range(begin, end):
        row = footprints.rows[count]
        kind, corners = project_item(insertion, scratch, face, i, row, footprints.outline, place)
        if kind == NOWHERE:
            continue
        footprints.item[count], footprints.kind[count] = i, kind
        footprints.first[count] = place
        place += corners
        count += 1
        footprints.first[count] = place
    found[0] = count


ITEMS_AT_ONCE = 1 << 14
"""Items that are projected in one piece of work."""


def footprints_of(
    insertion: Insertion, face: int, check: Callable[[], None] = lambda: None
) -> Footprints:
    """Return what is known of all items that are seen through a face, the nearest first.

    Parameters
    ----------
    check : callable
        Is called now and then, and may raise.
    """
    items = insertion.items
    most = max(int(np.diff(items.first).max(initial=0)), 4) + 2 * SIDES
    scratch = Scratch(np.empty((most, 3)), np.empty((most, 3)))
    begins = np.arange(0, len(items.boxes), ITEMS_AT_ONCE)
    ends = np.minimum(begins + ITEMS_AT_ONCE, len(items.boxes))
    count = int((ends - begins).max())
    corners = int((items.first[ends] - items.first[begins]).max()) + SIDES * count
    room = Footprints(
        np.empty(count, np.int32), np.empty(count, np.uint8), np.zeros((count + 1, N_COLUMNS)),
        np.zeros(count + 1, np.int64), np.empty((corners, 2)),
    )  # fmt: skip
    parts, found = [], np.zeros(1, np.int64)
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        check()
        call(project_items, insertion, scratch, face, begin, end, room, found)
        n = int(found[0])
        outline = room.outline[: room.first[n]].copy()
        sizes = np.diff(room.first[: n + 1])
        columns = room.item[:n].copy(), room.kind[:n].copy(), room.rows[:n].copy()
        parts.append(Footprints(*columns, sizes, outline))
    joined = Footprints(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    return in_order_of_distance(joined)


def in_order_of_distance(given: Footprints) -> Footprints:
    """Sort footprints, whose `first` has sizes of outlines, and set that right."""
    order = np.argsort(given.rows[:, NEAREST], kind="stable")
    sizes = given.first[order]
    begins = (np.cumsum(given.first) - given.first)[order]
    return Footprints(
        given.item[order], given.kind[order], given.rows[order],
        np.concatenate([[0], np.cumsum(sizes)]), given.outline[ranges(begins, sizes)],
    )  # fmt: skip


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
