"""Which subtrees become leaves: where testing all triangles costs no more than going on.

From the leaves up, with everything below already at its best:

    Cost(node) = min(C_isect N SA, C_trav SA + Cost(left) + Cost(right))

That is optimal for the given tree, while a builder from the top down must decide before it knows
what comes below.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....contract.costs import CostSettings
from ....contract.workspace import MAXIMUM_DEPTH
from ....geometry.box import area_of
from ....geometry.box_shape import surface_area
from ....kernels import call, inner, kernel, whole
from ....settings import setting
from .tree import LinkedTree, Tree, root_of


@dataclass(frozen=True)
class LeafSettings(CostSettings):
    """Settings of where a tree ends."""

    max_leaf_size: int = setting(
        4,
        "Max Leaf Size",
        "A node with more triangles is always split",
        unit="triangles",
        minimum=1,
        maximum=1024,
    )


class LeafRule(NamedTuple):
    """What decides whether a node is a leaf, for kernels."""

    max_leaf_size: int
    c_trav: float
    c_isect: float

    @classmethod
    def of(cls, settings: LeafSettings) -> LeafRule:
        """Return what settings say."""
        return cls(settings.max_leaf_size, settings.C_trav, settings.C_isect)


class Below(NamedTuple):
    """What is known of every node of a linked tree: arrays of 2n - 1.

    Attributes
    ----------
    preorder : int32
        The nodes, parents before children.
    references : int32
        References below.
    height : int32
        Levels below.
    cost : float64
        Of the best subtree, in units of area.
    is_leaf : bool
        Whether it ends there.
    """

    preorder: np.ndarray
    references: np.ndarray
    height: np.ndarray
    cost: np.ndarray
    is_leaf: np.ndarray


@kernel
def list_preorder(tree, root, out):
    """Write all nodes below `root`, parents before children, left before right.

    The list is its own stack: what waits is kept at its far end.
    """
    waiting = len(out) - 1
    out[waiting] = root
    done = 0
    while waiting < len(out):
        node = out[waiting]
        waiting += 1
        out[done] = node
        done += 1
        if tree.left[node] >= 0:
            waiting -= 2
            out[waiting], out[waiting + 1] = tree.left[node], tree.right[node]


@inner
def leaf_or_node(rule, count, area, children):
    """Return whether `count` references within an area are better a leaf, and the cost of that.

    `children` is what the children cost otherwise; of equal costs the leaf is taken.
    """
    split = rule.c_trav * area + children
    whole = rule.c_isect * count * area
    if count <= rule.max_leaf_size and whole <= split:
        return True, whole
    return False, split


@kernel
def decide_leaves(tree, rule, below):
    """Fill in everything of `below` but its preorder."""
    for i in range(len(below.preorder) - 1, -1, -1):
        node = below.preorder[i]
        left, right = tree.left[node], tree.right[node]
        area = area_of(tree.boxes[node])
        if left < 0:
            below.references[node], below.height[node] = 1, 0
            below.cost[node] = rule.c_isect * area
            below.is_leaf[node] = True
            continue
        count = below.references[left] + below.references[right]
        below.references[node] = count
        below.height[node] = 1 + max(below.height[left], below.height[right])
        children = below.cost[left] + below.cost[right]
        below.is_leaf[node], below.cost[node] = leaf_or_node(rule, count, area, children)


def references_below(tree: LinkedTree) -> np.ndarray:
    """Return how many references are below every node of a linked tree, (2n - 1,) int32."""
    below = below_of(tree)
    call(list_preorder, tree, root_of(tree), below.preorder)
    call(decide_leaves, tree, LeafRule(1, 0.0, 0.0), below)
    return below.references


@inner
def emit_leaf(tree, node, order, done, stack, height):
    """Append the references below a node; return how many there are then."""
    bottom = height
    stack[height, 0] = node
    height += 1
    while height > bottom:
        height -= 1
        node = stack[height, 0]
        if tree.left[node] < 0:
            order[done] = node
            done += 1
        else:
            stack[height, 0], stack[height + 1, 0] = tree.right[node], tree.left[node]
            height += 2
    return done


@kernel
def emit(tree, root, is_leaf, out, order, stack):
    """Write the tree with its leaves, depth-first, siblings together; return its nodes."""
    stack[0, 0], stack[0, 1] = root, 0
    height, taken = 1, 1
    done = whole(0)
    while height > 0:
        height -= 1
        old, new = stack[height, 0], stack[height, 1]
        for side in range(6):
            out.boxes[new, side] = tree.boxes[old, side]
        if is_leaf[old]:
            out.first[new] = done
            done = emit_leaf(tree, old, order, done, stack, height)
            out.size[new] = done - out.first[new]
        else:
            out.first[new], out.size[new] = taken, 0
            stack[height, 0], stack[height, 1] = tree.right[old], taken + 1
            stack[height + 1, 0], stack[height + 1, 1] = tree.left[old], taken
            height += 2
            taken += 2
    return taken


def below_of(tree: LinkedTree) -> Below:
    """Return room for what is known of the nodes of a tree."""
    n_nodes = len(tree.left)
    return Below(
        np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32),
        np.empty(n_nodes), np.empty(n_nodes, np.bool_),
    )  # fmt: skip


def collapse(tree: LinkedTree, rule: LeafRule) -> tuple[Tree, np.ndarray]:
    """Choose leaves and return the tree as walks take it, and its references in order, int32.

    A branch that gets deeper than walks can go is balanced first (:func:`limit_depth`).
    """
    n_nodes, below, root = len(tree.left), below_of(tree), root_of(tree)
    call(list_preorder, tree, root, below.preorder)
    call(decide_leaves, tree, rule, below)
    if below.height[root] > MAXIMUM_DEPTH:
        limit_depth(tree, below)
        call(list_preorder, tree, root, below.preorder)
        call(decide_leaves, tree, rule, below)
    out = Tree(np.empty((n_nodes, 6)), np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32))
    order = np.empty((n_nodes + 1) // 2, np.int32)
    stack = np.empty((2 * MAXIMUM_DEPTH + 4, 2), np.int64)
    taken = call(emit, tree, root, below.is_leaf, out, order, stack)
    return Tree(out.boxes[:taken].copy(), out.first[:taken].copy(), out.size[:taken].copy()), order


def total_cost(tree: Tree, rule: LeafRule) -> float:
    """Return the SAH cost of a tree, in units of area."""
    factors = np.where(tree.size > 0, rule.c_isect * tree.size, rule.c_trav)
    return float((surface_area(tree.boxes) * factors).sum())


@kernel
def find_depths(tree, preorder, depth):
    """Write the depth of every node."""
    for node in preorder:
        depth[node] = 0 if tree.parent[node] < 0 else depth[tree.parent[node]] + 1


@kernel
def balance(tree, leaves, nodes, todo):
    """Link some leaves and inner nodes anew: each node gets half of its leaves on either side.

    Parameters
    ----------
    leaves : (n,) int32
        In their order.
    nodes : (n - 1,) int32
        The first one is above all others.
    todo : (k, 3) int64
        Scratch memory: nodes, and their range of leaves.
    """
    todo[0, 0], todo[0, 1], todo[0, 2] = 0, 0, len(leaves)
    height, used = 1, 1
    while height > 0:
        height -= 1
        place, first, last = todo[height, 0], todo[height, 1], todo[height, 2]
        middle = (first + last) // 2
        for half in range(2):
            a, b = (first, middle) if half == 0 else (middle, last)
            child = leaves[a]
            if b - a > 1:
                child = nodes[used]
                todo[height, 0], todo[height, 1], todo[height, 2] = used, a, b
                height += 1
                used += 1
            side = tree.left if half == 0 else tree.right
            side[nodes[place]], tree.parent[child] = child, nodes[place]
    for i in range(len(nodes) - 1, -1, -1):
        box = tree.boxes[nodes[i]]
        a, b = tree.boxes[tree.left[nodes[i]]], tree.boxes[tree.right[nodes[i]]]
        for axis in range(3):
            box[axis] = min(a[axis], b[axis])
            box[3 + axis] = max(a[3 + axis], b[3 + axis])


def limit_depth(tree: LinkedTree, below: Below) -> None:
    """Balance, in place, what hangs below half of MAXIMUM_DEPTH and is too high for the rest.

    Such branches come from triangles that nest in each other like dolls. The same inner nodes are
    linked anew, over the leaves in the order in which they were.
    """
    n_nodes, half = len(tree.left), MAXIMUM_DEPTH // 2
    depth, todo = np.empty(n_nodes, np.int32), np.empty((MAXIMUM_DEPTH, 3), np.int64)
    call(find_depths, tree, below.preorder, depth)
    tops = (depth[below.preorder] == half) & (below.height[below.preorder] > half)
    for place in np.flatnonzero(tops).tolist():
        top = below.preorder[place]
        nodes = below.preorder[place : place + 2 * below.references[top] - 1]
        is_leaf = tree.left[nodes] < 0
        call(balance, tree, nodes[is_leaf], nodes[~is_leaf], todo)
