"""Ears: how polygons are cut that are no fans of triangles.

A convex corner with no other corner in the triangle that it makes with its two neighbours, an ear,
is cut off, until three corners are left. Only a corner that is not convex can be in such a
triangle. In a large polygon these are found by buckets, so that the time grows little faster than
the number of corners.

G. H. Meisters: Polygons Have Ears, The American Mathematical Monthly 82(6), 1975.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..kernels import call, inner, kernel

ROUNDING = 1e-14
"""How far from zero rounding may bring the area of a triangle that lies on a line, where no side is
longer than the polygon, whose extent is at most 2. Less than that is taken for zero."""

LARGE = 1000
"""Corners from which on those of a polygon are sorted into buckets."""

LOOKS = 400_000_000
"""How many corners and buckets are looked at for one polygon, at most, some ten seconds: from then
on any corner is an ear. Only polygons that come back to the same places thousands of times get
there; others take a hundredth of it."""


def cut_off_ears(
    points: np.ndarray,
    normals: np.ndarray,
    offsets: np.ndarray,
    firsts: np.ndarray,
    polygons: np.ndarray,
    triangles: np.ndarray,
) -> None:
    """Cut polygons by clipping ears; parameters as of :func:`clip_ears`."""

    def clip(some: np.ndarray, buckets: Buckets) -> None:
        ring = np.empty((4, len(buckets.following)), dtype=np.int64)
        call(clip_ears, points, normals, offsets, firsts, some, ring, buckets, LOOKS, triangles)

    sizes = np.diff(offsets)[polygons]
    small = polygons[sizes < LARGE]
    if len(small):
        clip(small, one_bucket(int(np.diff(offsets)[small].max())))
    for polygon in polygons[sizes >= LARGE]:
        own = points[offsets[polygon] : offsets[polygon + 1]]
        clip(np.array([polygon]), buckets_of(own, normals[polygon]))


# ---------------------------------------------------------------------------------------- buckets


class Buckets(NamedTuple):
    """The hollow corners of a polygon, sorted by where they lie in its plane.

    A triangle that may be an ear is small as a rule: so few corners need to be looked at.

    Attributes
    ----------
    places : (size, 2) float64
        All corners in the plane of the polygon.
    walls : (2, side - 1) float64
        Where buckets end along either axis, ascending. About as many corners lie between any two.
    heads : (side, side) int64
        A corner of each bucket, or -1.
    following : (size,) int64
        The next corner of the same bucket, or -1.
    """

    places: np.ndarray
    walls: np.ndarray
    heads: np.ndarray
    following: np.ndarray


def one_bucket(size: int) -> Buckets:
    """Return room for all corners of a polygon of up to `size` in a single bucket."""
    return Buckets(
        np.zeros((size, 2)), np.zeros((2, 0)), np.empty((1, 1), np.int64), np.empty(size, np.int64)
    )


def buckets_of(points: np.ndarray, normal: np.ndarray) -> Buckets:
    """Return room for the corners of a polygon, one to two in a bucket if they lie evenly."""
    size = len(points)
    # Two directions across the normal; neither needs a certain length.
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    places = points @ np.stack([first, np.cross(normal, first)], axis=1)
    side = math.isqrt(size // 2)
    walls = np.sort(places, axis=0)[size * np.arange(1, side) // side]
    return Buckets(
        np.ascontiguousarray(places), np.ascontiguousarray(walls.T),
        np.empty((side, side), np.int64), np.empty(size, np.int64),
    )  # fmt: skip


@inner
def bucket_at(walls, axis, x):
    """Return the number of the bucket along an axis that a coordinate lies in."""
    low, high = 0, walls.shape[1]
    while low < high:
        middle = (low + high) // 2
        if walls[axis, middle] <= x:
            low = middle + 1
        else:
            high = middle
    return low


@inner
def span(places, a, b, c, left, right):
    """Return between which y a triangle lies where x is between `left` and `right`."""
    low, high = np.inf, -np.inf
    for side in range(3):
        p, q = (a, b) if side == 0 else ((b, c) if side == 1 else (c, a))
        if places[q, 0] < places[p, 0]:
            p, q = q, p
        width, height = places[q, 0] - places[p, 0], places[q, 1] - places[p, 1]
        begin, end = max(left, places[p, 0]), min(right, places[q, 0])
        if begin > end:
            continue
        from_p, from_q = places[p, 1], places[q, 1]
        if width > 0.0:
            from_p += (begin - places[p, 0]) / width * height
            from_q -= (places[q, 0] - end) / width * height
        low, high = min(low, from_p, from_q), max(high, from_p, from_q)
    return low, high


# ------------------------------------------------------------------------------------------- ears


@inner
def turn(points, normals, polygon, a, b, c):
    """Return twice the area of a triangle as the normal sees it, positive if it turns left."""
    ux, uy, uz = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    vx, vy, vz = (
        points[c, 0] - points[a, 0],
        points[c, 1] - points[a, 1],
        points[c, 2] - points[a, 2],
    )
    return (
        normals[polygon, 0] * (uy * vz - uz * vy)
        + normals[polygon, 1] * (uz * vx - ux * vz)
        + normals[polygon, 2] * (ux * vy - uy * vx)
    )


@inner
def coincide(points, a, b):
    """Say whether two corners are at the same place."""
    return (
        points[a, 0] == points[b, 0]
        and points[a, 1] == points[b, 1]
        and points[a, 2] == points[b, 2]
    )


STRICT, FLAT, TOUCHING, ANY = 0, 1, 2, 3
"""What counts as an ear when nothing better is found: a proper one; a corner on a straight line or
on top of another, which has no area; one that others touch; any corner, for polygons that cross
themselves."""


@inner
def blocks(points, normals, polygon, begin, a, b, c, h, ring, ear_is):
    """Say whether the outline comes into the triangle of corners a, b and c at a hollow one, h."""
    if coincide(points, begin + h, begin + b):
        # The outline passes b a second time: is it inside before or after?
        for side in range(2):
            q = begin + ring[side, h]
            if (
                turn(points, normals, polygon, begin + b, begin + c, q) > ROUNDING
                and turn(points, normals, polygon, begin + b, q, begin + a) > ROUNDING
            ):
                return True
        return False
    # From a or c the outline cannot leave the triangle again but through the side a c, and so it
    # has a corner inside.
    if coincide(points, begin + h, begin + a) or coincide(points, begin + h, begin + c):
        return False
    u = turn(points, normals, polygon, begin + a, begin + b, begin + h)
    v = turn(points, normals, polygon, begin + b, begin + c, begin + h)
    w = turn(points, normals, polygon, begin + c, begin + a, begin + h)
    least = ROUNDING if ear_is == TOUCHING else -ROUNDING
    return u >= least and v >= least and w >= least


@inner
def is_blocked(points, normals, polygon, begin, a, b, c, area, ring, buckets, ear_is):
    """Say whether the outline comes into the triangle of corner b and its neighbours a and c.

    Then it does so at a hollow corner, one that is not convex. `area` is what :func:`turn` says of
    the triangle, more than ROUNDING. Second, how many corners and buckets were looked at.
    """
    looks = 0
    places, walls = buckets.places, buckets.walls
    low, high, extent = np.inf, -np.inf, 0.0
    for corner in (a, b, c):
        low, high = min(low, places[corner, 0]), max(high, places[corner, 0])
        for axis in range(2):
            extent = max(extent, abs(places[corner, axis] - places[a, axis]))
    # A corner blocks within ROUNDING. Moving the sides outwards by that much, as areas go, moves
    # the corners of the triangle by at most this; the rest is for the rounding of places.
    margin = (8.0 * ROUNDING / area + 1e-9) * extent + 1e-12
    last = bucket_at(walls, 0, high + margin)
    for i in range(bucket_at(walls, 0, low - margin), last + 1):
        # Of a needle, only the buckets along it.
        left = walls[0, i - 1] if i > 0 else -np.inf
        right = walls[0, i] if i < walls.shape[1] else np.inf
        low, high = span(places, a, b, c, left - margin, right + margin)
        top = bucket_at(walls, 1, high + margin)
        for j in range(bucket_at(walls, 1, low - margin), top + 1):
            before, h = -1, buckets.heads[i, j]
            looks += 1
            while h >= 0:
                looks += 1
                following = buckets.following[h]
                if not ring[HOLLOW, h]:
                    # It will not be hollow again.
                    if before < 0:
                        buckets.heads[i, j] = following
                    else:
                        buckets.following[before] = following
                elif h not in (a, c) and blocks(
                    points, normals, polygon, begin, a, b, c, h, ring, ear_is
                ):
                    return True, looks
                else:
                    before = h
                h = following
    return False, looks


PRECEDING, FOLLOWING, HOLLOW, TESTED = 0, 1, 2, 3
"""Rows of the ring of corners that are left: the two neighbours, whether the corner is not convex,
and for how many kinds of ear it was tried."""


@kernel
def clip_ears(points, normals, offsets, firsts, polygons, ring, buckets, most, triangles):
    """Cut polygons by clipping ears.

    Parameters
    ----------
    points : (m, 3) float64
        Corners of all polygons.
    normals : (k, 3) float64
    offsets : (k + 1,) int64
        Polygon p has ``points[offsets[p]:offsets[p + 1]]``.
    firsts : (k,) int64
        Where its triangles go.
    polygons : (c,) int64
        The polygons to cut.
    ring : (4, largest polygon) int64
    buckets : Buckets
        Of a single polygon, or one bucket for all of them.
    most : int
        See LOOKS.
    triangles : (sum of sizes - 2, 3) int64
        Result: corners as places within each polygon.
    """
    for index in range(len(polygons)):
        polygon = polygons[index]
        row, begin = firsts[polygon], offsets[polygon]
        size = offsets[polygon + 1] - begin
        buckets.heads[:] = -1
        for i in range(size):
            a, c = (i - 1 if i > 0 else size - 1), (i + 1 if i + 1 < size else 0)
            ring[PRECEDING, i], ring[FOLLOWING, i], ring[TESTED, i] = a, c, 0
            ring[HOLLOW, i] = 0
            if not turn(points, normals, polygon, begin + a, begin + i, begin + c) > ROUNDING:
                ring[HOLLOW, i] = 1
                u = bucket_at(buckets.walls, 0, buckets.places[i, 0])
                v = bucket_at(buckets.walls, 1, buckets.places[i, 1])
                buckets.following[i] = buckets.heads[u, v]
                buckets.heads[u, v] = i
        left, b, waited, ear_is, has_changed = size, 1, 0, STRICT, False
        looks = 0
        while left > 2:
            looks += 1
            a, c = ring[PRECEDING, b], ring[FOLLOWING, b]
            is_ear = ear_is == ANY or left == 3
            if not is_ear and ring[TESTED, b] <= ear_is:
                ring[TESTED, b] = ear_is + 1
                area = turn(points, normals, polygon, begin + a, begin + b, begin + c)
                if area > ROUNDING:
                    stands_in_the_way, looked_at = is_blocked(
                        points, normals, polygon, begin, a, b, c, area, ring, buckets, ear_is
                    )
                    is_ear = not stands_in_the_way
                    looks += looked_at
                else:
                    is_ear = area >= -ROUNDING and ear_is >= FLAT
            if not is_ear:
                b = c
                waited += 1
                if waited == left:
                    # Once around. What blocked a corner may be gone since it was tried.
                    waited = 0
                    if has_changed:
                        has_changed = False
                        for i in range(size):
                            ring[TESTED, i] = 0
                    else:
                        ear_is += 1
                ear_is = ANY if looks > most else ear_is
                continue
            triangles[row, 0], triangles[row, 1], triangles[row, 2] = a, b, c
            row += 1
            left -= 1
            waited, has_changed = 0, True
            ear_is = FLAT if ear_is == TOUCHING else ear_is
            ear_is = ANY if looks > most else ear_is
            ring[FOLLOWING, a], ring[PRECEDING, c], ring[HOLLOW, b] = c, a, 0
            ring[TESTED, a] = ring[TESTED, c] = 0
            for i in (a, c):
                before, after = begin + ring[PRECEDING, i], begin + ring[FOLLOWING, i]
                if turn(points, normals, polygon, before, begin + i, after) > ROUNDING:
                    ring[HOLLOW, i] = 0
            b = a
