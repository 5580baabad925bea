"""R-trees: balanced trees for discs, whose nodes have as many children as fit on a page.

Every node but the root has between m and M children, and all references are at the same depth. How
an R-tree comes about is a choice: by inserting one box after the other (:mod:`.rtree_insert`) or
all at once (:mod:`.rtree_str`).

Rays walk binary trees here. So the up to M children of a node become a small binary tree: the two
with the smallest box around both are joined, again and again. These inner nodes between are the
price of the binary form; the setting *arity* takes them out again by cost.

A. Guttman: R-Trees: A Dynamic Index Structure for Spatial Searching, SIGMOD 1984.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....geometry.box import union_area
from .....kernels import call, inner, kernel
from .....progress import Progress
from ...topology.tree import LinkedTree, leaves_only

MOST = 8
"""M: a node with more children is split. Eight boxes in a node are what wide trees have, too."""

LEAST = 3
"""m: 40% of M, as Guttman found best."""

NODES_PER_CALL = 32768
"""Nodes that one kernel call makes binary, in some 30 ms."""


class RTree(NamedTuple):
    """A balanced tree over n references.

    Nodes and references are *entries*: entry i is reference i, entry n + i is node i.

    Attributes
    ----------
    boxes : (n + n_nodes, 6) float64
        Of every entry.
    children : (n_nodes, MOST + 1) int64
        The entries in each node; one more than there may be, until it is split.
    size : (n_nodes,) int32
        How many those are.
    level : (n_nodes,) int32
        0 where the children are references.
    """

    boxes: np.ndarray
    children: np.ndarray
    size: np.ndarray
    level: np.ndarray

    @property
    def root(self) -> int:
        """The node that holds all others."""
        return int(np.argmax(self.level))


@inner
def enlarge(boxes, entry, other):
    """Make the box of an entry contain that of another."""
    for axis in range(3):
        boxes[entry, axis] = min(boxes[entry, axis], boxes[other, axis])
        boxes[entry, 3 + axis] = max(boxes[entry, 3 + axis], boxes[other, 3 + axis])


@kernel
def join_children(rtree, nodes, tree, made, heads, waiting):
    """Make a small binary tree of the children of each of some nodes.

    Parameters
    ----------
    nodes : (k,) int64
        Those below them have been joined before.
    made : int
        The next free node of `tree`.
    heads : (n_nodes,) int32
        The binary node that stands for each node.
    waiting : (MOST,) int64
        Scratch memory: binary nodes that are still to be joined.

    Returns
    -------
    int
        The next free node of `tree` then.
    """
    n = len(rtree.boxes) - len(rtree.size)
    for node in nodes:
        left = rtree.size[node]
        for i in range(left):
            entry = rtree.children[node, i]
            waiting[i] = entry if entry < n else heads[entry - n]
        while left > 1:
            best, best_a, best_b = np.inf, 0, 1
            for b in range(1, left):
                for a in range(b):
                    area = union_area(tree.boxes[waiting[a]], tree.boxes[waiting[b]])
                    if area < best:
                        best, best_a, best_b = area, a, b
            a, b = waiting[best_a], waiting[best_b]
            tree.left[made], tree.right[made] = a, b
            tree.parent[a] = tree.parent[b] = made
            for side in range(6):
                tree.boxes[made, side] = tree.boxes[a, side]
            enlarge(tree.boxes, made, b)
            left -= 1
            waiting[best_a], waiting[best_b] = made, waiting[left]
            made += 1
        heads[node] = waiting[0]
    return made


def binary_levels(rtree: RTree) -> np.ndarray:
    """Return the level at which :func:`binary` makes each of its inner nodes, (n - 1,) int32."""
    upward = np.argsort(rtree.level, kind="stable")
    return np.repeat(rtree.level[upward], rtree.size[upward] - 1)


def binary(rtree: RTree, progress: Progress) -> LinkedTree:
    """Return an R-tree as a binary tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    n = len(rtree.boxes) - len(rtree.size)
    tree = leaves_only(rtree.boxes[:n])
    upward = np.argsort(rtree.level, kind="stable")
    heads, waiting = np.empty(len(upward), np.int32), np.empty(MOST, np.int64)
    made = n
    for first in range(0, len(upward), NODES_PER_CALL):
        progress.report(first, len(upward), "Making the R-tree binary")
        nodes = upward[first : first + NODES_PER_CALL]
        made = call(join_children, rtree, nodes, tree, made, heads, waiting)
    progress.report(len(upward), len(upward), "Making the R-tree binary")
    return tree
