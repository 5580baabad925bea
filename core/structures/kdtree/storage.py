"""How a kd-tree is stored and seen by the walks.

Two numbers per node: the position of its plane, and one that holds the axis in its lowest two bits
and the left child above (the right one is the next node). Axis 3 marks a leaf, with the number of
its list above. Nodes are numbered depth-first, siblings together, so that a walk which goes down
mostly goes on in memory. Cells are not stored: they follow from the planes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.missing import all_made
from ...kernels import implements
from ...ranges import ranges
from ..subdivision.structure import Topology
from ..subdivision.tree import (
    child,
    expand,
    far_part,
    leaf_index,
    meets_far,
    meets_near,
    near_part,
    near_side,
    plane_times,
    planes,
    push,
)
from .work import LEAF


class KdTreeArrays(NamedTuple):
    """The tree as its walks see it; node 0 is the root.

    Attributes
    ----------
    box : (6,) float64
        The root's cell.
    split : (n_nodes,) float64
        Position of the plane; 0 for leaves.
    link : (n_nodes,) int32
        ``4 * left_child + axis`` or ``4 * leaf + 3``.
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32
        Triangles, ascending within a leaf.
    """

    box: np.ndarray
    split: np.ndarray
    link: np.ndarray
    offsets: np.ndarray
    references: np.ndarray


all_made(KdTreeArrays)


@implements(leaf_index, KdTreeArrays)
def kd_leaf_index(tree, node):
    """Look at the lowest two bits."""
    link = tree.link[node]
    return link >> 2 if link & 3 == LEAF else -1


@implements(planes, KdTreeArrays)
def kd_planes(tree, node):
    """One plane."""
    axis, split = tree.link[node] & 3, tree.split[node]
    return (
        split if axis == 0 else np.nan,
        split if axis == 1 else np.nan,
        split if axis == 2 else np.nan,
    )


@implements(child, KdTreeArrays)
def kd_child(tree, node, side):
    """Of the bits of `side`, that of the node's axis counts."""
    link = tree.link[node]
    return (link >> 2) + ((side >> (link & 3)) & 1)


@implements(expand, KdTreeArrays)
def kd_expand(tree, node, workspace, span, height):
    """Near child only, far child only, or the near one now and the far one later."""
    link = tree.link[node]
    axis = link & 3
    early, late = plane_times(workspace.frame, axis, tree.split[node])
    side = near_side(workspace.frame, axis)
    near, far = (link >> 2) + side, (link >> 2) + 1 - side
    if not meets_far(span, early):
        return near, near_part(span, early, late), height
    if not meets_near(span, late):
        return far, far_part(span, early), height
    push(workspace, height, far, far_part(span, early))
    return near, near_part(span, early, late), height + 1


# --------------------------------------------------------------------------------- from pieces


class Piece(NamedTuple):
    """A tree as a builder leaves it, see :class:`.work.Work`; `first` counts from its start."""

    axis: np.ndarray
    split: np.ndarray
    first: np.ndarray
    size: np.ndarray
    listed: np.ndarray


def joined(top: Piece, subtrees: dict[int, Piece]) -> Piece:
    """Return one piece: `top` with subtrees in the place of some of its nodes."""
    if not subtrees:
        return top
    pieces = [top, *subtrees.values()]
    nodes = np.cumsum([0] + [len(piece.axis) for piece in pieces])
    lists = np.cumsum([0] + [len(piece.listed) for piece in pieces])
    axis, split, size, listed = (
        np.concatenate([getattr(piece, name) for piece in pieces])
        for name in ("axis", "split", "size", "listed")
    )
    first = np.concatenate(
        [
            np.where(piece.axis == LEAF, piece.first + at_list, piece.first + at_node)
            for piece, at_node, at_list in zip(pieces, nodes, lists)
        ]
    )
    for node, root in zip(subtrees, nodes[1:]):
        for array in (axis, split, first, size):
            array[node] = array[root]
    return Piece(axis, split, first, size, listed)


def number_depth_first(axis: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the depth-first numbers of all nodes, and of the leaves among themselves.

    Parameters
    ----------
    axis, first : (n,) int
        See :class:`Piece`.

    Returns
    -------
    number : (n,) int64
    leaf : (n,) int64
        Of use for leaves only.
    """
    is_inner = axis != LEAF
    levels, inner = [], np.flatnonzero(is_inner[:1])
    while len(inner):
        levels.append(inner)
        children = np.concatenate([first[inner], first[inner] + 1])
        inner = children[is_inner[children]]
    below = np.zeros(len(axis), np.int64)  # inner nodes of each subtree, its root included
    for inner in reversed(levels):
        below[inner] = 1 + below[first[inner]] + below[first[inner] + 1]
    # The children of the k-th inner node are 2 k - 1 and 2 k; before a right child comes all that
    # is below its sibling, in which there is one leaf more than inner nodes.
    number, inner_before, leaf = (np.zeros(len(axis), np.int64) for _ in range(3))
    for inner in levels:
        left, right = first[inner], first[inner] + 1
        number[left] = 2 * inner_before[inner] + 1
        number[right] = number[left] + 1
        inner_before[left] = inner_before[inner] + 1
        inner_before[right] = inner_before[left] + below[left]
        leaf[left] = leaf[inner]
        leaf[right] = leaf[left] + below[left] + 1
    return number, leaf


def store(
    top: Piece, subtrees: dict[int, Piece], cell: np.ndarray
) -> tuple[KdTreeArrays, np.ndarray, np.ndarray]:
    """Return the tree that a builder, or several, have left in pieces.

    Parameters
    ----------
    subtrees : dict
        By the node of `top` in whose place they go.
    cell : (6,) float64
        The root's.

    Returns
    -------
    tree : KdTreeArrays
    old : (n_nodes,) int64
        The number that each node had in its piece.
    size : (n_nodes,) int32
        References of each node, inner ones included.
    """
    piece = joined(top, subtrees)
    number, leaf = number_depth_first(piece.axis, piece.first)
    # Roots of subtrees have left the places that they had in their pieces.
    is_used = number > 0
    is_used[0] = True
    nodes = np.flatnonzero(is_used)
    old = np.empty(len(nodes), np.int64)
    old[number[nodes]] = nodes
    is_leaf = piece.axis == LEAF
    link = 4 * np.where(is_leaf, leaf, number[np.where(is_leaf, 0, piece.first)]) + piece.axis
    leaves = nodes[is_leaf[nodes]]
    in_order = np.empty(len(leaves), np.int64)
    in_order[leaf[leaves]] = leaves
    sizes = piece.size[in_order].astype(np.int64)
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    references = piece.listed[ranges(piece.first[in_order], sizes)]
    # Ascending within a leaf.
    keys = (np.repeat(np.arange(len(sizes)), sizes) << 32) + references
    keys.sort()
    references = (keys & (2**32 - 1)).astype(np.int32)
    tree = KdTreeArrays(cell, piece.split[old], link[old].astype(np.int32), offsets, references)
    return tree, old, piece.size[old]


def topology_of(tree: KdTreeArrays) -> Topology:
    """Return the cells of all nodes, level by level from the root."""
    n = len(tree.link)
    axis, left = tree.link & 3, (tree.link >> 2).astype(np.int64)
    is_leaf = axis == LEAF
    boxes, depth = np.empty((n, 6)), np.zeros(n, dtype=np.int64)
    boxes[0] = tree.box
    level = np.zeros(1, dtype=np.int64)
    while len(level):
        level = level[~is_leaf[level]]
        for right in range(2):
            children = left[level] + right
            boxes[children] = boxes[level]
            boxes[children, axis[level] + 3 * (1 - right)] = tree.split[level]
            depth[children] = depth[level] + 1
        level = np.concatenate([left[level], left[level] + 1])
    leaves = np.empty(len(tree.offsets) - 1, dtype=np.int64)
    leaves[left[is_leaf]] = np.flatnonzero(is_leaf)
    count = np.zeros(n, dtype=np.int32)
    count[leaves] = np.diff(tree.offsets)
    return Topology(boxes, depth, is_leaf, count, leaves)


def breadth_first_steps(tree: KdTreeArrays) -> np.ndarray:
    """Return in which step each node would be made if cells were split breadth-first, (n,) int64.

    The k-th split makes its two nodes in step k; the root is there in step 0.
    """
    steps = np.zeros(len(tree.link), np.int64)
    done, level = 0, np.zeros(1, np.int64)
    while len(level):
        inner = level[tree.link[level] & 3 != LEAF]
        left = tree.link[inner] >> 2
        steps[left] = steps[left + 1] = done + 1 + np.arange(len(inner))
        done += len(inner)
        level = np.stack([left, left + 1], axis=1).ravel()
    return steps
