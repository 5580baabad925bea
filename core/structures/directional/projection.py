"""Projection: what is known of an item in a face, before cells are asked.

A flat convex item is clipped to what the face sees, and projected: its *outline*. Of any other the
sides of its box are, and the rectangle around them is known; besides the cone around its ball. What
is known is larger than the item is, by what rays pass off their lines (:data:`.items.ULPS`) and
what is rounded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...kernels import call, inner, kernel, whole
from ...ranges import ranges
from .faces import BEYOND, Faces
from .items import Items

CONE, BOX, EXACT = range(3)
"""How items are inserted."""

EVERYWHERE, RECTANGLE, BALL, OUTLINE = range(4)
"""What is known of an item in a face."""

NEAREST, X, Y, Z, ANGLE, U0, V0, U1, V1, MARGIN_OF, NX, NY, NZ, HEIGHT, N_COLUMNS = range(15)
"""Columns of what is known of it, see :class:`Footprints`."""

NEAR = 1024.0
"""What is nearer to a face's origin than so many times the slack may be seen in any direction."""

SIDES = 5
"""Planes that what a face sees is clipped by."""

MARGIN = 1e-12
"""Of u and v: what is rounded in finding a ray's place."""

BOX_SIDES = np.array(
    [[[3 * (bits >> axis & 1) + axis for axis in range(3)] for bits in side]
     for side in ([0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2],
                  [4, 5, 7, 6])]
)  # fmt: skip
"""Which of a box's six numbers the corners of its sides have; bit k of a corner says on which side
it is along axis k."""


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
        How far away the item is at least (NEAREST); where the cone around its ball goes, and half
        the angle of that (X to ANGLE); the rectangle around it (U0 to V1); how far beyond its
        outline it may be (MARGIN_OF); the plane that a flat item lies in, from the face's origin: a
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


@inner
def clip_to_face(before, after, count, planes):
    """Clip a polygon, in `before`, to what a face sees; return its number of corners.

    I. Sutherland, G. Hodgman: Reentrant Polygon Clipping, CACM 17(1), 1974.
    """
    for side in range(len(planes)):
        kept = 0
        for i in range(count):
            j = i + 1 if i + 1 < count else 0
            here = there = planes[side, 3]
            for axis in range(3):
                here += planes[side, axis] * before[i, axis]
                there += planes[side, axis] * before[j, axis]
            if here >= 0.0:
                for axis in range(3):
                    after[kept, axis] = before[i, axis]
                kept += 1
            if (here >= 0.0) != (there >= 0.0):
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


@kernel
def project_polygons(points, polygons, items, planes, scratch, extent, outline, corners):
    """Clip the polygons of items to what a face sees, and project them.

    Parameters
    ----------
    points : (p, 3) float64
        Corners, in coordinates of the face.
    polygons : (q + 1,) int64
        Polygon k has the corners ``points[polygons[k]:polygons[k + 1]]``.
    items : (n + 1,) int64
        Item i has the polygons ``items[i] <= k < items[i + 1]``.
    planes : (SIDES, 4) float64
        See :func:`sides_of`.
    scratch : (2, k, 3) float64
    extent : (n, 6) float64
        In the end the rectangle around each, the least depth, and twice the area of the last
        polygon, negative if that goes round to the right.
    outline : (p + SIDES q, 2) float64
        In the end the last polygon of each, one after the other.
    corners : (n,) int64
        In the end how many corners that has.
    """
    before, after, place = scratch[0], scratch[1], whole(0)
    for i in range(len(items) - 1):
        u0, v0, u1, v1, depth, area = np.inf, np.inf, -np.inf, -np.inf, np.inf, 0.0
        count = whole(0)
        for k in range(items[i], items[i + 1]):
            count = whole(polygons[k + 1] - polygons[k])
            for corner in range(count):
                for axis in range(3):
                    before[corner, axis] = points[polygons[k] + corner, axis]
            count = whole(clip_to_face(before, after, count, planes))
            for corner in range(count):
                c = before[corner, 2]
                u, v = before[corner, 0] / c, before[corner, 1] / c
                outline[place + corner, 0], outline[place + corner, 1] = u, v
                depth = c if c < depth else depth
                u0, u1 = u if u < u0 else u0, u if u > u1 else u1
                v0, v1 = v if v < v0 else v0, v if v > v1 else v1
        for corner in range(count):
            j = place + (corner + 1 if corner + 1 < count else 0)
            area += outline[place + corner, 0] * outline[j, 1]
            area -= outline[place + corner, 1] * outline[j, 0]
        row = extent[i]
        row[0], row[1], row[2], row[3], row[4], row[5] = u0, v0, u1, v1, depth, area
        corners[i] = count
        place += count


def sides_of(nearest: float) -> np.ndarray:
    """Return the planes that clip what a face sees, (SIDES, 4): a, b, c, d.

    Kept is where ``a x + b y + c z + d >= 0``: before the face by more than `nearest`, and not
    beyond its borders.
    """
    wide = 1.0 + BEYOND
    return np.array(
        [[0.0, 0.0, 1.0, -nearest], [-1.0, 0.0, wide, 0.0], [1.0, 0.0, wide, 0.0],
         [0.0, -1.0, wide, 0.0], [0.0, 1.0, wide, 0.0]]
    )  # fmt: skip


def project(insertion: Insertion, face: int, numbers: np.ndarray, around: np.ndarray) -> Footprints:
    """Return what is known of some items in a face, with the sizes of outlines as `first`.

    Parameters
    ----------
    numbers : (n,) int64
    around : (n, 5) float64
        Of these, see :func:`around_origin`.
    """
    items, faces, slack = insertion.items, insertion.faces, insertion.slack
    is_parallel = bool(faces.is_parallel[face])
    is_flat = (items.first[numbers + 1] > items.first[numbers]) & (insertion.how == EXACT)
    # A flat item is a polygon, any other has six, the sides of its box.
    sizes = np.where(is_flat, items.first[numbers + 1] - items.first[numbers], 24)
    ends = np.cumsum(sizes)
    points = np.empty((int(sizes.sum()), 3))
    flat, solid = numbers[is_flat], numbers[~is_flat]
    points[ranges((ends - sizes)[is_flat], sizes[is_flat])] = items.points[
        ranges(items.first[flat], sizes[is_flat])
    ]
    points[ranges((ends - sizes)[~is_flat], sizes[~is_flat])] = items.boxes[solid][
        :, BOX_SIDES
    ].reshape(-1, 3)
    points = (points - faces.origins[face]) @ faces.axes[face].T
    if is_parallel:
        points[:, 2] = 1.0
    n_polygons = np.where(is_flat, 1, 6)
    of_polygon = np.repeat(np.where(is_flat, sizes, 4), n_polygons)
    room = int(of_polygon.max(initial=4)) + 2 * SIDES
    extent, corners = np.empty((len(numbers), 6)), np.empty(len(numbers), np.int64)
    outline = np.empty((len(points) + SIDES * len(of_polygon), 2))
    call(
        project_polygons, points, starts_of(of_polygon), starts_of(n_polygons),
        sides_of(slack / faces.spread[face]), np.empty((2, room, 3)), extent, outline, corners,
    )  # fmt: skip
    depth, area = extent[:, 4], extent[:, 5]
    with np.errstate(invalid="ignore"):  # of what is not seen, inf - inf
        margin = MARGIN + 2.0 * faces.scale[face] * slack / depth
        low, high = extent[:, :2] - margin[:, None], extent[:, 2:4] + margin[:, None]
        # Of one seen edge-on the rectangle is as good as the outline.
        has_outline = is_flat & (
            np.abs(area) > 1e-9 * (extent[:, 2:4] - extent[:, :2]).prod(axis=1)
        )
    is_seen = (depth < np.inf) & (low <= 1.0).all(axis=1) & (high >= -1.0).all(axis=1)
    # Parallel rays see no cones.
    has_cone = ~is_flat & (around[:, ANGLE] < np.pi) & (insertion.how != BOX) & (not is_parallel)
    kind = np.select([has_outline, has_cone], [OUTLINE, BALL], RECTANGLE).astype(np.uint8)
    rows = np.zeros((len(numbers), N_COLUMNS))
    rows[:, : ANGLE + 1] = around
    rows[:, U0 : V0 + 1], rows[:, U1 : V1 + 1], rows[:, MARGIN_OF] = low, high, margin
    normals = items.normals[numbers]
    rows[:, NX : NZ + 1] = normals
    own = is_flat.nonzero()[0]
    points = items.points[items.first[numbers[own]]] - faces.origins[face]
    rows[own, HEIGHT] = (normals[own] * points).sum(axis=1)
    kept = np.where(is_seen & has_outline, corners, 0)
    # All go round to the left.
    order = ranges(np.cumsum(corners) - corners, np.where(is_seen & has_outline, corners, 0))
    turned = np.repeat(area < 0.0, kept)
    rank = ranges(0, kept)
    order = np.where(turned, order + np.repeat(kept, kept) - 1 - 2 * rank, order)
    return Footprints(
        numbers[is_seen].astype(np.int32), kind[is_seen], rows[is_seen], kept[is_seen],
        outline[order],
    )  # fmt: skip


def starts_of(sizes: np.ndarray) -> np.ndarray:
    """Return where pieces of some sizes begin, and the end, (n + 1,) int64."""
    return np.concatenate([[0], np.cumsum(sizes)])


def are_hidden(insertion: Insertion, face: int) -> np.ndarray:
    """Say which boxes lie behind one of the planes that a face sees up to, (n,) bool."""
    faces, boxes = insertion.faces, insertion.items.boxes
    u, v, w = faces.axes[face]
    origin = faces.origins[face]
    hidden = np.zeros(len(boxes), bool)
    for across in (u, -u, v, -v):
        # How far the corner that lies most to the front is before the plane.
        if faces.is_parallel[face]:
            normal, offset = -across, 1.0 + BEYOND
        else:
            normal, offset = (1.0 + BEYOND) * w - across, 0.0
        low, high = boxes[:, :3] - origin, boxes[:, 3:] - origin
        most = np.maximum(low * normal, high * normal).sum(axis=1) + offset
        hidden |= most < -insertion.slack * np.abs(normal).sum()
    if not faces.is_parallel[face]:
        hidden |= np.maximum(low * w, high * w).sum(axis=1) < 0.0
    return hidden


def around_origin(insertion: Insertion, face: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what is known of all items from a face's origin, whatever the face.

    Returns
    -------
    around : (n, 5) float64
        The columns NEAREST to ANGLE of :class:`Footprints`. Along parallel rays the nearest is the
        least depth.
    at_origin : (n,) bool
        Which are so near that they have no place in the face, and may be seen anywhere. Of
        triangles that are inserted exactly not only the box is asked.
    """
    items, faces, slack = insertion.items, insertion.faces, insertion.slack
    origin, boxes = faces.origins[face], items.boxes
    middle = items.balls[:, :3] - origin
    distance, radius = np.linalg.norm(middle, axis=1), items.balls[:, 3] + slack
    sine = np.divide(radius, distance, out=np.ones(len(boxes)), where=distance > radius)
    angle = np.where(sine < 1.0, np.arcsin(sine) + 1e-9, np.pi)
    if faces.is_parallel[face]:
        w = faces.axes[face, 2]
        nearest = np.where(w > 0.0, boxes[:, :3] - origin, boxes[:, 3:] - origin) @ w
        at_origin = np.zeros(len(boxes), bool)
    else:
        gap = np.maximum(np.maximum(boxes[:, :3] - origin, origin - boxes[:, 3:]), 0.0)
        nearest = np.linalg.norm(gap, axis=1)
        at_origin = nearest <= NEAR * slack
        first, last = items.first[:-1], items.first[1:]
        asked = np.flatnonzero(at_origin & (last - first == 3) & (insertion.how == EXACT))
        corners = items.points[first[asked, None] + np.arange(3)]
        at_origin[asked] = distances_to_triangles(corners, origin) <= 2.0 * NEAR * slack
    return np.column_stack([nearest - slack, middle, angle]), at_origin


def distances_to_triangles(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the distances of a point to triangles, (n, 3, 3), as (n,).

    To the plane, where the point is above the triangle, else to the nearest edge.
    """
    begin = corners - point
    edge = np.roll(corners, -1, axis=1) - corners
    square = (edge * edge).sum(axis=2)
    share = np.divide(-(begin * edge).sum(axis=2), square, out=np.zeros_like(square),
                      where=square > 0.0)  # fmt: skip
    nearest = begin + np.clip(share, 0.0, 1.0)[:, :, None] * edge
    distance: np.ndarray = np.linalg.norm(nearest, axis=2).min(axis=1, initial=np.inf)
    normal = np.cross(edge[:, 0], edge[:, 1])
    length = np.linalg.norm(normal, axis=1)
    is_inside = (np.cross(normal[:, None], edge) * begin).sum(axis=2) <= 0.0
    above = is_inside.all(axis=1) & (length > 0.0)
    height = np.abs((begin[:, 0] * normal).sum(axis=1))
    distance[above] = np.minimum(distance[above], height[above] / length[above])
    return distance


ITEMS_AT_ONCE = 1 << 14
"""Items that are projected in one piece of work."""


def footprints_of(
    insertion: Insertion, face: int, check: Callable[[], object] = lambda: None
) -> Footprints:
    """Return what is known of all items that are seen through a face, the nearest first.

    Parameters
    ----------
    check : callable
        Is called now and then, and may raise.
    """
    around, at_origin = around_origin(insertion, face)
    check()
    everywhere = np.flatnonzero(at_origin)
    count = len(everywhere)
    rows = np.zeros((count, N_COLUMNS))
    rows[:, : ANGLE + 1] = around[everywhere]
    rows[:, U0 : V1 + 1] = -1.0, -1.0, 1.0, 1.0
    kinds, sizes = np.full(count, EVERYWHERE, np.uint8), np.zeros(count, np.int64)
    parts = [Footprints(everywhere.astype(np.int32), kinds, rows, sizes, np.zeros((0, 2)))]
    others = np.flatnonzero(~(at_origin | are_hidden(insertion, face)))
    for begin in range(0, len(others), ITEMS_AT_ONCE):
        check()
        numbers = others[begin : begin + ITEMS_AT_ONCE]
        parts.append(project(insertion, face, numbers, around[numbers]))
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
