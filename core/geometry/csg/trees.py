"""Trees of solids in arrays: a geometry whose items are trees of set operations.

All nodes of all trees lie in one set of arrays, each before those below it. An item that is a plain
solid, or a surface without an inside, is a tree of one leaf, and is met as in any other scene.

Every leaf has *primitives*, the surfaces by which hits are known: one of a solid, one for each
triangle of a closed mesh. They are counted from leaf to leaf over all trees, so that an edge of a
hole is told from the plate it is in, and each has its own material.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...ranges import ranges
from ..box_shape import box_segments, hulls_of_boxes
from ..geometry import boxes_around, hulls_of, lines_of, normals_at
from ..solids.mixed import Mixed
from ..triangles import Triangles
from .settings import CuttingSettings

SOLID, HALF_SPACE, MESH, UNION, INTERSECTION, DIFFERENCE = range(6)
"""Kinds of nodes; from UNION on they are set operations."""

OPERATION_NAMES = {UNION: "union", INTERSECTION: "intersection", DIFFERENCE: "difference"}

NOTHING = -1
"""In the place of a node: nothing is there, or nothing is left of it."""


class Nodes(NamedTuple):
    """The nodes of all trees, each before those below it.

    Attributes
    ----------
    kind : (n_nodes,) uint8
    left, right : (n_nodes,) int32
        Operands: of a difference, `right` is taken away from `left`. NOTHING of a leaf.
    leaf : (n_nodes,) int32
        Which solid, half-space or mesh a leaf is; NOTHING of an operation.
    first : (n_nodes,) int32
        Number of the first primitive of a leaf.
    """

    kind: np.ndarray
    left: np.ndarray
    right: np.ndarray
    leaf: np.ndarray
    first: np.ndarray


class Csg(NamedTuple):
    """Trees of solids: what a scene holds.

    Attributes
    ----------
    ids, reach
        As of every geometry; an id for each tree.
    boxes : (n, 6) float64
        Around what is left of each tree, with all cutting that boxes can do.
    roots : (n,) int32
        The node that each tree begins with, as it was described.
    nodes : Nodes
        As they were described.
    is_tree : (n,) bool
        False where an item is met as in any other scene.
    solids : Mixed
        All elementary solids, and all plain items.
    half_spaces : (k, 4) float64
        [nx, ny, nz, h] with n of unit length: ``n . p <= h``.
    corners : (m, 3, 3) float64
        Triangles of all closed meshes.
    mesh_first : (k + 1,) int64
        Which are whose.
    pruned : Nodes
        The nodes as rays meet them: operands of which nothing is left are gone.
    starts : (n,) int32
        The node that rays begin with; NOTHING where nothing is left of a tree.
    bounds : NamedTuple of arrays
        A volume for every node, of any kind.
    is_bounded : (n_nodes,) bool
        Whether a ray is tested with it.
    cutting : CuttingSettings
        How that was found.
    """

    ids: np.ndarray
    reach: np.ndarray
    boxes: np.ndarray
    roots: np.ndarray
    nodes: Nodes
    is_tree: np.ndarray
    solids: Mixed
    half_spaces: np.ndarray
    corners: np.ndarray
    mesh_first: np.ndarray
    pruned: Nodes
    starts: np.ndarray
    bounds: Any
    is_bounded: np.ndarray
    cutting: CuttingSettings

    @property
    def n_primitives(self) -> int:
        """How many primitives all leaves have."""
        return len(self.solids.ids) + len(self.half_spaces) + len(self.corners)


def parents_of(nodes: Nodes) -> np.ndarray:
    """Return the parent of each node, (n_nodes,); NOTHING for a root."""
    parents = np.full(len(nodes.kind), NOTHING)
    inner = np.flatnonzero(nodes.kind >= UNION)
    parents[nodes.left[inner]] = inner
    parents[nodes.right[inner]] = inner
    return parents


def depths_of(nodes: Nodes) -> np.ndarray:
    """Return how deep each node lies below its root, (n_nodes,)."""
    parents, depths = parents_of(nodes), np.zeros(len(nodes.kind), np.int64)
    for node in np.flatnonzero(parents != NOTHING):
        depths[node] = depths[parents[node]] + 1
    return depths


def is_taken_away(nodes: Nodes) -> np.ndarray:
    """Say of each node whether it is taken away an odd number of times, (n_nodes,) bool.

    There the surface of the whole is the inside of the operand's.
    """
    parents = parents_of(nodes)
    flips = np.zeros(len(nodes.kind), bool)
    for node in np.flatnonzero(parents != NOTHING):
        parent = parents[node]
        is_right = nodes.right[parent] == node
        flips[node] = flips[parent] ^ bool(nodes.kind[parent] == DIFFERENCE and is_right)
    return flips


def nodes_below(nodes: Nodes, root: int) -> np.ndarray:
    """Return the nodes of a tree, its root first, each before those below it."""
    found, waiting = [], [root]
    while waiting:
        node = waiting.pop()
        found.append(node)
        if nodes.kind[node] >= UNION:
            waiting += [int(nodes.right[node]), int(nodes.left[node])]
    return np.array(found)


def n_pruned(geometry: Csg) -> int:
    """Return of how many leaves nothing is left."""
    pruned = geometry.pruned
    is_there = np.zeros(len(pruned.kind), bool)
    waiting = geometry.starts[geometry.starts != NOTHING].tolist()
    while waiting:
        node = waiting.pop()
        is_there[node] = True
        if pruned.kind[node] >= UNION:
            waiting += [int(pruned.left[node]), int(pruned.right[node])]
    return int(((pruned.kind < UNION) & ~is_there).sum())


def first_of_leaves(geometry: Csg) -> np.ndarray:
    """Return the number of the first primitive of each leaf, (n_leaves,), ascending."""
    return np.sort(geometry.nodes.first[geometry.nodes.kind < UNION]).astype(np.int64)


def leaf_of(geometry: Csg, primitives: np.ndarray) -> np.ndarray:
    """Return the leaf that each primitive is of, (n,): a node."""
    leaves = np.flatnonzero(geometry.nodes.kind < UNION)
    leaves = leaves[np.argsort(geometry.nodes.first[leaves], kind="stable")]
    place = np.searchsorted(geometry.nodes.first[leaves], primitives, side="right") - 1
    return leaves[place]


def item_of(geometry: Csg, primitives: np.ndarray) -> np.ndarray:
    """Return the tree that each primitive is of, (n,)."""
    parents, of_node = parents_of(geometry.nodes), np.full(len(geometry.nodes.kind), NOTHING)
    of_node[geometry.roots] = np.arange(len(geometry.roots))
    for node in np.flatnonzero(parents != NOTHING):
        of_node[node] = of_node[parents[node]]
    return of_node[leaf_of(geometry, primitives)]


def primitive_counts(geometry: Csg) -> np.ndarray:
    """Return how many primitives each item has, (n,)."""
    firsts = first_of_leaves(geometry)
    sizes = np.diff(firsts, append=geometry.n_primitives)
    owners = item_of(geometry, firsts)
    return np.bincount(owners, weights=sizes, minlength=len(geometry.roots)).astype(np.int64)


@boxes_around.register
def _(geometry: Csg) -> np.ndarray:
    return geometry.boxes.copy()


@hulls_of.register
def _(geometry: Csg) -> tuple[np.ndarray, np.ndarray]:
    return hulls_of_boxes(geometry.boxes)


@normals_at.register
def _(geometry: Csg, primitives: np.ndarray, points: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Ask the leaves; what is taken away is seen from its inside."""
    leaves = leaf_of(geometry, primitives)
    kinds, which = geometry.nodes.kind[leaves], geometry.nodes.leaf[leaves]
    normals = np.empty((len(points), 3))
    here = np.flatnonzero(kinds == SOLID)
    if len(here):
        normals[here] = normals_at(geometry.solids, which[here], points[here], times[here])
    here = np.flatnonzero(kinds == HALF_SPACE)
    normals[here] = geometry.half_spaces[which[here], :3]
    here = np.flatnonzero(kinds == MESH)
    if len(here):
        within = primitives[here] - geometry.nodes.first[leaves[here]]
        triangles = geometry.mesh_first[which[here]] + within
        normals[here] = normals_at(meshes_of(geometry), triangles, points[here], times[here])
    return np.where(is_taken_away(geometry.nodes)[leaves][:, None], -normals, normals)


@lines_of.register
def _(geometry: Csg, primitives: np.ndarray, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Draw what primitives are of, whole; a half-space has no lines."""
    leaves = leaf_of(geometry, primitives)
    kinds, which = geometry.nodes.kind[leaves], geometry.nodes.leaf[leaves]
    here = np.flatnonzero(kinds == SOLID)
    segments, owners = lines_of(geometry.solids, which[here], time)
    owners = here[owners]
    here = np.flatnonzero(kinds == MESH)
    if len(here):
        within = np.asarray(primitives)[here] - geometry.nodes.first[leaves[here]]
        more, own = lines_of(meshes_of(geometry), geometry.mesh_first[which[here]] + within)
        segments, owners = np.concatenate([segments, more]), np.concatenate([owners, here[own]])
    order = np.argsort(owners, kind="stable")
    return segments[order], owners[order]


def meshes_of(geometry: Csg) -> Triangles:
    """Return the triangles of all closed meshes as a geometry."""
    return Triangles(
        geometry.corners, np.arange(len(geometry.corners), dtype=np.int32), geometry.reach
    )


def lines_of_trees(geometry: Csg, items: np.ndarray) -> np.ndarray:
    """Return lines that show where trees are, (m, 2, 3): their solids, and the box of each."""
    nodes = geometry.nodes
    leaves = np.concatenate(
        [np.empty(0, np.int64), *(nodes_below(nodes, int(root)) for root in geometry.roots[items])]
    )
    leaves = leaves[nodes.kind[leaves] < UNION]
    meshes = leaves[nodes.kind[leaves] == MESH]
    sizes = geometry.mesh_first[nodes.leaf[meshes] + 1] - geometry.mesh_first[nodes.leaf[meshes]]
    primitives = np.concatenate(
        [
            nodes.first[leaves[nodes.kind[leaves] == SOLID]].astype(np.int64),
            ranges(nodes.first[meshes].astype(np.int64), sizes),
        ]
    )
    of_trees = box_segments(geometry.boxes[items][geometry.is_tree[items]])
    return np.concatenate([lines_of(geometry, primitives)[0], of_trees])
