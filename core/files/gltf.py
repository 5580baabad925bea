"""glTF 2.0: a tree of nodes that place meshes, as JSON beside its numbers or in one binary file.

Read are all kinds of triangles, sparse and normalized numbers, the pose at rest (weights of morph
targets, skins), and instances (EXT_mesh_gpu_instancing). One object is a primitive of a mesh at a
node; all nodes that have it share its triangles, but for those that a skin moves. Nodes come in the
order in which the tree of the scene is walked, a node before its children.

Not read by trimesh: it leaves out sparse and normalized numbers, fans, instances, morph targets and
skins without a word, and reads on where an extension is required that it does not know.

Khronos Group: glTF 2.0 Specification, 2021. The tree is in :mod:`.gltf_nodes`, numbers are in
:mod:`.gltf_accessors`.
"""

from __future__ import annotations

import reprlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..memory import Tally
from ..scene.material import Material
from ..scene.placing import Mesh, PlacedMesh
from .contents import BrokenFile, Contents, NotRead, counted, triangles_of_strip
from .gltf_accessors import COMPRESSIONS, Document, real
from .gltf_materials import Materials
from .gltf_nodes import (
    BYTES_PER_INSTANCE,
    INSTANCING,
    VISIBILITY,
    Nodes,
    moved_by_joints,
)

DRACO = "KHR_draco_mesh_compression"
LIGHTS = "KHR_lights_punctual"

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

MALFORMED = (
    AttributeError, IndexError, KeyError, OverflowError, RecursionError, TypeError, ValueError,
)  # fmt: skip
"""What an object where a list should be raises, a text where a number should be, and the like."""


class Shape(NamedTuple):
    """A primitive of a mesh in its own space.

    Attributes
    ----------
    name : str
        What it adds to the name of its node.
    mesh : Mesh
        Of float64 and int64.
    joints, weights : (n_vertices, k) int64 and float64, or None
        By which joints of a skin each vertex is moved.
    materials : tuple of Material
        The one that it is made of, if the file says it.
    """

    name: str
    mesh: Mesh
    joints: np.ndarray | None
    weights: np.ndarray | None
    materials: tuple[Material, ...]


def read_gltf(path: Path) -> Contents:
    """Read a glTF file, ``.gltf`` or ``.glb``."""
    document = Document(path)
    try:
        reader = _Reader(document)
        placed = list(reader.placed(path.stem))
        return Contents([], reader.notes(), placed)
    except (BrokenFile, InputError):
        raise
    except MALFORMED as error:
        raise BrokenFile(
            f"its description is not as glTF wants it: {type(error).__name__}: {error}"
        ) from error


class _Reader:
    """Takes the meshes of the nodes."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.root = document.root
        self._refuse_what_is_not_read()
        self.nodes = Nodes(document)
        self._shapes: dict[tuple, list[Shape]] = {}
        # A few lines can name the same numbers for a thousand shapes, and those for ever more.
        self._tally = Tally("the shapes of its nodes", "take a part of it")
        self._materials = Materials(document)
        self._not_drawn: Counter[str] = Counter()
        self._shown: list[int] = []

    def _refuse_what_is_not_read(self) -> None:
        version = str(self.root.get("asset", {}).get("version"))
        if not version.startswith("2."):
            raise BrokenFile(f"it is of version {version[:20]} of glTF, only 2.0 is read")
        needed = [
            name
            for name in self.root.get("extensionsRequired", [])
            if not name.startswith(WITHOUT_EFFECT)
        ]
        if needed:
            raise NotRead(f"it requires {', '.join(needed)}, which is not read")

    def placed(self, stem: str) -> Iterator[PlacedMesh]:
        """Yield the meshes at all nodes of the scene.

        Parameters
        ----------
        stem : str
            Name of what has none.
        """
        self._shown = list(self.nodes.shown())
        for node in self._shown:
            if "mesh" in self.nodes.entries[node]:
                yield from self._placed_at(node, stem)

    def _placed_at(self, node: int, stem: str) -> Iterator[PlacedMesh]:
        """Yield the shapes at a node, as often as there are instances of it."""
        entry = self.nodes.entries[node]
        mesh = self.document.entry("meshes", entry["mesh"])
        name = str(entry.get("name") or mesh.get("name") or stem)
        shapes = self._shapes_of(int(entry["mesh"]), mesh, entry.get("weights"))
        matrices = self.nodes.matrices(node)
        if matrices is None:
            matrices = self.nodes.matrix(node)[None]
            names = [name]
        else:
            names = [f"{name}/{number}" for number in range(len(matrices))]
        self._tally.add(len(shapes) * len(matrices) * BYTES_PER_INSTANCE)
        joints = self.nodes.of_joints(entry["skin"]) if "skin" in entry else None
        descriptor = self.nodes.descriptor(node)
        for instance, matrix in zip(names, matrices):
            for shape in shapes:
                if joints is None or shape.joints is None or shape.weights is None:
                    yield PlacedMesh(
                        instance + shape.name, shape.mesh, matrix, shape.materials, descriptor
                    )
                else:
                    vertices, triangles, _ = shape.mesh
                    self._tally.add(vertices.nbytes)
                    there = moved_by_joints(vertices, shape.joints, shape.weights, joints)
                    yield PlacedMesh(
                        instance + shape.name, Mesh(there, triangles), np.eye(4), shape.materials,
                        descriptor,
                    )  # fmt: skip

    # ------------------------------------------------------------------------------------ meshes

    def _shapes_of(self, index: int, mesh: dict, weights: list | None) -> list[Shape]:
        """Return the primitives of a mesh that have triangles, for weights of its targets."""
        weights = mesh.get("weights", []) if weights is None else weights
        weights = [real(weight, f"a weight of mesh {index}") for weight in weights]
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
                    f"mesh {index} has a primitive of mode {reprlib.repr(mode)}, which there is not"
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
                vertices += weight * moves
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
        joints, shares = self._joints(attributes, len(vertices), where)
        made = [vertices, triangles, *(each for each in (joints, shares) if each is not None)]
        self._tally.add(sum(each.nbytes for each in made))
        return Shape(name, Mesh(vertices, triangles), joints, shares, self._materials.of(primitive))

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
        notes += self._materials.notes
        shown = set(self._shown)
        hidden = [
            k for k, node in enumerate(self.nodes.entries) if "mesh" in node and k not in shown
        ]
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
