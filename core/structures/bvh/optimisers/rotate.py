r"""Tree rotations: exchange a child with a grandchild, or two grandchildren, where that pays.

Below a node are its children and up to four grandchildren. Six exchanges change the boxes of the
children only, never that of the node itself or of anything above:

         N                child with grandchild:       A <-> b, A <-> c
       /   \                                            B <-> d, B <-> e (the same, mirrored)
      A     B             grandchild with grandchild:  d <-> b, d <-> c
     / \   / \
    d   e b   c

At every node, from the leaves up, the exchange with the greatest gain is made. Passes over the
tree follow each other until they gain next to nothing: hill climbing, it ends in a local optimum.

A. Kensler: Tree Rotations for Improving Bounding Volume Hierarchies, RT 2008.
"""

from __future__ import annotations

import numpy as np

from ....contract.build_log import MOVE
from ....contract.costs import CostSettings
from ....geometry.box import area_of, union_area
from ....kernels import call, inner, kernel
from ....progress import Progress
from ..topology.tree import LinkedTree
from .rearranging import (
    Optimiser,
    Rearrangement,
    Work,
    fit_node,
    from_leaves_up,
    hang,
    note_event,
    settled,
    sibling_of,
)

NODES_AT_ONCE = 1 << 16
"""Nodes in one kernel call, some 20 ms."""


@inner
def exchange(tree, a, b):
    """Let two nodes of different parents change places."""
    above_a, above_b = tree.parent[a], tree.parent[b]
    hang(tree, b, above_a, a)
    hang(tree, a, above_b, b)


@inner
def best_exchange(tree, node):
    """Return the two nodes to exchange below a node, and the area that this gains."""
    boxes = tree.boxes
    first, second, gain = -1, -1, 0.0
    for mirrored in range(2):
        child = tree.right[node] if mirrored else tree.left[node]
        other = sibling_of(tree, child)
        if tree.left[other] < 0:
            continue
        area = area_of(boxes[other])
        for k in range(2):
            moved = tree.right[other] if k else tree.left[other]
            saved = area - union_area(boxes[child], boxes[sibling_of(tree, moved)])
            if saved > gain:
                first, second, gain = child, moved, saved
    a, b = tree.left[node], tree.right[node]
    if tree.left[a] >= 0 and tree.left[b] >= 0:
        area = area_of(boxes[a]) + area_of(boxes[b])
        stays, moved = tree.left[a], tree.right[a]
        for k in range(2):
            partner = tree.right[b] if k else tree.left[b]
            rest = sibling_of(tree, partner)
            saved = area - union_area(boxes[stays], boxes[partner])
            saved -= union_area(boxes[moved], boxes[rest])
            if saved > gain:
                first, second, gain = moved, partner, saved
    return first, second, gain


@kernel
def rotate_range(tree, nodes, first, last, least, moves):
    """Make the best exchange below each node of a list, from `last` - 1 down to `first`."""
    for i in range(last - 1, first - 1, -1):
        node = nodes[i]
        if tree.left[node] < 0:
            continue
        a, b, gain = best_exchange(tree, node)
        if gain > least:
            exchange(tree, a, b)
            for child in (tree.left[node], tree.right[node]):
                if tree.left[child] >= 0:
                    fit_node(tree, child)
            moves.made[0] += 1
            for parent in (tree.parent[a], tree.parent[b]):
                note_event(moves, MOVE, parent, tree.left[parent], tree.right[parent], gain)
                gain = np.nan


def rotate_subtrees(
    tree: LinkedTree, settings: CostSettings, progress: Progress, log: bool = False
) -> Rearrangement:
    """Rotate; a step is one pass over all nodes.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    work = Work(tree, settings, 2 * NODES_AT_ONCE if log else 0)

    def rotate(nodes: np.ndarray, first: int, last: int) -> None:
        call(rotate_range, tree, nodes, first, last, work.least, work.moves)
        work.keep_events()

    while not settled(work.costs):
        text = f"Rotating, pass {len(work.costs)}"
        from_leaves_up(tree, NODES_AT_ONCE, rotate, progress, text)
        work.end_step()
    return work.done()


OPTIMISER = Optimiser(
    "Children and grandchildren change places (Kensler 2008)",
    CostSettings,
    rotate_subtrees,
)
