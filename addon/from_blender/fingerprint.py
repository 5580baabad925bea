"""Fingerprints: what objects look like to a ray, to find out later whether they still do.

A fingerprint is made of what Blender has evaluated: positions, corners and faces of meshes, and
the matrices that place them; and of what objects say of themselves as instances. What no ray meets,
such as materials, shading, names and selection, is no part of it.
"""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Iterable
from typing import NamedTuple

import bpy
import numpy as np

from ...core.geometry.instance_settings import InstanceSettings
from .mesh_check import corner_vertices
from .parts import Key, Part

SLICE = 1 << 20
"""Bytes that are hashed between two looks at the clock, in about a millisecond."""

DIGEST_SIZE = 16


class Digest(NamedTuple):
    """What an object, or all instances of one by another, looked like.

    Attributes
    ----------
    name : str
    meshes : tuple of bytes
        A hash of each of its meshes.
    matrices : tuple of bytes
        See :func:`bytes_of_matrix`.
    descriptors : tuple of InstanceSettings
    """

    name: str
    meshes: tuple[bytes, ...]
    matrices: tuple[bytes, ...]
    descriptors: tuple[InstanceSettings, ...]


class MeshHash:
    """The hash of a mesh, taken in slices, so that a large one does not hold Blender up.

    Copying a mesh of a million triangles takes some 30 ms; hashing the copy as long again. Faces
    are hashed, not the triangles they are cut into: those follow from them, and Blender needs ten
    times as long to hand them over.
    """

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        self._digest = hashlib.blake2b(digest_size=DIGEST_SIZE)
        self.is_empty = not len(mesh.polygons)
        arrays = [] if self.is_empty else _arrays_of(mesh)
        self._waiting = [memoryview(array).cast("B") for array in arrays]

    def advance(self, until: float = math.inf) -> bytes | None:
        """Go on until a time of ``time.monotonic()``; return the hash once it is complete.

        That of a mesh without faces is empty.
        """
        while self._waiting:
            first = self._waiting[0]
            self._digest.update(first[:SLICE])
            if len(first) > SLICE:
                self._waiting[0] = first[SLICE:]
            else:
                del self._waiting[0]
            if self._waiting and time.monotonic() > until:
                return None
        return b"" if self.is_empty else self._digest.digest()


def hash_of(mesh: bpy.types.Mesh) -> bytes:
    """Return the hash of a mesh; empty if it has no faces."""
    digest = MeshHash(mesh).advance()
    assert digest is not None
    return digest


def _arrays_of(mesh: bpy.types.Mesh) -> list[np.ndarray]:
    """Return copies of what makes a mesh that has faces; none of them is empty."""
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", positions)
    positions += np.float32(0.0)  # -0 is where 0 is
    corners = corner_vertices(mesh)
    faces = len(mesh.polygons)
    arrays = [np.array([len(mesh.vertices), len(corners), faces]), positions, corners]
    if len(corners) != 3 * faces:
        starts = np.empty(faces, np.int32)
        mesh.polygons.foreach_get("loop_start", starts)
        arrays.append(starts)
    return arrays


def bytes_of_matrix(matrix: np.ndarray) -> bytes:
    """Return a matrix (4, 4) float64 as bytes that are equal where its numbers are."""
    return (matrix + 0.0).tobytes()


def fingerprint(parts: Iterable[Part]) -> dict[Key, Digest]:
    """Return what every object looks like."""
    names: dict[Key, str] = {}
    found: dict[Key, list[tuple[bytes, bytes, InstanceSettings]]] = {}
    for part in parts:
        names.setdefault(part.key, part.name)
        place = part.mesh.digest, bytes_of_matrix(part.matrix), part.descriptor
        found.setdefault(part.key, []).append(place)
    return {
        key: Digest(names[key], *map(tuple, zip(*places, strict=True)))
        for key, places in found.items()
    }


def movement(before: bytes, now: bytes) -> str:
    """Say what has happened to an object whose matrix was another one."""
    old, new = (np.frombuffer(each).reshape(4, 4)[:3, :3] for each in (before, now))
    return "has moved" if np.array_equal(old, new) else "was turned or scaled"
