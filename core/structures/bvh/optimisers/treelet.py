"""Treelet restructuring: the best of all trees over seven subtrees, again and again.

A *treelet* is the upper part of a subtree: its root, and the nodes that come out when the leaf with
the largest area is replaced by its two children, five times. That makes seven leaves, which are
subtrees or triangles and stay as they are. Over seven leaves there are 10395 trees; dynamic
programming over the 127 sets of leaves finds the best one:

    best(set) = SA(set) + min over ways to cut the set in two of best(one) + best(other)

From the leaves of the tree up, every node with at least seven triangles below is the root of a
treelet. Passes over the tree follow each other until they gain next to nothing.

T. Karras, T. Aila: Fast Parallel Construction of High-Quality Bounding Volume Hierarchies,
HPG 2013.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ....contract.build_log import MOVE
from ....contract.costs import CostSettings
from ....geometry.box import area_of
from ....kernels import call, dispatched, implements, inner, kernel
from ....progress import Progress
from ..topology.tree import LinkedTree
from .rearranging import (
    Optimiser,
    Rearrangement,
    Work,
    fit_node,
    from_leaves_up,
    note_event,
    settled,
)

LEAVES = 7
"""Leaves of a treelet. Each more makes the search three times as long."""

NODES_AT_ONCE = 1 << 14
"""Nodes in one kernel call, some 30 ms."""


class Treelet(NamedTuple):
    """A treelet. Its nodes have numbers: i is leaf i, and n_leaves + k is inner node k.

    Attributes
    ----------
    leaves : (most,) int32
        Which nodes of the tree its leaves are.
    inner : (most - 1,) int32
        Which its inner nodes are; the root is the first.
    children : (most - 1, 2) int32
        Another tree over the leaves: numbers of the children of each inner node. Parents come
        before their children.
    """

    leaves: np.ndarray
    inner: np.ndarray
    children: np.ndarray


class Subsets(NamedTuple):
    """Scratch memory to find the best tree: what is known of each set of leaves, bit i for leaf i.

    Attributes
    ----------
    boxes : (2 ** LEAVES, 6) float64
        The box around them.
    costs : (2 ** LEAVES,) float64
        Least sum of inner areas.
    cuts : (2 ** LEAVES,) int32
        The part that becomes one child; the rest becomes the other.
    todo : (LEAVES - 1,) int32
        Sets of the inner nodes of the best tree.
    """

    boxes: np.ndarray
    costs: np.ndarray
    cuts: np.ndarray
    todo: np.ndarray


def make_treelet(most: int) -> Treelet:
    """Return room for treelets of up to `most` leaves."""
    return Treelet(
        np.empty(most, np.int32), np.empty(most - 1, np.int32), np.empty((most - 1, 2), np.int32)
    )


@dispatched
def arrange(search, tree, treelet, count):
    """Write a good tree over the leaves of a treelet into its `children`.

    Parameters
    ----------
    search : NamedTuple
        Scratch memory; its type decides how the tree is found.
    tree : LinkedTree
    treelet : Treelet
    count : int
        Number of leaves.

    Returns
    -------
    float
        Sum of the areas of the inner nodes but the root, which is the same in all trees.
    """
    raise TypeError(f"no way to arrange treelets is called {type(search).__name__}")


@implements(arrange, Subsets)
def arrange_best(search, tree, treelet, count):
    """Find the best tree of all by dynamic programming."""
    boxes, costs, cuts, todo = search.boxes, search.costs, search.cuts, search.todo
    for leaf in range(count):
        for side in range(6):
            boxes[1 << leaf, side] = tree.boxes[treelet.leaves[leaf], side]
        costs[1 << leaf] = 0.0
    full = (1 << count) - 1
    # Every part of a set is a smaller number than the set: it has been there before.
    for whole in range(3, full + 1):
        lowest = whole & -whole
        rest = whole ^ lowest
        if rest == 0:
            continue
        for axis in range(3):
            boxes[whole, axis] = min(boxes[lowest, axis], boxes[rest, axis])
            boxes[whole, 3 + axis] = max(boxes[lowest, 3 + axis], boxes[rest, 3 + axis])
        # One child is any part of the rest, so that the lowest leaf is always in the other.
        best, part = np.inf, rest
        while part > 0:
            cost = costs[part] + costs[whole ^ part]
            if cost < best:
                best, cuts[whole] = cost, part
            part = (part - 1) & rest
        costs[whole] = best if whole == full else best + area_of(boxes[whole])
    # Down from the root.
    todo[0] = full
    taken = 1
    for k in range(count - 1):
        whole = todo[k]
        for side in range(2):
            part = cuts[whole] if side else whole ^ cuts[whole]
            if part & (part - 1):
                treelet.children[k, side] = count + taken
                todo[taken] = part
                taken += 1
            else:
                leaf = 0
                while part >> leaf > 1:
                    leaf += 1
                treelet.children[k, side] = leaf
    return costs[full]


@inner
def gather_treelet(tree, root, treelet):
    """Take the treelet below a node.

    Return the number of its leaves and the sum of the areas of its inner nodes but the root.
    """
    leaves = treelet.leaves
    treelet.inner[0] = root
    leaves[0], leaves[1] = tree.left[root], tree.right[root]
    count, areas = 2, 0.0
    while count < len(leaves):
        largest, most = -1, -1.0
        for i in range(count):
            area = area_of(tree.boxes[leaves[i]])
            if tree.left[leaves[i]] >= 0 and area > most:
                largest, most = i, area
        if largest < 0:
            break
        node = leaves[largest]
        treelet.inner[count - 1] = node
        leaves[largest], leaves[count] = tree.left[node], tree.right[node]
        count += 1
        areas += most
    return count, areas


@inner
def relink(tree, treelet, count):
    """Link the nodes of a treelet as its `children` say."""
    for k in range(count - 2, -1, -1):
        node = treelet.inner[k]
        for side in range(2):
            number = treelet.children[k, side]
            child = treelet.leaves[number] if number < count else treelet.inner[number - count]
            tree.parent[child] = node
            if side == 0:
                tree.left[node] = child
            else:
                tree.right[node] = child
        fit_node(tree, node)


@kernel
def restructure_range(search, tree, nodes, first, last, least, treelet, moves):
    """Restructure the treelet below each node of a list, from `last` - 1 down to `first`."""
    for i in range(last - 1, first - 1, -1):
        if tree.left[nodes[i]] < 0:
            continue
        count, areas = gather_treelet(tree, nodes[i], treelet)
        if count < len(treelet.leaves):
            continue
        gain = areas - arrange(search, tree, treelet, count)
        if gain > least:
            moves.made[0] += 1
            relink(tree, treelet, count)
            for k in range(count - 1):
                node = treelet.inner[k]
                note_event(moves, MOVE, node, tree.left[node], tree.right[node], gain)
                gain = np.nan


def restructure(
    search: Any,
    most: int,
    tree: LinkedTree,
    settings: CostSettings,
    progress: Progress,
    log: bool,
) -> Rearrangement:
    """Restructure all treelets of `most` leaves; a step is one pass over all nodes.

    Parameters
    ----------
    search : NamedTuple
        Decides how treelets are arranged, see :func:`arrange`.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    room = (most - 1) * NODES_AT_ONCE if log else 0
    treelet, work = make_treelet(most), Work(tree, settings, room)

    def restructure_some(nodes: np.ndarray, first: int, last: int) -> None:
        call(
            restructure_range, search, tree, nodes, first, last, work.least, treelet, work.moves
        )  # fmt: skip
        work.keep_events()

    while not settled(work.costs):
        text = f"Treelets, pass {len(work.costs)}"
        from_leaves_up(tree, NODES_AT_ONCE, restructure_some, progress, text)
        work.end_step()
    return work.done()


def restructure_treelets(
    tree: LinkedTree, settings: CostSettings, progress: Progress, log: bool = False
) -> Rearrangement:
    """Replace treelets by the best trees over their leaves.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    sets = 1 << LEAVES
    search = Subsets(
        np.empty((sets, 6)), np.empty(sets), np.empty(sets, np.int32), np.empty(LEAVES, np.int32)
    )
    return restructure(search, LEAVES, tree, settings, progress, log)


OPTIMISER = Optimiser(
    "The best tree over every seven subtrees (Karras and Aila 2013)",
    CostSettings,
    restructure_treelets,
)
