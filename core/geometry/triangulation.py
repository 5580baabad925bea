"""Triangulation: polygons as n - 2 triangles each, in the order of the polygons.

Mesh files and Blender give polygons; rays are tested against triangles. All polygons are cut here,
so that a triangle has one number however its mesh came: of quads, the k-th gives triangles 2k and
2k + 1.

A convex polygon is a fan from its first corner, and so is any other whose fan has no triangle
turned over. Of quads where the first diagonal lies outside, the other diagonal is taken; this is
what Blender does. All other polygons are cut by clipping ears (:mod:`.ears`). Left and right are
told by the polygon's normal (the sum of Newell), so a polygon need not be flat.
"""

from __future__ import annotations

import numpy as np

from ..ranges import ranges
from .ears import cut_off_ears

CUTTING = "the cutting of polygons"
"""What the kernels of this do, for the announcement that they are compiled."""

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
            rows = ranges(firsts[those], counts[those])
            out[rows] = corners[begins[those][owners, None] + local]
    return out


def _blocks(polygons: np.ndarray) -> list[np.ndarray]:
    return [polygons[k : k + BLOCK] for k in range(0, len(polygons), BLOCK)]


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
    points = positions[corners[ranges(begins, sizes)]].astype(np.float64)
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
    second = ranges(1, sizes - 2)
    triangles = np.stack([np.zeros_like(second), second, second + 1], axis=1)
    firsts = offsets[:-1] - 2 * np.arange(len(sizes))

    cut_off_ears(points, normals, offsets, firsts, np.flatnonzero(~is_fan), triangles)
    return triangles
