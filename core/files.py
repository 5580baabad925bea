"""Scenes from mesh files, their triangles in the order of the file.

trimesh reads OBJ, STL and glTF. PLY is read by plyfile and OFF here, for trimesh sorts faces by
their number of corners, and the number of a triangle is how other programs know it. A polygon of n
corners is cut into n - 2 triangles, a fan from its first corner.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .errors import InputError
from .scene import Scene


class Piece(NamedTuple):
    """The triangles of one object of a file, (n, 3, 3) float64 in world space."""

    name: str
    triangles: np.ndarray


def load_mesh_file(path: str | Path) -> Scene:
    """Read all triangles of a mesh file, in file order and world space.

    Raises
    ------
    InputError
        If the file is missing, of another kind, or cannot be read.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(READERS)
        raise InputError(f"{path} is of no known kind; scenes are {known}, .blend or sample:NAME")
    if not path.is_file():
        raise InputError(f"there is no file {path}")
    try:
        pieces = reader(path)
    except ImportError as error:
        raise InputError(
            f"reading {path} needs {error.name}; install it with: pip install 'accelscope[files]'"
        ) from None
    except MemoryError:
        raise
    except Exception as error:
        # Each of the readers raises what it likes on a broken file.
        raise InputError(f"{path} cannot be read: {type(error).__name__}: {error}") from error
    counts = [len(piece.triangles) for piece in pieces]
    if not sum(counts):
        raise InputError(f"{path} has no triangles; choose a mesh with faces")
    return Scene.from_triangles(
        np.concatenate([piece.triangles for piece in pieces]),
        path.stem,
        str(path),
        object_ids=np.repeat(np.arange(len(pieces)), counts),
        object_names=tuple(piece.name for piece in pieces),
    )


def fans(polygons: Sequence[Sequence[int]]) -> np.ndarray:
    """Return the triangles, (n, 3) int64, of polygons, given by the indices of their corners."""
    triangles = [
        (polygon[0], polygon[n], polygon[n + 1])
        for polygon in polygons
        for n in range(1, len(polygon) - 1)
    ]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def corners_of(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the corner positions of faces; an index that no vertex has is an error."""
    if faces.size and not (faces.min() >= 0 and faces.max() < len(vertices)):
        raise ValueError(f"a face names vertex {faces.max()} of {len(vertices)}")
    return np.asarray(vertices, dtype=np.float64)[faces]


def read_off(path: Path) -> list[Piece]:
    """Read an OFF file: counts, vertices, then faces as a number of corners and their indices."""
    lines = (line.partition("#")[0].split() for line in path.read_text().splitlines())
    rows = [words for words in lines if words]
    if rows and rows[0][0].endswith("OFF"):
        rows[0] = rows[0][1:]  # the counts may stand on the same line
        rows = rows if rows[0] else rows[1:]
    n_vertices, n_faces = int(rows[0][0]), int(rows[0][1])
    if len(rows) < 1 + n_vertices + n_faces:
        raise ValueError(f"{n_vertices} vertices and {n_faces} faces are announced, not all follow")
    vertices = np.array([row[:3] for row in rows[1 : 1 + n_vertices]], dtype=np.float64)
    polygons = []
    for row in rows[1 + n_vertices : 1 + n_vertices + n_faces]:
        polygons.append([int(word) for word in row[1 : 1 + int(row[0])]])  # colours may follow
        if len(polygons[-1]) != int(row[0]):
            raise ValueError(f"a face of {row[0]} corners names {len(polygons[-1])}")
    return [Piece(path.stem, corners_of(vertices.reshape(-1, 3), fans(polygons)))]


def read_ply(path: Path) -> list[Piece]:
    """Read a PLY file, ASCII or binary."""
    from plyfile import PlyData, PlyParseError

    try:
        # Much faster where it is true; PLY says of every face how many corners it has.
        all_three = {"face": {"vertex_indices": 3, "vertex_index": 3}}
        data = PlyData.read(path, known_list_len=all_three)
    except PlyParseError:
        data = PlyData.read(path)
    vertex = data["vertex"]
    vertices = np.stack([vertex["x"], vertex["y"], vertex["z"]], axis=1)
    if "face" not in data:
        return []
    names = [prop.name for prop in data["face"].properties]
    indices = data["face"]["vertex_indices" if "vertex_indices" in names else "vertex_index"]
    faces = indices if indices.ndim == 2 and indices.shape[1] == 3 else fans(indices)
    return [Piece(path.stem, corners_of(vertices, np.asarray(faces, dtype=np.int64)))]


def read_obj(path: Path) -> list[Piece]:
    """Read an OBJ file, one piece per run of faces with the same material."""
    import trimesh

    # Without group_material=False faces of one material would be gathered; with it trimesh gives
    # the runs from the last to the first.
    loaded = trimesh.load(path, process=False, maintain_order=True, group_material=False)
    return _pieces(loaded)[::-1]


def read_stl(path: Path) -> list[Piece]:
    """Read an STL file, ASCII or binary."""
    import trimesh

    return _pieces(trimesh.load(path, process=False))


def read_gltf(path: Path) -> list[Piece]:
    """Read a glTF file, one piece per primitive of every node."""
    import trimesh

    scene = trimesh.load(path, process=False)
    # trimesh takes the nodes from the end of the file's list, but the primitives of one node, which
    # it hangs below that node, in order.
    graph = scene.graph

    def node_of(name: str) -> str:
        parent = graph.transforms.parents.get(name, name)
        return parent if name.startswith(f"{parent}_") else name

    groups = [list(group) for _, group in itertools.groupby(graph.nodes_geometry, node_of)]
    names = [name for group in reversed(groups) for name in group]
    pieces = {piece.name: piece for piece in _pieces(scene)}
    return [pieces[name] for name in names if name in pieces]


def _pieces(loaded: Any) -> list[Piece]:
    """Return the meshes of what trimesh has loaded, moved to their places."""
    import trimesh

    if isinstance(loaded, trimesh.Trimesh):
        loaded = trimesh.Scene(loaded)
    found = []
    for node in loaded.graph.nodes_geometry:
        transform, geometry = loaded.graph[node]
        mesh = loaded.geometry[geometry]
        if isinstance(mesh, trimesh.Trimesh):
            vertices = np.asarray(mesh.vertices, dtype=np.float64)
            if not np.array_equal(transform, np.eye(4)):
                vertices = vertices @ transform[:3, :3].T + transform[:3, 3]
            found.append(Piece(str(node), corners_of(vertices, np.asarray(mesh.faces))))
    return found


READERS: dict[str, Callable[[Path], list[Piece]]] = {
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".off": read_off,
}
"""How a mesh file is read, by its suffix."""
