"""glTF 2.0: a tree of nodes that place meshes, as JSON beside its numbers or in one binary file.

Read are all kinds of triangles, sparse and normalized numbers, the pose at rest (weights of morph
targets, skins), and instances (EXT_mesh_gpu_instancing). One piece is a primitive of a mesh at a
node; nodes come in the order in which the tree of the scene is walked, a node before its children.

Khronos Group: glTF 2.0 Specification, 2021.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..memory import refuse_if_too_large
from .contents import BrokenFile, Contents, NotRead, Piece, counted, triangles_of_strip
from .gltf_accessors import COMPRESSIONS, Document, whole

DRACO = "KHR_draco_mesh_compression"
INSTANCING = "EXT_mesh_gpu_instancing"
LIGHTS = "KHR_lights_punctual"
VISIBILITY = "KHR_node_visibility"

WITHOUT_EFFECT = (
    INSTANCING, LIGHTS, VISIBILITY, "KHR_mesh_quantization", "KHR_materials_", "KHR_texture_",
    "EXT_texture_", "KHR_xmp", "KHR_animation_pointer", "KHR_node_selectability",
    "KHR_node_hoverability", "KHR_audio", "KHR_techniques_webgl", "EXT_lights_",
    "EXT_mesh_features", "EXT_instance_features", "EXT_structural_metadata", "FB_ngon_encoding",
    "MSFT_texture_dds", "MSFT_packing_", "ADOBE_materials_", "GOOGLE_backgrounds", "VRM",
)  # fmt: skip
"""Beginnings of the names of extensions that are read, or that no triangle depends on."""

POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
"""Modes of primitives; between points and triangles are three kinds of lines."""

BYTES_PER_TRIANGLE = 300  # at the peak of making the scene


class Shape(NamedTuple):
    """A primitive of a mesh in its own space.

    Attributes
    ----------
    name : str
        What it adds to the name of its node.
    vertices : (n_vertices, 3) float64
    triangles : (n, 3) int64
    joints, weights : (n_vertices, k) int64 and float64, or None
        By which joints of a skin each vertex is moved.
    """

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    joints: np.ndarray | None
    weights: np.ndarray | None


class Placement(NamedTuple):
    """A shape in the world: one matrix, (1, 4, 4), or one for each joint of its skin."""

    name: str
    shape: Shape
    matrices: np.ndarray


def read_gltf(path: Path) -> Contents:
    """Read a glTF file, ``.gltf`` or ``.glb``."""
    document = Document(path)
    try:
        reader = _Reader(document)
        pieces = list(reader.pieces(path))
        return Contents(pieces, reader.notes())
    except BrokenFile:
        raise
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        # An object where a list should be, a text where a number should be, and the like.
        raise BrokenFile(
            f"its description is not as glTF wants it: {type(error).__name__}: {error}"
        ) from error


class _Reader:
    """Walks the tree of nodes."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.root = document.root
        self._refuse_what_is_not_read()
        self.nodes = self.root.get("nodes", [])
        self._matrices: dict[int, np.ndarray] = {}
        self._shapes: dict[tuple, list[Shape]] = {}
        self._not_drawn: Counter[str] = Counter()
        self._shown: list[int] = []
        self._parents: dict[int, int] = {}
        for parent in range(len(self.nodes)):
            for child in document.entry("nodes", parent).get("children", []):
                document.entry("nodes", child)
                if self._parents.setdefault(int(child), parent) != parent:
                    raise BrokenFile(f"node {child} is the child of two nodes")

    def _refuse_what_is_not_read(self) -> None:
        version = str(self.root.get("asset", {}).get("version"))
        if not version.startswith("2."):
            raise BrokenFile(f"it is of version {version} of glTF, only 2.0 is read")
        needed = [
            name
            for name in self.root.get("extensionsRequired", [])
            if not name.startswith(WITHOUT_EFFECT)
        ]
        if needed:
            raise NotRead(f"it requires {', '.join(needed)}, which is not read")

    def pieces(self, path: Path) -> Iterator[Piece]:
        """Yield the triangles of all nodes of the scene."""
        self._shown = list(self._walk(self._roots()))
        placements = [
            placement
            for node in self._shown
            if "mesh" in self.nodes[node]
            for placement in self._placements(node, path.stem)
        ]
        total = sum(len(placement.shape.triangles) for placement in placements)
        _refuse_if_too_many(total, path)
        for name, shape, matrices in placements:
            yield Piece(name, _moved(shape, matrices)[shape.triangles])

    # ------------------------------------------------------------------------------------- nodes

    def _roots(self) -> list[int]:
        """Return the nodes at the top of the scene that is to be shown."""
        if self.root.get("scenes"):
            scene = self.document.entry("scenes", self.root.get("scene", 0))
            return [whole(node, "a number of nodes") for node in scene.get("nodes", [])]
        return [node for node in range(len(self.nodes)) if node not in self._parents]

    def _walk(self, roots: list[int]) -> Iterator[int]:
        """Yield roots and all that is below them."""
        waiting = roots[::-1]
        met = set()
        while waiting:
            node = waiting.pop()
            entry = self.document.entry("nodes", node)
            if node in met:
                raise BrokenFile(f"node {node} is in the tree of the scene twice")
            met.add(node)
            if not entry.get("extensions", {}).get(VISIBILITY, {}).get("visible", True):
                continue
            yield node
            waiting += [int(child) for child in entry.get("children", [])[::-1]]

    def _matrix(self, node: int) -> np.ndarray:
        """Return the matrix, (4, 4), from a node's space to the world's."""
        chain = []
        above: int | None = node
        while above is not None and above not in self._matrices:
            chain.append(above)
            if len(chain) > len(self.nodes):
                raise BrokenFile(f"node {node} is below itself")
            above = self._parents.get(above)
        matrix = np.eye(4) if above is None else self._matrices[above]
        for below in reversed(chain):
            matrix = matrix @ _local_matrix(self.nodes[below], f"node {below}")
            self._matrices[below] = matrix
        return matrix

    def _placements(self, node: int, stem: str) -> Iterator[Placement]:
        """Yield the shapes at a node, as often as there are instances of it."""
        entry = self.nodes[node]
        mesh = self.document.entry("meshes", entry["mesh"])
        name = str(entry.get("name") or mesh.get("name") or stem)
        shapes = self._shapes_of(int(entry["mesh"]), mesh, entry.get("weights"))
        instancing = entry.get("extensions", {}).get(INSTANCING)
        if instancing is None:
            matrices = self._matrix(node)[None]
            names = [name]
        else:
            matrices = self._matrix(node) @ self._instances(instancing["attributes"])
            names = [f"{name}/{number}" for number in range(len(matrices))]
        per_instance = sum(len(shape.triangles) for shape in shapes)
        _refuse_if_too_many(per_instance * len(matrices), name)
        joints = self._joint_matrices(entry["skin"]) if "skin" in entry else None
        for instance, matrix in zip(names, matrices):
            for shape in shapes:
                moved_by = matrix[None] if joints is None or shape.joints is None else joints
                yield Placement(instance + shape.name, shape, moved_by)

    def _instances(self, attributes: dict) -> np.ndarray:
        """Return the matrices, (n, 4, 4), of EXT_mesh_gpu_instancing."""
        found = {
            name: np.asarray(self.document.accessor(attributes[name], kind), dtype=np.float64)
            for name, kind in (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3"))
            if name in attributes
        }
        counts = {len(values) for values in found.values()}
        if len(counts) != 1:
            raise BrokenFile(f"the attributes of {INSTANCING} are of different lengths, or none")
        count = counts.pop()
        return _composed(
            found.get("TRANSLATION", np.zeros((count, 3))),
            found.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
            found.get("SCALE", np.ones((count, 3))),
        )

    def _joint_matrices(self, index: Any) -> np.ndarray:
        """Return the matrices, (n, 4, 4), by which the joints of a skin move vertices."""
        skin = self.document.entry("skins", index)
        joints = skin["joints"]
        for joint in joints:
            self.document.entry("nodes", joint)
        matrices = np.array([self._matrix(int(joint)) for joint in joints]).reshape(-1, 4, 4)
        if "inverseBindMatrices" in skin:
            columns = self.document.accessor(skin["inverseBindMatrices"], "MAT4")
            if len(columns) < len(joints):
                raise BrokenFile(f"skin {index} has too few inverse bind matrices")
            inverse = columns[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
            matrices = matrices @ inverse
        return matrices

    # ------------------------------------------------------------------------------------ meshes

    def _shapes_of(self, index: int, mesh: dict, weights: list | None) -> list[Shape]:
        """Return the primitives of a mesh that have triangles, for weights of its targets."""
        weights = mesh.get("weights", []) if weights is None else weights
        key = (index, tuple(weights))
        primitives = mesh["primitives"]
        if key not in self._shapes:
            self._shapes[key] = [
                self._shape(primitive, f"/{k}" if len(primitives) > 1 else "", weights, where)
                for k, primitive in enumerate(primitives)
                for where in [f"primitive {k} of mesh {index}"]
                if TRIANGLES <= primitive.get("mode", TRIANGLES) <= FAN
                and "POSITION" in primitive["attributes"]
            ]
        for primitive in primitives:
            mode = primitive.get("mode", TRIANGLES)
            if not isinstance(mode, int) or not POINTS <= mode <= FAN:
                raise BrokenFile(
                    f"mesh {index} has a primitive of mode {mode!r}, which there is not"
                )
            if mode < TRIANGLES:
                self._not_drawn["points" if mode == POINTS else "lines"] += 1
            elif "POSITION" not in primitive["attributes"]:
                self._not_drawn["nothing that has a place"] += 1
        return self._shapes[key]

    def _shape(self, primitive: dict, name: str, weights: list, where: str) -> Shape:
        """Return a primitive of triangles, its targets applied."""
        attributes = primitive["attributes"]
        if DRACO in primitive.get("extensions", {}) and "bufferView" not in self.document.entry(
            "accessors", attributes["POSITION"]
        ):
            raise NotRead(f"{where} is compressed with {DRACO}, which is not read")
        vertices = np.array(self.document.accessor(attributes["POSITION"], "VEC3"), np.float64)
        for weight, target in zip(weights, primitive.get("targets", [])):
            if weight and "POSITION" in target:
                moves = self.document.accessor(target["POSITION"], "VEC3")
                if len(moves) != len(vertices):
                    raise BrokenFile(f"a target of {where} has another number of vertices")
                vertices += float(weight) * moves
        if "indices" in primitive:
            indices = self.document.accessor(primitive["indices"], "SCALAR")[:, 0]
            if indices.dtype.kind != "u":
                raise BrokenFile(f"the indices of {where} are no unsigned integers")
            indices = indices.astype(np.int64)
            if len(indices) and indices.max() >= len(vertices):
                raise BrokenFile(f"{where} names vertex {indices.max()} of {len(vertices)}")
        else:
            indices = np.arange(len(vertices))
        triangles = _triangles(indices, primitive.get("mode", TRIANGLES), where)
        return Shape(name, vertices, triangles, *self._joints(attributes, len(vertices), where))

    def _joints(
        self, attributes: dict, n_vertices: int, where: str
    ) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Return the joints of each vertex and their weights, which add up to 1."""
        joints: list[np.ndarray] = []
        weights: list[np.ndarray] = []
        while f"JOINTS_{len(joints)}" in attributes:
            k = len(joints)
            joints.append(self.document.accessor(attributes[f"JOINTS_{k}"], "VEC4"))
            weights.append(self.document.accessor(attributes[f"WEIGHTS_{k}"], "VEC4"))
            if not len(joints[k]) == len(weights[k]) == n_vertices:
                raise BrokenFile(f"the joints of {where} are of another number than its vertices")
        if not joints:
            return None, None
        shares = np.concatenate(weights, axis=1).astype(np.float64)
        total = shares.sum(axis=1, keepdims=True)
        # A vertex that no joint moves goes with the first of its joints.
        shares[total[:, 0] == 0.0, 0] = 1.0
        total[total == 0.0] = 1.0
        return np.concatenate(joints, axis=1).astype(np.int64), shares / total

    # ------------------------------------------------------------------------------------- notes

    def notes(self) -> list[str]:
        """Return sentences on what is in the file and was not read."""
        notes = [
            f"not read: {counted(count, 'primitive')} of {kind}"
            for kind, count in self._not_drawn.items()
        ]
        shown = set(self._shown)
        hidden = [k for k, node in enumerate(self.nodes) if "mesh" in node and k not in shown]
        if hidden:
            verb = "is" if len(hidden) == 1 else "are"
            notes.append(
                f"{counted(len(hidden), 'node')} with a mesh {verb} not in the scene that the file "
                "shows, or hidden"
            )
        if self.root.get("animations"):
            number = counted(len(self.root["animations"]), "animation")
            notes.append(f"not read: {number}; what they move stands at rest")
        lights = self.root.get("extensions", {}).get(LIGHTS, {}).get("lights", [])
        seen_with = [
            counted(len(entries), kind)
            for kind, entries in (("camera", self.root.get("cameras", [])), ("light", lights))
            if entries
        ]
        if seen_with:
            notes.append(f"not read: {' and '.join(seen_with)}")
        unknown = [
            name
            for name in self.root.get("extensionsUsed", [])
            if not name.startswith((*WITHOUT_EFFECT, DRACO, *COMPRESSIONS))
        ]
        if unknown:
            notes.append(f"not read: what the extensions {', '.join(unknown)} say")
        return notes


def _refuse_if_too_many(count: int, what: str | Path) -> None:
    refuse_if_too_large(
        count * BYTES_PER_TRIANGLE, f"{what} of {count} triangles", "take a part of it"
    )


def _triangles(indices: np.ndarray, mode: int, where: str) -> np.ndarray:
    """Return the triangles, (n, 3), that vertices make in a mode."""
    if mode == STRIP:
        return triangles_of_strip(indices)
    if mode == FAN:
        return np.stack(
            [indices[1:-1], indices[2:], np.repeat(indices[:1], max(len(indices) - 2, 0))], axis=1
        )
    if len(indices) % 3:
        raise BrokenFile(f"{where} has {len(indices)} corners, no multiple of three")
    return indices.reshape(-1, 3)


def _moved(shape: Shape, matrices: np.ndarray) -> np.ndarray:
    """Return the vertices in the world, moved by a matrix or by those of their joints."""
    if shape.joints is None or shape.weights is None or len(matrices) == 1:
        return _by_matrix(shape.vertices, matrices[0])
    if shape.joints.size and shape.joints.max() >= len(matrices):
        raise BrokenFile(f"a vertex names joint {shape.joints.max()} of {len(matrices)}")
    moved = np.zeros_like(shape.vertices)
    for joint in np.unique(shape.joints):
        share = np.where(shape.joints == joint, shape.weights, 0.0).sum(axis=1)
        mine = np.flatnonzero(share)
        moved[mine] += share[mine, None] * _by_matrix(shape.vertices[mine], matrices[joint])
    return moved


def _by_matrix(vertices: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return vertices moved by a matrix, unless that is the identity."""
    if np.array_equal(matrix, np.eye(4)):
        return vertices
    # Infinite coordinates may turn into NaN; such triangles are dropped in any case.
    with np.errstate(invalid="ignore", over="ignore"):
        return vertices @ matrix[:3, :3].T + matrix[:3, 3]


def _local_matrix(node: dict, where: str) -> np.ndarray:
    """Return the matrix, (4, 4), from a node's space to that of the node above."""
    if "matrix" in node:
        return _numbers(node["matrix"], 16, f"the matrix of {where}").reshape(4, 4).T
    return _composed(
        _numbers(node.get("translation", [0, 0, 0]), 3, f"the translation of {where}")[None],
        _numbers(node.get("rotation", [0, 0, 0, 1]), 4, f"the rotation of {where}")[None],
        _numbers(node.get("scale", [1, 1, 1]), 3, f"the scale of {where}")[None],
    )[0]


def _numbers(values: Any, count: int, what: str) -> np.ndarray:
    if not isinstance(values, list) or len(values) != count:
        raise BrokenFile(f"{what} is not {count} numbers")
    return np.array([float(value) for value in values])


def _composed(moves: np.ndarray, rotations: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Return matrices, (n, 4, 4), that scale, then rotate by quaternions x, y, z, w, then move."""
    length = np.linalg.norm(rotations, axis=1, keepdims=True)
    x, y, z, w = (rotations / np.where(length > 0.0, length, 1.0)).T
    matrices = np.zeros((len(moves), 4, 4))
    matrices[:, 0, 0], matrices[:, 1, 1] = 1 - 2 * (y * y + z * z), 1 - 2 * (x * x + z * z)
    matrices[:, 2, 2], matrices[:, 3, 3] = 1 - 2 * (x * x + y * y), 1
    matrices[:, 0, 1], matrices[:, 1, 0] = 2 * (x * y - z * w), 2 * (x * y + z * w)
    matrices[:, 0, 2], matrices[:, 2, 0] = 2 * (x * z + y * w), 2 * (x * z - y * w)
    matrices[:, 1, 2], matrices[:, 2, 1] = 2 * (y * z - x * w), 2 * (y * z + x * w)
    matrices[:, :3, :3] *= scales[:, None]
    matrices[:, :3, 3] = moves
    return matrices
