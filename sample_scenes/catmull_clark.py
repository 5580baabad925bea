"""Catmull-Clark subdivision: any polygon mesh becomes quads that approach a smooth surface.

One step places a point in every face (the mean of its corners), a point on every edge (the mean of
its ends and of the points of its two faces) and moves every vertex to (F + 2 R + (n - 3) P) / n,
where n is its number of edges, F the mean of its face points, R the mean of the midpoints of its
edges and P its old place. Every corner of a face then becomes a quad. Open boundaries follow the
cubic B-spline curve of their own vertices.

Sources: Catmull and Clark, Recursively generated B-spline surfaces on arbitrary topological meshes,
Computer-Aided Design 10(6), 1978; boundaries after DeRose, Kass and Truong, Subdivision surfaces in
character animation, SIGGRAPH 1998.
"""

from __future__ import annotations

import numpy as np


def subdivide(
    points: np.ndarray, corners: np.ndarray, sizes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mesh after one step of subdivision.

    Parameters
    ----------
    points : (n, 3) float64
    corners : (sum of sizes,) int
        Vertex indices, face after face; all faces of a closed part turn the same way.
    sizes : (f,) int
        Corners per face. An edge belongs to one face (boundary) or two, and no vertex is unused.

    Returns
    -------
    points : (n + edges + f, 3) float64
        Moved vertices, then edge points, then face points.
    corners, sizes
        The quads, all of size 4; those of one face stay together, in the order of its corners.
    """
    n, f = len(points), len(sizes)
    last = np.cumsum(sizes) - 1
    first = last - sizes + 1
    face_of_corner = np.repeat(np.arange(f), sizes)
    following = np.arange(1, len(corners) + 1)
    following[last] = first
    preceding = np.arange(-1, len(corners) - 1)
    preceding[first] = last

    # Edge of each corner: the one to the following corner, the same for both of its faces.
    ends = np.stack([corners, corners[following]], axis=1).astype(np.int64)
    keys = ends.min(axis=1) * n + ends.max(axis=1)
    edges, edge_of_corner = np.unique(keys, return_inverse=True)
    tails, heads = edges // n, edges % n
    on_boundary = np.bincount(edge_of_corner) == 1

    face_points = _sum_by(face_of_corner, points[corners], f) / sizes[:, None]

    midpoints = (points[tails] + points[heads]) / 2.0
    face_sums = _sum_by(edge_of_corner, face_points[face_of_corner], len(edges))
    edge_points = np.where(on_boundary[:, None], midpoints, (2.0 * midpoints + face_sums) / 4.0)

    valences = (np.bincount(tails, minlength=n) + np.bincount(heads, minlength=n))[:, None]
    face_counts = np.bincount(corners, minlength=n)[:, None]
    face_means = _sum_by(corners, face_points[face_of_corner], n) / face_counts
    edge_means = (_sum_by(tails, midpoints, n) + _sum_by(heads, midpoints, n)) / valences
    moved = (face_means + 2.0 * edge_means + (valences - 3.0) * points) / valences

    # A boundary vertex goes to 1/8, 3/4, 1/8 of its neighbours along the boundary and itself,
    # which in terms of the two midpoints is half itself and a quarter of each.
    rim = np.flatnonzero(on_boundary)
    rim_sums = _sum_by(tails[rim], midpoints[rim], n) + _sum_by(heads[rim], midpoints[rim], n)
    rim_vertices = np.union1d(tails[rim], heads[rim])
    moved[rim_vertices] = points[rim_vertices] / 2.0 + rim_sums[rim_vertices] / 4.0

    quads = np.stack(
        [corners, n + edge_of_corner, n + len(edges) + face_of_corner,
         n + edge_of_corner[preceding]],
        axis=1,
    )  # fmt: skip
    # The child at corner i of a quad starts so that this corner is its own i-th, as in OpenSubdiv:
    # all children turn alike, and their diagonals run parallel when they are cut into triangles.
    place = np.arange(len(corners)) - first[face_of_corner]
    turn = np.where(sizes[face_of_corner] == 4, place, 0)
    quads = np.take_along_axis(quads, (np.arange(4) - turn[:, None]) % 4, axis=1)
    return (
        np.concatenate([moved, edge_points, face_points]),
        quads.reshape(-1),
        np.full(len(corners), 4),
    )


def triangulate(points: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the faces as triangles, each polygon as a fan from its first corner.

    A quad that folds over along that diagonal is cut along the other one, as Blender does.

    Returns
    -------
    (sum of (sizes - 2), 3) int
        Vertex indices, in the order of the faces.
    """
    counts = sizes - 2
    first_triangle = np.cumsum(counts) - counts
    face = np.repeat(np.arange(len(sizes)), counts)
    start = (np.cumsum(sizes) - sizes)[face]
    step = np.arange(len(face)) - first_triangle[face]
    triangles = np.stack([corners[start], corners[start + step + 1], corners[start + step + 2]], 1)

    p = points[triangles]
    normals = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    one = first_triangle[sizes == 4]
    folded = one[np.einsum("ij,ij->i", normals[one], normals[one + 1]) < 0.0]
    triangles[folded, 2] = triangles[folded + 1, 2]  # (0, 1, 2), (0, 2, 3) becomes
    triangles[folded + 1, 0] = triangles[folded, 1]  # (0, 1, 3), (1, 2, 3)
    return triangles


def _sum_by(index: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Return the sums of the rows of `values` that share an index, (count, 3)."""
    columns = [np.bincount(index, column, minlength=count) for column in values.T]
    return np.stack(columns, axis=1)
