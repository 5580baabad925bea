"""The parts of a Blender scene: one mesh each, of an object or of an instance of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.geometry.csg.description import Node
from ...core.geometry.instance_settings import PLAIN, InstanceSettings

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
    slots : (n_faces,) int32 or None
        Which material slot each is of; None if all are of the first.
    """

    positions: np.ndarray
    corners: np.ndarray
    sizes: np.ndarray
    digest: bytes
    slots: np.ndarray | None = None

    @property
    def n_triangles(self) -> int:
        """How many triangles the faces are cut into."""
        return len(self.corners) - 2 * len(self.sizes)


class Standing(NamedTuple):
    """Items that a mesh stands for, in its own space.

    Attributes
    ----------
    items : tuple of Item
    digest : bytes
        Of their descriptions, or of the mesh that carries them.
    materials : tuple of str or None
        Full names of what the leaves of trees are made of; None if the object's slots say it.
    slots : tuple of int or None
        Which of those each leaf is of.
    """

    items: tuple[Node, ...]
    digest: bytes
    materials: tuple[str, ...] | None = None
    slots: tuple[int, ...] | None = None


@dataclass(frozen=True)
class Part:
    """One mesh in the scene, or what one stands for: an object, or one instance of it.

    Its materials are the full names of those in its slots, "" for none.
    """

    key: Key
    name: str
    mesh: LocalMesh | Standing
    matrix: np.ndarray  # (4, 4) float64, to world space
    materials: tuple[str, ...] = ()
    descriptor: InstanceSettings = PLAIN
