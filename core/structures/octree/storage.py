"""Four storages of one octree: pointers, an implicit array, a linear octree and a hash table.

They differ in one question only: given a node and an octant, which node is the child? All number
the nodes alike: inner nodes 0, 1, ... level by level, then the leaves depth-first, both in the
order of octants. So a number tells whether its node is a leaf, planes belong to inner nodes and
reference lists to leaves, and every walk takes the same steps in all four.

- Pointers: eight numbers per inner node.
- Implicit: a full tree in one array, children of place i at 8 i + 1 ... 8 i + 8. No links, but
  places for all nodes that a full tree of this depth would have.
- Linear: only leaves, as sorted locational (Morton) codes with their levels, found by binary search
  (I. Gargantini: An Effective Way to Represent Quadtrees, CACM 25(12), 1982). The inner nodes are
  listed the same way, since ours have planes of their own.
- Hash table: a node's name is the string of octants from the root, 1 for the root and 10 name + 1
  ... 10 name + 8 for the children; names are hashed by the remainder, with chaining (A. Glassner:
  Space Subdivision for Fast Ray Tracing, IEEE CG&A 4(10), 1984).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...kernels import implements, inlined, whole
from ...memory import refuse_if_too_large
from ..subdivision.tree import child

LINEAR_LEVELS = 20
"""Levels of a locational code in 63 bits, three per level."""

HASH_LEVELS = 18
"""Levels of a decimal name in 63 bits."""

ADVICE = "lower max_depth or choose storage=pointer"


class BuiltTree(NamedTuple):
    """What a builder makes, whatever stores it in the end.

    Attributes
    ----------
    box : (6,) float64
    planes : (n_inner, 3) float64
    children : (n_inner, 8) int32
        Bit 0, 1, 2 of the octant: above the plane of x, y, z.
    levels : (n_nodes,) uint8
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32
        Ascending within a leaf.
    order : (n_nodes,) int64
        Step of the building in which a node was made, 0 for the root.
    count : (n_nodes,) int64
        References of each node, inner ones included.
    """

    box: np.ndarray
    planes: np.ndarray
    children: np.ndarray
    levels: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    order: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of that name


# ------------------------------------------------------------------------------------ pointers


class PointerOctree(NamedTuple):
    """Octree with pointers: `children` is (n_inner, 8) int32."""

    box: np.ndarray
    planes: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    children: np.ndarray


@implements(child, PointerOctree)
def child_by_pointer(tree, node, side):
    """Follow a pointer."""
    return whole(tree.children[node, side])


def store_pointers(tree: BuiltTree) -> PointerOctree:
    """Store a tree with pointers."""
    return PointerOctree(tree.box, tree.planes, tree.offsets, tree.references, tree.children)


# ------------------------------------------------------------------------------ implicit array


class ImplicitOctree(NamedTuple):
    """Octree in a full array.

    Attributes
    ----------
    numbers : ((8^(depth + 1) - 1) / 7,) int32
        Number of the node at each place, -1 for none.
    places : (n_inner,) int64
        Place of each inner node.
    """

    box: np.ndarray
    planes: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    numbers: np.ndarray
    places: np.ndarray


@implements(child, ImplicitOctree)
def child_by_place(tree, node, side):
    """Compute the child's place."""
    return whole(tree.numbers[8 * tree.places[node] + 1 + side])


def store_implicit(tree: BuiltTree) -> ImplicitOctree:
    """Store a tree in a full array.

    Raises
    ------
    InputError
        If a full tree of that depth does not fit into memory.
    """
    depth = int(tree.levels.max())
    size = (8 ** (depth + 1) - 1) // 7
    refuse_if_too_large(4 * size, f"octree: storage=implicit of depth {depth}", ADVICE)
    places = names_of_nodes(tree, 0, lambda of_parent, octant: 8 * of_parent + 1 + octant)
    numbers = np.full(size, -1, np.int32)
    numbers[places] = np.arange(len(places), dtype=np.int32)
    return ImplicitOctree(
        tree.box, tree.planes, tree.offsets, tree.references,
        numbers, places[: len(tree.planes)].copy(),
    )  # fmt: skip


# ------------------------------------------------------------------------------- linear octree


class LinearOctree(NamedTuple):
    """Octree as sorted locational codes.

    Attributes
    ----------
    codes : (n_leaves,) int64
        Octants from the root, three bits each, filled up with zeros to the depth of the tree.
    levels : (n_leaves,) uint8
    inner_codes : (n_inner,) int64
        The same, sorted within each level.
    inner_levels : (n_inner,) uint8
    level_starts : (depth + 2,) int64
        First inner node of each level.
    depth : int
    """

    box: np.ndarray
    planes: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    codes: np.ndarray
    levels: np.ndarray
    inner_codes: np.ndarray
    inner_levels: np.ndarray
    level_starts: np.ndarray
    depth: int


@inlined
def search(codes, first, last, code):
    """Return the place of the last code <= `code` among ``codes[first:last]``, or first - 1."""
    while first < last:
        middle = (first + last) // 2
        if codes[middle] <= code:
            first = middle + 1
        else:
            last = middle
    return first - 1


@implements(child, LinearOctree)
def child_by_code(tree, node, side):
    """Search for the child's code among the leaves, then among the inner nodes of its level."""
    level = whole(tree.inner_levels[node]) + 1
    code = tree.inner_codes[node] + (side << (3 * (tree.depth - level)))
    place = search(tree.codes, 0, len(tree.codes), code)
    if tree.codes[place] == code and tree.levels[place] == level:
        return len(tree.inner_codes) + place
    return search(tree.inner_codes, tree.level_starts[level], tree.level_starts[level + 1], code)


def store_linear(tree: BuiltTree) -> LinearOctree:
    """Store a tree as sorted codes.

    Raises
    ------
    InputError
        If the tree is deeper than a code has bits for.
    """
    depth, n_inner = int(tree.levels.max()), len(tree.planes)
    refuse_if_too_deep(depth, LINEAR_LEVELS, "linear")
    codes = names_of_nodes(tree, 0, lambda of_parent, octant: 8 * of_parent + octant)
    codes <<= 3 * (depth - tree.levels.astype(np.int64))
    inner_levels = tree.levels[:n_inner].copy()
    return LinearOctree(
        tree.box, tree.planes, tree.offsets, tree.references,
        codes[n_inner:].copy(), tree.levels[n_inner:].copy(), codes[:n_inner].copy(), inner_levels,
        np.searchsorted(inner_levels, np.arange(depth + 2)).astype(np.int64), depth,
    )  # fmt: skip


# ---------------------------------------------------------------------------------- hash table


class HashOctree(NamedTuple):
    """Octree in a hash table.

    Attributes
    ----------
    names : (n_nodes,) int64
    heads : (table size,) int32
        First node of each chain, -1 for none.
    nexts : (n_nodes,) int32
        Next node of the same chain.
    """

    box: np.ndarray
    planes: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    names: np.ndarray
    heads: np.ndarray
    nexts: np.ndarray


@implements(child, HashOctree)
def child_by_name(tree, node, side):
    """Look the child's name up."""
    name = 10 * tree.names[node] + 1 + side
    found = whole(tree.heads[name % len(tree.heads)])
    while tree.names[found] != name:
        found = whole(tree.nexts[found])
    return found


def store_hash(tree: BuiltTree) -> HashOctree:
    """Store a tree by names.

    Raises
    ------
    InputError
        If the tree is deeper than a name has digits for.
    """
    refuse_if_too_deep(int(tree.levels.max()), HASH_LEVELS, "hash")
    names = names_of_nodes(tree, 1, lambda of_parent, octant: 10 * of_parent + 1 + octant)
    heads = np.full(table_size(len(names)), -1, np.int32)
    # Nodes of one chain are brought together; each points to the next.
    slots = names % len(heads)
    order = np.argsort(slots, kind="stable").astype(np.int32)
    starts = np.flatnonzero(np.diff(slots[order], prepend=-1))
    heads[slots[order[starts]]] = order[starts]
    nexts = np.full(len(names), -1, np.int32)
    nexts[order[:-1]] = order[1:]
    nexts[order[np.append(starts[1:], len(order)) - 1]] = -1
    return HashOctree(
        tree.box, tree.planes, tree.offsets, tree.references, names, heads, nexts
    )  # fmt: skip


def table_size(n_nodes: int) -> int:
    """Return the lowest prime >= `n_nodes`: names share factors with round numbers."""
    size = max(n_nodes, 3) | 1
    while any(size % n == 0 for n in range(3, int(size**0.5) + 1, 2)):
        size += 2
    return size


def chain_lengths(tree: HashOctree) -> np.ndarray:
    """Return the lengths of all chains that are not empty, (k,) int64."""
    lengths = np.bincount(tree.names % len(tree.heads))
    return lengths[lengths > 0]


# --------------------------------------------------------------------------------- in common


def names_of_nodes(tree: BuiltTree, root: int, name_of: Callable) -> np.ndarray:
    """Return a name for every node, (n_nodes,) int64, each from its parent's and its octant."""
    names = np.full(len(tree.levels), root, np.int64)
    n_inner = len(tree.planes)
    octants = np.arange(8)
    # Inner nodes are numbered level by level, so parents come before their children.
    starts = np.searchsorted(tree.levels[:n_inner], np.arange(int(tree.levels.max()) + 1))
    for first, last in zip(starts, [*starts[1:], n_inner], strict=True):
        names[tree.children[first:last]] = name_of(names[first:last, None], octants)
    return names


def refuse_if_too_deep(depth: int, limit: int, storage: str) -> None:
    """Raise InputError if a tree has more levels than the names of a storage."""
    if depth > limit:
        raise InputError(
            f"octree: storage={storage} holds at most {limit} levels, this tree has {depth}; "
            + ADVICE
        )


def topology_bytes(n_inner: int, n_leaves: int, depth: int) -> dict[str, int]:
    """Return the bytes that each storage takes beside planes and references, by its name."""
    n_nodes = n_inner + n_leaves
    return {
        "pointer": 32 * n_inner,
        "implicit": 4 * ((8 ** (depth + 1) - 1) // 7) + 8 * n_inner,
        "linear": 9 * n_nodes + 8 * (depth + 2),
        "hash": 12 * n_nodes + 4 * table_size(n_nodes),
    }


STORAGES = {
    "pointer": store_pointers,
    "implicit": store_implicit,
    "linear": store_linear,
    "hash": store_hash,
}
OCTREES = (PointerOctree, ImplicitOctree, LinearOctree, HashOctree)
