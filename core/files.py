"""Scenes from mesh files, read by trimesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .errors import InputError
from .scene import Scene

MESH_SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")


def load_mesh_file(path: str | Path) -> Scene:
    """Read all triangles of a mesh file, in file order and world space.

    Raises
    ------
    InputError
        If the file is missing, of another kind, or cannot be read.
    """
    path = Path(path)
    if path.suffix.lower() not in MESH_SUFFIXES:
        known = ", ".join(MESH_SUFFIXES)
        raise InputError(f"{path} is of no known kind; scenes are {known}, .blend or sample:NAME")
    if not path.is_file():
        raise InputError(f"there is no file {path}")
    try:
        import trimesh
    except ImportError:
        raise InputError(
            "reading mesh files needs trimesh; install it with: pip install 'accelscope[files]'"
        ) from None
    try:
        # process=False keeps every triangle, in the order of the file.
        loaded = trimesh.load(path, process=False, maintain_order=True)
        pieces = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
        meshes = [piece for piece in pieces if isinstance(piece, trimesh.Trimesh)]
        triangles = [np.asarray(mesh.vertices)[mesh.faces] for mesh in meshes]
    except MemoryError:
        raise
    except Exception as error:
        # Each of trimesh's readers raises what it likes on a broken file.
        raise InputError(f"{path} cannot be read: {type(error).__name__}: {error}") from error
    if not triangles or not sum(map(len, triangles)):
        raise InputError(f"{path} has no triangles; choose a mesh with faces")
    names = tuple(
        str(mesh.metadata.get("name") or mesh.metadata.get("file_name") or path.stem)
        for mesh in meshes
    )
    return Scene.from_triangles(
        np.concatenate(triangles),
        path.stem,
        str(path),
        object_ids=np.repeat(np.arange(len(meshes)), [len(each) for each in triangles]),
        object_names=names,
    )
