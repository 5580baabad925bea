"""What is measured of triangles (n, 3, 3): areas, volume, whether they close a surface."""

import numpy as np


def areas(triangles):
    return np.linalg.norm(doubled_normals(triangles), axis=1) / 2.0


def doubled_normals(triangles):
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def volume(triangles):
    """Enclosed volume, positive when the triangles turn counter-clockwise seen from outside."""
    return np.einsum("ij,ij->", triangles[:, 0], doubled_normals(triangles)) / 6.0


def numbered_vertices(triangles):
    """Number of the vertex, among the different ones, that each corner is, (n, 3).

    As opaque bytes: ten times faster than np.unique by rows. Adding 0 makes -0 a 0.
    """
    points = np.ascontiguousarray(triangles.reshape(-1, 3) + 0.0)
    _, index = np.unique(points.view(np.dtype((np.void, 24))).ravel(), return_inverse=True)
    return index.reshape(-1, 3)


def edge_uses(triangles):
    """How often each directed edge, named by its bit-exact ends, occurs; and reversed."""
    corners = numbered_vertices(triangles)
    forward = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    key = forward[:, 0] * (corners.max() + 1) + forward[:, 1]
    reverse = forward[:, 1] * (corners.max() + 1) + forward[:, 0]
    return np.unique(key, return_counts=True)[1], np.isin(reverse, key)


def is_closed(triangles):
    once, matched = edge_uses(triangles)
    return bool((once == 1).all() and matched.all())
