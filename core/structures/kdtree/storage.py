"""How a kd-tree is stored and seen by the walks.

Two numbers per node: the position of its plane, and one that holds the axis in its lowest two bits
and the left child above (the right one is the next node). Axis 3 marks a leaf, with the number of
its list above. Nodes are numbered depth-first, siblings together, so that a walk which goes down
mostly goes on in memory. Cells are not stored: they follow from the planes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import call, implements, kernel
from ..contract import STACK_SIZE
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
from .builder import LEAF


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
    """A tree as a builder leaves it, see :class:`.builder.Work`; `first` counts from its start."""

    axis: np.ndarray
    split: np.ndarray
    first: np.ndarray
    size: np.ndarray
    listed: np.ndarray


MOST_SORTED = 64
"""References of a leaf up to which insertion sorts them."""


@kernel
def copy_depth_first(piece, out, stack):
    """Copy a tree, its nodes and leaves renumbered depth-first.

    Parameters
    ----------
    piece : Piece
    out : KdTreeArrays
    stack : (k, 2) int64
    """
    stack[0, 0], stack[0, 1] = 0, 0
    height, taken, leaves = 1, 1, 0
    while height > 0:
        height -= 1
        old, new = stack[height, 0], stack[height, 1]
        first, axis = piece.first[old], piece.axis[old]
        out.split[new] = piece.split[old]
        if axis != LEAF:
            out.link[new] = 4 * taken + axis
            for right in range(1, -1, -1):
                stack[height, 0], stack[height, 1] = first + right, taken + right
                height += 1
            taken += 2
            continue
        out.link[new] = 4 * leaves + LEAF
        size, place = piece.size[old], out.offsets[leaves]
        leaves += 1
        out.offsets[leaves] = place + size
        for i in range(size):
            triangle, j = piece.listed[first + i], place + i
            if size <= MOST_SORTED:
                while j > place and out.references[j - 1] > triangle:
                    out.references[j] = out.references[j - 1]
                    j -= 1
            out.references[j] = triangle


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
    ).astype(np.int32)
    for node, root in zip(subtrees, nodes[1:]):
        for array in (axis, split, first, size):
            array[node] = array[root]
    return Piece(axis, split, first, size, listed)


def store(top: Piece, subtrees: dict[int, Piece], cell: np.ndarray) -> KdTreeArrays:
    """Return the tree that a builder, or several, have left in pieces.

    Parameters
    ----------
    subtrees : dict
        By the node of `top` in whose place they go.
    cell : (6,) float64
        The root's.
    """
    piece = joined(top, subtrees)
    n_nodes = len(piece.axis) - len(subtrees)
    tree = KdTreeArrays(
        cell, np.empty(n_nodes), np.empty(n_nodes, np.int32),
        np.zeros((n_nodes + 1) // 2 + 1, np.int64), np.empty(len(piece.listed), np.int32),
    )  # fmt: skip
    call(copy_depth_first, piece, tree, np.empty((STACK_SIZE, 2), np.int64))
    sizes = np.diff(tree.offsets)
    for leaf in np.flatnonzero(sizes > MOST_SORTED):
        tree.references[tree.offsets[leaf] : tree.offsets[leaf + 1]].sort()
    return tree


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
