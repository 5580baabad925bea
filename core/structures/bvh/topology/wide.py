"""Wide trees: inner nodes with up to four or eight children, collapsed from a binary tree.

Fewer and larger steps: a ray that enters a node tests the volumes of all its children at once, and
inner nodes in between are gone. Which ones go is decided by cost. Every inner node that stays costs
C_trav times its area; the leaves stay as they are. From the leaves up, the best *forest* of at most
k trees that holds everything below a node is either one tree, or two forests of fewer trees:

    Cost(node, 1) = SA(node) + Parts(node, arity)
    Cost(node, k) = min(Cost(node, k - 1), Parts(node, k))
    Parts(node, k) = min over 0 < i < k of Cost(left, i) + Cost(right, k - i)

with a cost of 0 for leaves. That is optimal among all trees whose inner nodes are among the binary
ones.

I. Wald, C. Benthin, S. Boulos: Getting Rid of Packets, RT 2008 (the collapse of a binary tree).
H. Ylitie, T. Karras, S. Laine: Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
BVHs, HPG 2017 (the optimal one).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....contract.workspace import MAXIMUM_DEPTH
from ....geometry.box import area_of
from ....kernels import call, inner, kernel
from .tree import Tree

WIDEST = 8


class WideTree(NamedTuple):
    """A tree with several children per node; node 0 is the root, siblings are neighbours.

    Attributes
    ----------
    boxes : (n_nodes, 6) float64
    first : (n_nodes,) int32
        First child of an inner node, first reference of a leaf.
    size : (n_nodes,) int32
        References of a leaf; 0 marks an inner node.
    width : (n_nodes,) int32
        Children of an inner node; 0 for leaves.
    """

    boxes: np.ndarray
    first: np.ndarray
    size: np.ndarray
    width: np.ndarray


@inner
def parts(tree, costs, node, k):
    """Return the cost of the best two forests of k trees together, and how many are on the left."""
    left = tree.first[node]
    best, best_left = np.inf, 1
    for i in range(1, k):
        cost = costs[left, i] + costs[left + 1, k - i]
        if cost < best:
            best, best_left = cost, i
    return best, best_left


@kernel
def find_costs(tree, arity, costs, first, last):
    """Write Cost(node, k) for ``1 <= k <= arity`` and the nodes ``first <= node < last``.

    Children come behind their parents: the last nodes are to be done first.
    """
    for node in range(last - 1, first - 1, -1):
        if tree.size[node] > 0:
            for k in range(1, arity + 1):
                costs[node, k] = 0.0
            continue
        together, _ = parts(tree, costs, node, arity)
        costs[node, 1] = area_of(tree.boxes[node]) + together
        for k in range(2, arity + 1):
            apart, _ = parts(tree, costs, node, k)
            before = costs[node, k - 1]
            costs[node, k] = apart if apart < before else before


@inner
def list_children(tree, costs, node, arity, waiting, children):
    """Write the children that a node has in the best wide tree, left to right; return how many.

    Parameters
    ----------
    waiting : (WIDEST, 2) int64
        Scratch: a node, and the most trees into which what is below may go.
    children : (WIDEST,) int64
    """
    waiting[0, 0], waiting[0, 1] = node, arity
    height, count, is_root = 1, 0, True
    while height > 0:
        height -= 1
        each, k = waiting[height, 0], waiting[height, 1]
        # As few as do as well: one, if the node stays.
        while k > 1 and not is_root and costs[each, k - 1] == costs[each, k]:
            k -= 1
        is_root = False
        if k == 1:
            children[count] = each
            count += 1
        else:
            _, left = parts(tree, costs, each, k)
            waiting[height, 0], waiting[height, 1] = tree.first[each] + 1, k - left
            waiting[height + 1, 0], waiting[height + 1, 1] = tree.first[each], left
            height += 2
    return count


@kernel
def emit_wide(tree, costs, arity, out, stack, waiting, children):
    """Write the wide tree depth-first, siblings together; return how many nodes it has."""
    stack[0, 0], stack[0, 1] = 0, 0
    height, taken = 1, 1
    while height > 0:
        height -= 1
        old, new = stack[height, 0], stack[height, 1]
        for side in range(6):
            out.boxes[new, side] = tree.boxes[old, side]
        out.size[new], out.width[new] = tree.size[old], 0
        out.first[new] = tree.first[old]
        if tree.size[old] == 0:
            count = list_children(tree, costs, old, arity, waiting, children)
            out.first[new], out.width[new] = taken, count
            for i in range(count - 1, -1, -1):
                stack[height, 0], stack[height, 1] = children[i], taken + i
                height += 1
            taken += count
    return taken


def widened(tree: Tree, arity: int) -> WideTree:
    """Collapse a binary tree to the cheapest one with up to `arity` children, 2 to WIDEST."""
    n_nodes = len(tree.size)
    costs = np.empty((n_nodes, arity + 1))
    call(find_costs, tree, arity, costs, 0, n_nodes)
    out = WideTree(np.empty((n_nodes, 6)), *(np.empty(n_nodes, np.int32) for _ in range(3)))
    stack = np.empty((WIDEST * (MAXIMUM_DEPTH + 1), 2), np.int64)
    scratch = np.empty((WIDEST, 2), np.int64), np.empty(WIDEST, np.int64)
    taken = call(emit_wide, tree, costs, arity, out, stack, *scratch)
    return WideTree(*(array[:taken].copy() for array in out))
