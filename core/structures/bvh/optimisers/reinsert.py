"""Reinsertion: take the worst nodes apart and put their children where they fit best.

A node is inefficient if it is large, larger than its children, and if one of these is small:

    M = SA * SA / (mean SA of the children) * SA / (least SA of the children)

The worst fifth of the inner nodes is taken apart, the worst node first: each of its children in
turn is cut off, and hung beside that node of the remaining tree where the sum of all areas is least
afterwards. Its old place is one of the candidates, so no move makes the tree worse. A step is such
a batch. Some things differ from the paper:

- It cuts off both children at once. Here the second never pays for what becomes of the first.
- Nodes that were taken apart stand back, since some of the worst cannot be bettered: with them
  always in front, reinsertion ended after a quarter to nine tenths of what it gains now.
- Batches are larger than a hundredth: as good, and fewer passes over all nodes to find the worst.

The best place is found by branch and bound. Hanging X beside a node costs the area of the new
parent, SA(node + X), and what all ancestors of the node grow by. The latter only grows on the way
down, and the former is never below SA(X): what that adds up to is a lower bound for a whole
subtree. Nodes wait in a queue, least bound first; when that is no less than the best cost, the
search is over.

J. Bittner, M. Hapala, V. Havran: Fast Insertion-Based Optimization of Bounding Volume Hierarchies,
Computer Graphics Forum 32(1), 2013.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....contract.build_log import REINSERT
from ....contract.costs import CostSettings
from ....geometry.box import area_of, union_area
from ....geometry.box_shape import surface_area
from ....kernels import call, inner, kernel
from ....progress import Progress
from ..topology.tree import LinkedTree
from .rearranging import (
    Optimiser,
    Rearrangement,
    Work,
    attach,
    detach,
    note_event,
    settled,
    sibling_of,
)

BATCH = 0.2
"""Share of the inner nodes that is taken apart in one step."""

PATIENCE = 3
"""Steps that have to gain something together."""

FORGIVE = 1 / 8
"""What M is multiplied with whenever a node was taken apart, so that others have their turn."""

MOST_VISITS = 1 << 13
"""Nodes at which a search ends with the best place so far; fewer than a hundred are usual. It also
bounds the queue, however deep the tree is."""

VISITS_AT_ONCE = 1 << 14
"""Nodes that are looked at in one kernel call, some 20 ms."""

VISITS_PER_MOVE = 16
"""What cutting off and hanging takes, in the time of a visit."""

MOVES_AT_ONCE = VISITS_AT_ONCE // VISITS_PER_MOVE + 2
"""Moves that one kernel call makes at most: it ends with the two children of a node."""


class Queue(NamedTuple):
    """Nodes that wait, as a binary heap: none has a greater bound than the two below it.

    Attributes
    ----------
    bounds : (MOST_VISITS + 2,) float64
    nodes : (MOST_VISITS + 2,) int32
    """

    bounds: np.ndarray
    nodes: np.ndarray


@inner
def push(queue, size, bound, node):
    """Add a node to a queue of `size`."""
    bounds, nodes = queue.bounds, queue.nodes
    i = size
    while i > 0 and bounds[(i - 1) // 2] > bound:
        bounds[i], nodes[i] = bounds[(i - 1) // 2], nodes[(i - 1) // 2]
        i = (i - 1) // 2
    bounds[i], nodes[i] = bound, node


@inner
def pop(queue, size):
    """Take out the node with the least bound; return both."""
    bounds, nodes = queue.bounds, queue.nodes
    bound, node = bounds[0], nodes[0]
    last, last_node = bounds[size - 1], nodes[size - 1]
    i, below = 0, 1
    while below < size - 1:
        if below + 1 < size - 1 and bounds[below + 1] < bounds[below]:
            below += 1
        if bounds[below] >= last:
            break
        bounds[i], nodes[i] = bounds[below], nodes[below]
        i, below = below, 2 * below + 1
    bounds[i], nodes[i] = last, last_node
    return bound, node


@inner
def find_place(tree, root, node, best, queue):
    """Find the node beside which another one costs least, if that is less than `best`.

    Return it, or -1, its cost, and how many nodes were looked at.
    """
    box = tree.boxes[node]
    area = area_of(box)
    place, visits, size = -1, 0, 1
    queue.bounds[0], queue.nodes[0] = area, root
    while size > 0 and visits < MOST_VISITS:
        bound, other = pop(queue, size)
        size -= 1
        if bound >= best:
            break
        visits += 1
        # So far the bound holds what ancestors grow by, and SA(X).
        cost = bound - area + union_area(tree.boxes[other], box)
        if cost < best:
            best, place = cost, other
        bound = cost - area_of(tree.boxes[other]) + area
        if tree.left[other] >= 0 and bound < best:
            push(queue, size, bound, tree.left[other])
            push(queue, size + 1, bound, tree.right[other])
            size += 2
    return place, best, visits


@kernel
def reinsert_children(tree, nodes, first, least, queue, moves):
    """Reinsert the children of each inner node of a list, from `first` on.

    Return the number up to which that is done.
    """
    root = int(nodes[first])
    while tree.parent[root] >= 0:
        root = int(tree.parent[root])
    work = 0
    for i in range(first, len(nodes)):
        if work >= VISITS_AT_ONCE:
            return i
        left, right = tree.left[nodes[i]], tree.right[nodes[i]]
        for node in (left, right):
            parent = tree.parent[node]
            if parent < 0:
                continue  # the other child went below this one, and that was all there was
            sibling = sibling_of(tree, node)
            saved = detach(tree, node)
            if tree.parent[sibling] < 0:
                root = int(sibling)
            place, cost, seen = find_place(tree, root, node, saved - least, queue)
            work += seen + VISITS_PER_MOVE
            if place >= 0:
                moves.made[0] += 1
                note_event(moves, REINSERT, node, place, sibling, saved - cost)
            attach(tree, node, place if place >= 0 else sibling)
            if tree.parent[parent] < 0:
                root = int(parent)
    return len(nodes)


def inefficiency(tree: LinkedTree, nodes: np.ndarray) -> np.ndarray:
    """Return M of inner nodes, (n,) float64."""
    area, left, right = (
        np.maximum(surface_area(tree.boxes[each]), np.finfo(float).tiny)
        for each in (nodes, tree.left[nodes], tree.right[nodes])
    )
    with np.errstate(over="ignore"):
        return area * (area / (0.5 * (left + right))) * (area / np.minimum(left, right))


def greatest(values: np.ndarray, count: int) -> np.ndarray:
    """Return where the greatest values are, the greatest first; of equal ones the first."""
    if count == 0:
        return np.empty(0, np.int64)
    chosen = np.argpartition(-values, count - 1)[:count]
    return chosen[np.lexsort([chosen, -values[chosen]])]


def reinsert_nodes(
    tree: LinkedTree, settings: CostSettings, progress: Progress, log: bool = False
) -> Rearrangement:
    """Reinsert in batches; a step is a batch.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    work = Work(tree, settings, MOVES_AT_ONCE if log else 0)
    n_leaves = (len(tree.left) + 1) // 2
    inner_nodes = np.arange(n_leaves, len(tree.left), dtype=np.int32)
    batch = int(np.ceil(BATCH * len(inner_nodes)))
    factors = np.ones(len(inner_nodes))
    queue = Queue(np.empty(MOST_VISITS + 2), np.empty(MOST_VISITS + 2, np.int32))
    while not settled(work.costs, PATIENCE):
        text = f"Reinserting, step {len(work.costs)}"
        progress.report(0, batch, text)
        worst = greatest(inefficiency(tree, inner_nodes) * factors, batch)
        factors[worst] *= FORGIVE
        nodes, first = inner_nodes[worst], 0
        while first < len(nodes):
            progress.report(first, batch, text)
            first = call(reinsert_children, tree, nodes, first, work.least, queue, work.moves)
            work.keep_events()
        progress.report(batch, batch, text)
        work.end_step()
    return work.done()


OPTIMISER = Optimiser(
    "The worst nodes are taken apart, one after another (Bittner 2013)",
    CostSettings,
    reinsert_nodes,
)
