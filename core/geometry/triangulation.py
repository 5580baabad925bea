"""Triangulation: polygons as n - 2 triangles each, in the order of the polygons.

Mesh files and Blender give polygons; rays are tested against triangles. All polygons are cut here,
so that a triangle has one number however its mesh came: of quads, the k-th gives triangles 2k and
2k + 1.

A convex polygon is a fan from its first corner, and so is any other whose fan has no triangle
turned over. Of quads where the first diagonal lies outside, the other diagonal is taken; this is
what Blender does. All other polygons are cut by clipping ears: a convex corner with no other corner
in the triangle that it makes with its two neighbours is cut off, until three corners are left. Left
and right are told by the polygon's normal (the sum of Newell), so a polygon need not be flat.

G. H. Meisters: Polygons Have Ears, The American Mathematical Monthly 82(6), 1975.
"""

from __future__ import annotations

import numpy as np

from ..kernels import call, inner, kernel

ROUNDING = 1e-14
"""How far from zero rounding may bring the area of a triangle that lies on a line, where no side is
longer than the polygon, whose extent is at most 2. Less than that is taken for zero."""

BLOCK = 1 << 16  # polygons looked at at a time, so that the corners stay in the processor's cache


def triangulate(positions: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the triangles of polygons, corners as indices.

    A polygon of n corners gives n - 2 triangles, whatever its shape, and none if n < 3. They cover
    a flat polygon without crossings exactly once, also one whose corners lie on one line or fall
    together in places.

    Parameters
    ----------
    positions : (n_vertices, 3) float
    corners : (sum of sizes,) int
        Vertex indices, polygon after polygon; each has to be one of `positions`.
    sizes : (n_polygons,) int
        How many corners each polygon has.

    Returns
    -------
    (n, 3) of the dtype of `corners`
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3)
    sizes = sizes.astype(np.int64, copy=False)
    begins = np.cumsum(sizes) - sizes
    counts = np.maximum(sizes - 2, 0)
    firsts = np.cumsum(counts) - counts
    out = np.empty((int(counts.sum()), 3), dtype=corners.dtype)
    those = np.flatnonzero(sizes == 3)
    out[firsts[those]] = corners[begins[those, None] + np.arange(3)]
    # NaN and infinite corners may give anything: their triangles are dropped later.
    with np.errstate(all="ignore"):
        for those in _blocks(np.flatnonzero(sizes == 4)):
            quads = corners[begins[those, None] + np.arange(4)]
            out[firsts[those, None] + np.arange(2)] = _halves(positions, quads)
        for those in _blocks(np.flatnonzero(sizes > 4)):
            local = _of_larger(positions, corners, begins[those], sizes[those])
            owners = np.repeat(np.arange(len(those)), counts[those])
            rows = _ranges(firsts[those], counts[those])
            out[rows] = corners[begins[those][owners, None] + local]
    return out


def _blocks(polygons: np.ndarray) -> list[np.ndarray]:
    return [polygons[k : k + BLOCK] for k in range(0, len(polygons), BLOCK)]


def _ranges(begins: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the numbers ``begin, ..., begin + size - 1`` of all ranges, one after the other."""
    ends = np.cumsum(sizes)
    return np.arange(ends[-1]) + np.repeat(begins - ends + sizes, sizes)


def _unit(largest: np.ndarray) -> np.ndarray:
    """Return the power of two to multiply by so that `largest` becomes about 1.

    Products of many lengths neither overflow then nor vanish, and no bit of a corner is lost.
    """
    return np.ldexp(1.0, -np.frexp(largest)[1])


def _halves(positions: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Return the two triangles of each quad, (k, 2, 3), for vertex indices (k, 4)."""
    points = positions[quads].astype(np.float64, copy=False)
    # Sides from corner 0 to the others: axis, side, quad.
    sides = np.ascontiguousarray((points[:, 1:] - points[:, :1]).transpose(2, 1, 0))
    sides *= _unit(np.abs(sides).max(axis=(0, 1)))
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = sides
    # Seen from corner 0: are corners 1 and 3 on one side of the diagonal to corner 2?
    same = (ay * bz - az * by) * (cy * bz - cz * by)
    same += (az * bx - ax * bz) * (cz * bx - cx * bz)
    same += (ax * by - ay * bx) * (cx * by - cy * bx)
    halves = quads[:, [[0, 1, 2], [0, 2, 3]]]
    outside = np.flatnonzero(same > 0.0)
    if len(outside):
        halves[outside] = quads[outside][:, [[0, 1, 3], [1, 2, 3]]]
    return halves


def _of_larger(
    positions: np.ndarray, corners: np.ndarray, begins: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    """Return the triangles of polygons of more than four corners, as places within each polygon."""
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    owners = np.repeat(np.arange(len(sizes)), sizes)
    points = positions[corners[_ranges(begins, sizes)]].astype(np.float64)
    points -= points[offsets[owners]]
    points *= _unit(np.maximum.reduceat(np.abs(points).max(axis=1), offsets[:-1]))[owners, None]
    following = np.arange(1, len(points) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    crossed = np.cross(points, points[following])
    normals = np.add.reduceat(crossed, offsets[:-1], axis=0)
    normals /= np.maximum(np.abs(normals).max(axis=1, keepdims=True), np.finfo(np.float64).tiny)
    # The fan from corner 0, which is the origin: all triangles but two that have no area.
    turns = np.einsum("ij,ij->i", crossed, normals[owners])
    turns[offsets[:-1]] = turns[offsets[1:] - 1] = np.inf
    is_fan = np.minimum.reduceat(turns, offsets[:-1]) > 0.0
    second = _ranges(np.ones(len(sizes), dtype=np.int64), sizes - 2)
    triangles = np.stack([np.zeros_like(second), second, second + 1], axis=1)
    others = np.flatnonzero(~is_fan)
    if len(others):
        ring = np.empty((4, int(sizes[others].max())), dtype=np.int64)
        firsts = offsets[:-1] - 2 * np.arange(len(sizes))
        call(
            clip_ears,
            points,
            normals,
            offsets,
            firsts,
            others,
            ring,
            np.empty_like(ring[0]),
            triangles,
        )
    return triangles


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
def is_blocked(points, normals, polygon, begin, a, b, c, ring, hollows, n_hollows, ear_is):
    """Say whether the outline comes into the triangle of corner b and its neighbours a and c.

    Then it does so at a hollow corner, one that is not convex.
    """
    for k in range(n_hollows):
        h = hollows[k]
        if not ring[HOLLOW, h] or h in (a, c):
            continue
        if coincide(points, begin + h, begin + b):
            # The outline passes b a second time: is it inside before or after?
            for side in range(2):
                q = begin + ring[side, h]
                if (
                    turn(points, normals, polygon, begin + b, begin + c, q) > ROUNDING
                    and turn(points, normals, polygon, begin + b, q, begin + a) > ROUNDING
                ):
                    return True
            continue
        # From a or c the outline cannot leave the triangle again but through the side a c, and so
        # it has a corner inside.
        if coincide(points, begin + h, begin + a) or coincide(points, begin + h, begin + c):
            continue
        u = turn(points, normals, polygon, begin + a, begin + b, begin + h)
        v = turn(points, normals, polygon, begin + b, begin + c, begin + h)
        w = turn(points, normals, polygon, begin + c, begin + a, begin + h)
        least = ROUNDING if ear_is == TOUCHING else -ROUNDING
        if u >= least and v >= least and w >= least:
            return True
    return False


PRECEDING, FOLLOWING, HOLLOW, TESTED = 0, 1, 2, 3
"""Rows of the ring of corners that are left: the two neighbours, whether the corner is not convex,
and for how many kinds of ear it was tried."""


@kernel
def clip_ears(points, normals, offsets, firsts, polygons, ring, hollows, triangles):
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
    hollows : (largest polygon,) int64
    triangles : (sum of sizes - 2, 3) int64
        Result: corners as places within each polygon.
    """
    for index in range(len(polygons)):
        polygon = polygons[index]
        row, begin = firsts[polygon], offsets[polygon]
        size = offsets[polygon + 1] - begin
        n_hollows = 0
        for i in range(size):
            a, c = (i - 1 if i > 0 else size - 1), (i + 1 if i + 1 < size else 0)
            ring[PRECEDING, i], ring[FOLLOWING, i], ring[TESTED, i] = a, c, 0
            ring[HOLLOW, i] = 0
            if not turn(points, normals, polygon, begin + a, begin + i, begin + c) > ROUNDING:
                ring[HOLLOW, i] = 1
                hollows[n_hollows] = i
                n_hollows += 1
        left, b, waited, ear_is, has_changed = size, 1, 0, STRICT, False
        while left > 2:
            a, c = ring[PRECEDING, b], ring[FOLLOWING, b]
            is_ear = ear_is == ANY or left == 3
            if not is_ear and ring[TESTED, b] <= ear_is:
                ring[TESTED, b] = ear_is + 1
                area = turn(points, normals, polygon, begin + a, begin + b, begin + c)
                if area > ROUNDING:
                    is_ear = not is_blocked(
                        points, normals, polygon, begin, a, b, c, ring, hollows, n_hollows, ear_is
                    )
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
                continue
            triangles[row, 0], triangles[row, 1], triangles[row, 2] = a, b, c
            row += 1
            left -= 1
            waited, has_changed = 0, True
            ear_is = FLAT if ear_is == TOUCHING else ear_is
            ring[FOLLOWING, a], ring[PRECEDING, c], ring[HOLLOW, b] = c, a, 0
            ring[TESTED, a] = ring[TESTED, c] = 0
            for i in (a, c):
                before, after = begin + ring[PRECEDING, i], begin + ring[FOLLOWING, i]
                if turn(points, normals, polygon, before, begin + i, after) > ROUNDING:
                    ring[HOLLOW, i] = 0
            b = a
