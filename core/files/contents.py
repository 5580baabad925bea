"""What the readers of mesh files return, and how they refuse."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry.triangulation import triangulate
from ..scene.material import Material
from ..scene.placing import PlacedMesh

MORE_THAN_ANY = 1 << 63
"""A count beyond that of anything in a file, and of what an index of 64 bits can hold."""


class BrokenFile(ValueError):
    """What a file says is against its format; the message names the place."""

    cure = "repair it, or export it again"


class NotRead(BrokenFile):
    """What a file needs is not read; the message names it."""

    cure = "export it again, without that"


class Piece(NamedTuple):
    """The triangles of one object of a file, (n, 3, 3) float64 in world space.

    What it is made of is None where the file does not say it.
    """

    name: str
    triangles: np.ndarray
    material: Material | None = None


class Contents(NamedTuple):
    """What was read from a file, and sentences that name what was not.

    A file has pieces, or meshes in places.
    """

    pieces: list[Piece]
    notes: list[str]
    placed: list[PlacedMesh] = []  # noqa: RUF012  nobody adds to it


def counted(count: int, singular: str, plural: str = "") -> str:
    """Return a number and what is counted, such as ``"1 face"`` or ``"2 faces"``."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def note_small_faces(sizes: np.ndarray) -> list[str]:
    """Return what is to be said about faces of fewer than three corners."""
    small = int((sizes < 3).sum())
    if not small:
        return []
    has = "has" if small == 1 else "have"
    return [f"{counted(small, 'face')} {has} fewer than three corners and no area"]


def triangles_of_faces(vertices: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the triangles, (n, 3, 3) float64, of faces.

    Parameters
    ----------
    vertices : (n_vertices, 3) float
    corners : (sum of sizes,) int
        Vertex indices, face after face.
    sizes : (n_faces,) int

    Raises
    ------
    BrokenFile
        Naming the first face with a vertex that there is not, counted from 1.
    """
    wrong = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(sizes), wrong[0], side="right")) + 1
        raise BrokenFile(
            f"face {face} names vertex {corners[wrong[0]]}, but the {len(vertices)} vertices count "
            "from 0"
        )
    vertices = np.asarray(vertices, dtype=np.float64)
    return vertices[triangulate(vertices, corners, sizes)]


def triangles_of_strip(indices: np.ndarray) -> np.ndarray:
    """Return the triangles, (n - 2, 3), of a strip of n vertices; all turn the same way."""
    triangles = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    triangles[1::2, 1:] = triangles[1::2, :0:-1]
    return triangles
