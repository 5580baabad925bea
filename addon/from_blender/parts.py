"""The parts of a Blender scene: one mesh each, of an object or of an instance of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

Key = tuple[int, int]
"""Identity of what a part comes from: session ids of the instancing object (0 if there is none)
and of the object itself. They survive renaming and undo."""


class LocalMesh(NamedTuple):
    """The faces of one evaluated mesh in its own space.

    Attributes
    ----------
    positions : (n_vertices, 3) float32
    corners : (sum of sizes,) int32
        Vertex indices of the faces, one face after the other.
    sizes : (n_faces,) int32
        How many corners each has; Blender has none of fewer than three.
    digest : bytes
        See :func:`.fingerprint.hash_of`.
    """

    positions: np.ndarray
    corners: np.ndarray
    sizes: np.ndarray
    digest: bytes

    @property
    def n_triangles(self) -> int:
        """How many triangles the faces are cut into."""
        return len(self.corners) - 2 * len(self.sizes)


@dataclass(frozen=True)
class Part:
    """One mesh in the scene: an object, or one instance of it."""

    key: Key
    name: str
    mesh: LocalMesh
    matrix: np.ndarray  # (4, 4) float64, to world space
