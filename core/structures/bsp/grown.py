"""A finished BSP tree: put together of pieces, and numbered.

Nodes are numbered in the order in which they are made, the two children of a cell together, and
leaves in the order in which their turns come. Where the order of splitting makes no other tree,
threads build it in pieces, and the numbers of the order that was asked for are given afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...ranges import ranges
from ..subdivision.frontier import DEPTH_FIRST


class Grown(NamedTuple):
    """A finished tree.

    Attributes
    ----------
    planes : (n, 4) float64
        Unit normal and position along it; zeros for leaves.
    link : (n,) int32
        Left child, below the plane (the right one is next), or ``-1 - leaf``.
    parent, depth : (n,) int32
    area : (n,) float64
        Surface areas of the cells.
    count : (n,) int32
        References of the cells, inner ones included.
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32
        Triangles, leaf after leaf.
    """

    planes: np.ndarray
    link: np.ndarray
    parent: np.ndarray
    depth: np.ndarray
    area: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of that name
    offsets: np.ndarray
    references: np.ndarray


def joined(top: Grown, subtrees: dict[int, Grown]) -> Grown:
    """Return one tree: `top` with subtrees in the place of some of its leaves.

    The old roots of the subtrees are left over, and so are their empty leaves in `top`.
    """
    pieces = [top, *subtrees.values()]
    at_node = np.cumsum([0] + [len(piece.link) for piece in pieces])
    at_leaf = np.cumsum([0] + [len(piece.offsets) - 1 for piece in pieces])
    at_list = np.cumsum([0] + [len(piece.references) for piece in pieces])
    link = [
        np.where(piece.link > 0, piece.link + node, piece.link - leaf)
        for piece, node, leaf in zip(pieces, at_node, at_leaf)
    ]
    parent = [piece.parent + node for piece, node in zip(pieces, at_node)]
    offsets = [piece.offsets[:-1] + place for piece, place in zip(pieces, at_list)]
    whole = Grown(
        np.concatenate([piece.planes for piece in pieces]), np.concatenate(link),
        np.concatenate(parent), np.concatenate([piece.depth for piece in pieces]),
        np.concatenate([piece.area for piece in pieces]),
        np.concatenate([piece.count for piece in pieces]),
        np.concatenate([*offsets, at_list[-1:]]),
        np.concatenate([piece.references for piece in pieces]),
    )  # fmt: skip
    for node, root in zip(subtrees, at_node[1:]):
        whole.planes[node], whole.link[node] = whole.planes[root], whole.link[root]
        left = whole.link[node]
        if left > 0:
            whole.parent[left : left + 2] = node
    return whole


def numbered(tree: Grown, order: int) -> Grown:
    """Return the tree with nodes and leaves in the order in which a frontier would make them.

    Parameters
    ----------
    order : int
        DEPTH_FIRST or FIFO.
    """
    levels, level = [], np.zeros(1, np.int64)
    while len(level):
        levels.append(level)
        left = tree.link[level[tree.link[level] > 0]].astype(np.int64)
        level = np.stack([left, left + 1], axis=1).ravel()
    old = np.concatenate(levels)
    leaves = old[tree.link[old] <= 0]
    if order == DEPTH_FIRST:
        old, leaves = depth_first(tree, levels)
    number = np.zeros(len(tree.link), np.int64)
    number[old] = np.arange(len(old))
    link = tree.link[old]
    is_leaf = link <= 0
    lists = -1 - tree.link[leaves]
    sizes = (tree.offsets[1:] - tree.offsets[:-1])[lists]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    place = ranges(tree.offsets[lists], sizes)
    new_link = np.empty(len(old), np.int32)
    new_link[~is_leaf] = number[link[~is_leaf]]
    new_link[number[leaves]] = -1 - np.arange(len(leaves))
    return Grown(
        tree.planes[old], new_link, number[tree.parent[old]].astype(np.int32), tree.depth[old],
        tree.area[old], tree.count[old], offsets, tree.references[place],
    )  # fmt: skip


def depth_first(tree: Grown, levels: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return all nodes in the order in which a stack makes them, and the leaves in its order."""
    n = len(tree.link)
    # Inner nodes in and below each node, from the bottom.
    n_inner = np.zeros(n, np.int64)
    for level in reversed(levels):
        inner = level[tree.link[level] > 0]
        left = tree.link[inner]
        n_inner[inner] = 1 + n_inner[left] + n_inner[left + 1]
    # Splits, and leaves, whose turn comes before that of each node: a subtree with k inner nodes
    # has k + 1 leaves.
    splits, before = np.zeros(n, np.int64), np.zeros(n, np.int64)
    old = np.zeros(2 * n_inner[0] + 1, np.int64)
    for level in levels:
        inner = level[tree.link[level] > 0]
        left = tree.link[inner]
        splits[left] = splits[inner] + 1
        splits[left + 1] = splits[left] + n_inner[left]
        before[left] = before[inner]
        before[left + 1] = before[left] + n_inner[left] + 1
        old[2 * splits[inner] + 1], old[2 * splits[inner] + 2] = left, left + 1
    all_nodes = np.concatenate(levels)
    leaves = all_nodes[tree.link[all_nodes] <= 0]
    return old, leaves[np.argsort(before[leaves])]
