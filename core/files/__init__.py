"""Scenes from mesh files, their triangles in the order of the file.

One file per format, each written from its specification: readers that others keep lose or move
triangles without a word, and the number of a triangle is how other programs know it. All polygons
are cut by :mod:`..geometry.triangulation`. What is in a file and could be seen, but is not read, is
named in :attr:`.Scene.notes`; what is broken is refused.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..reading import refuse_if_no_file
from ..scene import Scene
from ..scene.material import MATT
from ..scene.placing import KEEP, Mesh, PlacedMesh, scene_of
from .contents import BrokenFile, Contents
from .gltf import read_gltf
from .obj import read_obj
from .off import read_off
from .ply import read_ply
from .stl import read_stl

READERS: dict[str, Callable[[Path], Contents]] = {
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".off": read_off,
}
"""How a mesh file is read, by its suffix."""


def has_triangles(placed: PlacedMesh) -> bool:
    """Say whether the mesh of an object has any."""
    return isinstance(placed.mesh, Mesh) and len(placed.mesh.triangles) > 0


def load_mesh_file(path: str | Path, instances: str = KEEP) -> Scene:
    """Read all triangles of a mesh file, in file order and world space.

    Parameters
    ----------
    instances : {KEEP, OBJECTS, FLATTEN}
        Of meshes that the file has in several places, see :mod:`..scene.placing`.

    Raises
    ------
    InputError
        If the file is missing, of another kind, broken, or needs what is not read.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(READERS)
        raise InputError(f"{path} is of no known kind; scenes are {known}, .blend or sample:NAME")
    refuse_if_no_file(path)
    try:
        # NaN and infinite numbers are no affair: their triangles are dropped and counted.
        with np.errstate(all="ignore"):
            pieces, notes, placed = reader(path)
    except BrokenFile as error:
        raise InputError(f"{path} cannot be read: {error}; {error.cure}") from error
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from None
    counts = [len(piece.triangles) for piece in pieces]
    if not sum(counts) and not any(has_triangles(each) for each in placed):
        also = "".join(f"; {note}" for note in notes)
        raise InputError(f"{path} has no triangles{also}; choose a mesh with faces")
    if placed:
        return scene_of(placed, instances, path.stem, str(path), notes=tuple(notes))
    scene = Scene.from_triangles(
        np.concatenate([piece.triangles for piece in pieces]),
        path.stem,
        str(path),
        object_ids=np.repeat(np.arange(len(pieces)), counts),
        object_names=tuple(piece.name for piece in pieces),
        notes=tuple(notes),
    )
    if not any(piece.material for piece in pieces):
        return scene
    made_of = [piece.material or MATT for piece in pieces]
    numbers = {material: number for number, material in enumerate(dict.fromkeys(made_of))}
    of_pieces = np.array([numbers[each] for each in made_of], dtype=np.int32)
    return dataclasses.replace(
        scene, materials=tuple(numbers), material_ids=of_pieces[scene.object_ids]
    )
