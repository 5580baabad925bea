"""The bottom levels: a structure for each mesh, built, kept, or following what has moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...contract.structure import Structure
from ...errors import InputError
from ...geometry.geometry import boxes_around
from ...geometry.instances import Instanced
from ...geometry.triangles import Triangles
from ...progress import Progress
from ...scene import Scene
from ..bvh import BVH
from .forests import forest_of_structures


class BottomLevels:
    """Makes the structures of meshes, and remembers them.

    Attributes
    ----------
    made : list of (mesh, Structure)
        In the order of the forest.
    """

    def __init__(
        self, scene: Scene, kind: type[Structure], settings: Any, known: Sequence[Any] = ()
    ) -> None:
        self.made: list[tuple[Any, Structure]] = []
        self._scene, self._kind, self._settings = scene, kind, settings
        self._known = list(known)

    def __call__(self, meshes: Sequence[Any], progress: Progress) -> tuple[Any, np.ndarray, Any]:
        """Return a forest of the structures of meshes."""
        for number, mesh in enumerate(meshes):
            progress.report(number, len(meshes), "Building bottom levels")
            self.made.append((mesh, self._structure_of(number, mesh)))
        progress.report(len(meshes), len(meshes), "Building bottom levels")
        return forest_of_structures([structure for _, structure in self.made])

    def _structure_of(self, number: int, mesh: Any) -> Structure:
        """Build one; or keep it, or let it follow, if there is one that was built before."""
        scene = scene_of_mesh(mesh, f"{self._scene.name}, mesh {number}")
        if number < len(self._known):
            before, structure = self._known[number]
            if is_same(before, mesh):
                return structure
            if isinstance(structure, BVH) and len(before.ids) == len(mesh.ids):
                try:
                    return structure.refitted(scene)
                except InputError:  # spatial splits do not follow
                    pass
        return self._kind.build(scene, self._settings)


def is_same(before: Any, mesh: Any) -> bool:
    """Say whether two meshes have the same items in the same places."""
    return before is mesh or (
        isinstance(before, Triangles)
        and isinstance(mesh, Triangles)
        and np.array_equal(before.corners, mesh.corners)
    )


def scene_of_mesh(mesh: Any, name: str) -> Scene:
    """Return a scene that is a mesh, in its own space; none of its items are left out."""
    boxes = boxes_around(mesh)
    lower, upper = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    if np.array_equal(lower, upper):  # what is a point is never hit, but cells want some room
        lower, upper = lower - 1.0, upper + 1.0
    count = len(mesh.ids)
    return Scene(
        name, name, mesh, np.arange(count, dtype=np.int32), 0, np.zeros(count, np.int32), (name,),
        lower, upper,
    )  # fmt: skip


def unshared(geometry: Instanced) -> Instanced:
    """Return the same instances, each of a mesh of its own."""
    return geometry._replace(
        meshes=tuple(geometry.meshes[number] for number in geometry.which),
        which=np.arange(len(geometry.ids), dtype=np.int32),
    )
