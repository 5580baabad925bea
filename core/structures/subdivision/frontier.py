"""When to stop subdividing, and which cell is split next (lecture, "Adaptive subdivision").

A cell is a candidate if it has more than M triangles and lies above depth K. Candidates wait in a
frontier of one of three disciplines: a stack splits depth-first, a FIFO queue breadth-first, a
priority queue the cell of the highest cost SA n first. The order matters only where a budget of
cells ends the building early: the queue then has refined evenly, the stack only one corner.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...kernels import inner, kernel
from ...settings import setting

DEPTH_FIRST, FIFO, PRIORITY = range(3)
ORDERS = {"depth_first": DEPTH_FIRST, "fifo": FIFO, "priority": PRIORITY}


def budget_setting() -> Any:
    """Declare the budget of cells."""
    return setting(
        0,
        "Budget",
        "Number of cells, inner ones included, at which building ends; 0 sets no limit",
        unit="cells",
        minimum=0,
        maximum=2**31 - 1,
    )


def order_setting() -> Any:
    """Declare the order of splitting."""
    return setting(
        "fifo",
        "Order",
        "Which cell is split next; it matters where the budget ends the building",
        choices={
            "fifo": "Breadth-first from a FIFO queue: the cells are refined evenly",
            "priority": "The cell of the highest cost, surface area times triangles, first",
            "depth_first": "Depth-first: the budget may go into one corner of the scene",
        },
    )


class Frontier(NamedTuple):
    """Candidates for splitting.

    Attributes
    ----------
    nodes : (capacity,) int32
    keys : (capacity,) float64
        Cost of the nodes; of use to the priority queue only.
    state : (2,) int64
        Place of the first candidate (it moves in a FIFO queue), and of the end.
    """

    nodes: np.ndarray
    keys: np.ndarray
    state: np.ndarray


def make_frontier(capacity: int) -> Frontier:
    """Return an empty frontier. A node is put in once at most, so `capacity` counts nodes."""
    return Frontier(np.zeros(capacity, np.int32), np.zeros(capacity), np.zeros(2, np.int64))


def enlarged(frontier: Frontier, capacity: int) -> Frontier:
    """Return the frontier with room for `capacity` nodes."""
    larger = make_frontier(capacity)
    larger.nodes[: len(frontier.nodes)] = frontier.nodes
    larger.keys[: len(frontier.keys)] = frontier.keys
    larger.state[:] = frontier.state
    return larger


@inner
def is_empty(frontier):
    """Say whether no candidate is left."""
    return frontier.state[0] == frontier.state[1]


@inner
def comes_before(frontier, key, node, place):
    """Say whether a candidate goes before the one at a place of the heap."""
    other = frontier.keys[place]
    return key > other or (key == other and node < frontier.nodes[place])


@inner
def put(frontier, order, node, key):
    """Add a candidate."""
    nodes, keys = frontier.nodes, frontier.keys
    i = frontier.state[1]
    frontier.state[1] = i + 1
    if order == PRIORITY:
        while i > 0 and comes_before(frontier, key, node, (i - 1) // 2):
            nodes[i], keys[i] = nodes[(i - 1) // 2], keys[(i - 1) // 2]
            i = (i - 1) // 2
    nodes[i], keys[i] = node, key


@kernel
def peek(frontier, order):
    """Return the next candidate; it stays."""
    if order == DEPTH_FIRST:
        return frontier.nodes[frontier.state[1] - 1]
    return frontier.nodes[frontier.state[0]]


@inner
def drop(frontier, order):
    """Remove the next candidate."""
    if order == FIFO:
        frontier.state[0] += 1
        return
    frontier.state[1] -= 1
    if order == DEPTH_FIRST:
        return
    nodes, keys, size = frontier.nodes, frontier.keys, frontier.state[1]
    node, key = nodes[size], keys[size]
    i = 0
    while True:
        c = 2 * i + 1
        if c >= size:
            break
        if c + 1 < size and comes_before(frontier, keys[c + 1], nodes[c + 1], c):
            c += 1
        if not comes_before(frontier, keys[c], nodes[c], size):
            break
        nodes[i], keys[i] = nodes[c], keys[c]
        i = c
    nodes[i], keys[i] = node, key
