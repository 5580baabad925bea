"""Icosphere: a sphere of nearly equal triangles, made by halving the edges of an icosahedron."""

from __future__ import annotations

import itertools

import numpy as np


def icosphere_triangle_count(subdivisions: int) -> int:
    """Return the number of triangles of :func:`icosphere`; 0 for 0 subdivisions."""
    return 20 * 4 ** (subdivisions - 1) if subdivisions else 0


def icosphere(subdivisions: int) -> np.ndarray:
    """Return an approximation of the unit sphere with its vertices on the sphere.

    Parameters
    ----------
    subdivisions : int
        1 is the icosahedron; from 2 on, the six points on the axes are vertices, so that the box
        around the triangles is that of the sphere.

    Returns
    -------
    (20 * 4**(subdivisions - 1), 3, 3) float64
        Triangles, counter-clockwise seen from outside.
    """
    triangles = _icosahedron()
    for _ in range(subdivisions - 1):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = _normalised(a + b), _normalised(b + c), _normalised(c + a)
        children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.stack([np.stack(child, axis=1) for child in children], axis=1)
        triangles = triangles.reshape(-1, 3, 3)
    return triangles


def _icosahedron() -> np.ndarray:
    """Return the 20 triangles of the icosahedron with vertices (0, ±1, ±phi) and cyclic shifts."""
    phi = (1.0 + np.sqrt(5.0)) / 2.0
    first = np.array([(0.0, y, z) for y in (-1.0, 1.0) for z in (-phi, phi)])
    points = np.concatenate([np.roll(first, shift, axis=1) for shift in range(3)])
    # The faces are the triples of points at edge length 2 of each other.
    adjacent = np.isclose(np.linalg.norm(points[:, None] - points, axis=2), 2.0)
    triples = [
        (i, j, k)
        for i, j, k in itertools.combinations(range(12), 3)
        if adjacent[i, j] and adjacent[j, k] and adjacent[k, i]
    ]
    triangles = points[np.array(triples)]
    inward = np.linalg.det(triangles) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return _normalised(triangles)


def _normalised(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
