"""The tree of nodes in a glTF file: in which order they come, and where they put what they have.

A node stands in the space of the one above it. Vertices of a skin are moved by several nodes, its
joints, each by a share; then the place of their own node does not count.

Khronos Group: glTF 2.0 Specification, 2021, chapters 3.5 and 3.7.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.instance_settings import PLAIN, InstanceSettings, checked
from ..memory import Tally
from ..scene.placing import moved_vertices
from ..settings import parse
from .contents import BrokenFile
from .gltf_accessors import Document, real, whole

INSTANCING = "EXT_mesh_gpu_instancing"
VISIBILITY = "KHR_node_visibility"
EXTRAS = "accelscope_instance"

BYTES_PER_INSTANCE = 1000  # its matrix while that is made, its name and its place


class Nodes:
    """The nodes of a file.

    Attributes
    ----------
    entries : list of dict
        As the description has them.
    """

    def __init__(self, document: Document) -> None:
        self.entries: list[dict] = document.root.get("nodes", [])
        self._document = document
        self._matrices: dict[int, np.ndarray] = {}
        self._parents: dict[int, int] = {}
        self._tally = Tally("the instances at its nodes", "take a part of it")
        for parent in range(len(self.entries)):
            for child in document.entry("nodes", parent).get("children", []):
                document.entry("nodes", child)
                if self._parents.setdefault(int(child), parent) != parent:
                    raise BrokenFile(f"node {child} is the child of two nodes")

    def shown(self) -> Iterator[int]:
        """Yield the nodes of the scene that is to be shown, a node before its children."""
        waiting = self._roots()[::-1]
        met = set()
        while waiting:
            node = waiting.pop()
            entry = self._document.entry("nodes", node)
            if node in met:
                raise BrokenFile(f"node {node} is in the tree of the scene twice")
            met.add(node)
            if not entry.get("extensions", {}).get(VISIBILITY, {}).get("visible", True):
                continue
            yield node
            waiting += [int(child) for child in entry.get("children", [])[::-1]]

    def _roots(self) -> list[int]:
        """Return the nodes at the top of the scene."""
        root = self._document.root
        if root.get("scenes"):
            scene = self._document.entry("scenes", root.get("scene", 0))
            return [whole(node, "a number of nodes") for node in scene.get("nodes", [])]
        return [node for node in range(len(self.entries)) if node not in self._parents]

    def matrix(self, node: int) -> np.ndarray:
        """Return the matrix, (4, 4), from a node's space to the world's."""
        chain = []
        above: int | None = node
        while above is not None and above not in self._matrices:
            chain.append(above)
            if len(chain) > len(self.entries):
                raise BrokenFile(f"node {node} is below itself")
            above = self._parents.get(above)
        matrix = np.eye(4) if above is None else self._matrices[above]
        for below in reversed(chain):
            matrix = matrix @ _local_matrix(self.entries[below], f"node {below}")
            self._matrices[below] = matrix
        return matrix

    def descriptor(self, node: int) -> InstanceSettings:
        """Return what a node says of itself as an instance, among what is its author's own.

        Such as ``"extras": {"accelscope_instance": {"mask": 1, "force_opaque": true}}``.
        """
        extras = self.entries[node].get("extras")
        said = extras.get(EXTRAS) if isinstance(extras, dict) else None
        if said is None:
            return PLAIN
        texts = {str(key): str(value) for key, value in dict(said).items()}
        try:
            return checked(parse(InstanceSettings, texts, EXTRAS), EXTRAS)
        except InputError as error:
            raise BrokenFile(f"node {node}: {error}") from error

    def matrices(self, node: int) -> np.ndarray | None:
        """Return the matrices, (n, 4, 4), of the instances at a node; None where it has none."""
        instancing = self.entries[node].get("extensions", {}).get(INSTANCING)
        if instancing is None:
            return None
        return self.matrix(node) @ self._instances(instancing["attributes"])

    def _instances(self, attributes: dict) -> np.ndarray:
        """Return the matrices, (n, 4, 4), of EXT_mesh_gpu_instancing."""
        found = {
            name: np.asarray(self._document.accessor(attributes[name], kind), dtype=np.float64)
            for name, kind in (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3"))
            if name in attributes
        }
        counts = {len(values) for values in found.values()}
        if len(counts) != 1:
            raise BrokenFile(f"the attributes of {INSTANCING} are of different lengths, or none")
        count = counts.pop()
        self._tally.add(count * BYTES_PER_INSTANCE)
        return _composed(
            found.get("TRANSLATION", np.zeros((count, 3))),
            found.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
            found.get("SCALE", np.ones((count, 3))),
        )

    def of_joints(self, index: Any) -> np.ndarray:
        """Return the matrices, (n, 4, 4), by which the joints of a skin move vertices."""
        skin = self._document.entry("skins", index)
        joints = skin["joints"]
        for joint in joints:
            self._document.entry("nodes", joint)
        matrices = np.array([self.matrix(int(joint)) for joint in joints]).reshape(-1, 4, 4)
        if "inverseBindMatrices" in skin:
            columns = self._document.accessor(skin["inverseBindMatrices"], "MAT4")
            if len(columns) < len(joints):
                raise BrokenFile(f"skin {index} has too few inverse bind matrices")
            inverse = columns[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
            matrices = matrices @ inverse
        return matrices


def moved_by_joints(
    vertices: np.ndarray, joints: np.ndarray, weights: np.ndarray, matrices: np.ndarray
) -> np.ndarray:
    """Return the vertices of a skin in the world.

    Parameters
    ----------
    vertices : (n, 3) float64
    joints, weights : (n, k) int64 and float64
        By which joints each vertex is moved, and their shares, which add up to 1.
    matrices : (n_joints, 4, 4) float64
    """
    if joints.size and joints.max() >= len(matrices):
        raise BrokenFile(f"a vertex names joint {joints.max()} of {len(matrices)}")
    result = np.zeros_like(vertices)
    for joint in np.unique(joints):
        share = np.where(joints == joint, weights, 0.0).sum(axis=1)
        mine = np.flatnonzero(share)
        result[mine] += share[mine, None] * moved_vertices(vertices[mine], matrices[joint])
    return result


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
    return np.array([real(value, f"a number in {what}") for value in values])


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
