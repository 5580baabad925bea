"""Which meshes have an inside: those whose edges all have as many sides as other sides.

A point is inside where a line from it to infinity crosses the surface an odd number of times. That
is the same for all lines only if every edge belongs to an even number of triangles: two, in most
meshes. Vertices count as one where their coordinates are the same.
"""

from __future__ import annotations

import numpy as np

from ...errors import InputError


def refuse_if_open(corners: np.ndarray, what: str) -> None:
    """Raise InputError if triangles, (n, 3, 3) float64, have no inside.

    Parameters
    ----------
    what : str
        Begins the message: ``"the mesh of Cube"``.
    """
    if not len(corners):
        raise InputError(f"{what} has no faces; it needs a closed surface")
    edges, counts = edges_of(corners)
    is_open = counts % 2 == 1
    if is_open.any():
        first, second = (
            ", ".join(f"{x:g}" for x in point) for point in edges[is_open.argmax()].tolist()
        )
        one = int(is_open.sum()) == 1
        raise InputError(
            f"{what} is open: {is_open.sum()} of its {len(edges)} edges "
            f"{'has' if one else 'have'} an odd number of faces, the first from ({first}) to "
            f"({second}); fill its holes"
        )


def edges_of(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of triangles, (k, 2, 3), and how many sides of triangles each is, (k,).

    A side between two corners at the same place is none.
    """
    points, vertices = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    ids = vertices.reshape(-1, 3)
    pairs = np.sort(ids[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    edges, counts = np.unique(pairs, axis=0, return_counts=True)
    return points[edges], counts


def turned_outward(corners: np.ndarray) -> np.ndarray:
    """Return triangles, (n, 3, 3), that turn counter-clockwise as seen from outside on the whole.

    A mirror turns all of them round: then the sum of the tetrahedra below them is negative.
    """
    middle = corners.reshape(-1, 3).mean(axis=0)
    a, b, c = (corners - middle).transpose(1, 0, 2)
    return corners if (np.cross(a, b) * c).sum() >= 0.0 else corners[:, ::-1].copy()
