"""When to stop subdividing, and which cell is split next (lecture, "Adaptive subdivision").

A cell is a candidate if it has more than M triangles and lies above depth K. Candidates wait in a
frontier of one of three disciplines: a stack splits depth-first, a FIFO queue breadth-first, a
priority queue the cell of the highest cost SA n first. The order matters only where a budget of
cells ends the building early: the queue then has refined evenly, the stack only one corner.

A cut lists triangles on both sides of the plane. Where they meet in one point, are long or alike,
cut after cut multiplies them and helps nobody. So there may be a limit of references, `duplication`
times N of N triangles, of which every cell has a *share*: the root the whole, and children divide
their parent's in proportion to their references. A cell stays a leaf where its children would have
more than its share. For any scene, planes and order:

- the shares of the leaves add up to the whole, so a tree never has more than its limit;
- so do those of the cells that any one depth has waiting, which bounds the work, too;
- a cell's children depend on its ancestors alone, so every order gives the same tree.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...kernels import dispatched, implements, inner
from ...memory import MOST_NUMBERS
from ...settings import GIVEN, setting

DEPTH_FIRST, FIFO, PRIORITY = range(3)
ORDERS = {"depth_first": DEPTH_FIRST, "fifo": FIFO, "priority": PRIORITY}

NO_BUDGET = MOST_NUMBERS
"""A budget that stands for any number of nodes: there are no more numbers for them."""


def budget_setting() -> Any:
    """Declare the budget of cells."""
    return setting(
        0,
        "Budget",
        "Number of cells, inner ones included, at which building ends; 0 sets no limit",
        unit="cells",
        minimum=0,
        maximum=NO_BUDGET,
    )


def order_setting() -> Any:
    """Declare the order of splitting."""
    return setting(
        "fifo",
        "Order",
        "Which cell is split next, where the budget ends the building; a replay shows it anyway",
        choices={
            "fifo": "Breadth-first from a FIFO queue: the cells are refined evenly",
            "priority": "The cell of the highest cost, surface area times triangles, first",
            "depth_first": "Depth-first: the budget may go into one corner of the scene",
        },
        only_for={"budget": GIVEN},
    )


class Stack(NamedTuple):
    """Candidates for splitting, for DEPTH_FIRST.

    Attributes
    ----------
    nodes : (capacity,) int32
    state : (2,) int64
        Place of the first candidate, 0, and of the end.
    """

    nodes: np.ndarray
    state: np.ndarray


class Queue(NamedTuple):
    """The same, for FIFO; the first candidate moves up."""

    nodes: np.ndarray
    state: np.ndarray


class PriorityQueue(NamedTuple):
    """The same, for PRIORITY: a binary heap with the `keys`, (capacity,) float64, of the nodes."""

    nodes: np.ndarray
    state: np.ndarray
    keys: np.ndarray


Frontier = Stack | Queue | PriorityQueue
"""Three types, so that a builder compiles no more than the order of its settings needs."""


def make_frontier(capacity: int, order: int = DEPTH_FIRST) -> Frontier:
    """Return an empty frontier. A node is put in once at most, so `capacity` counts nodes."""
    nodes, state = np.zeros(capacity, np.int32), np.zeros(2, np.int64)
    if order == PRIORITY:
        return PriorityQueue(nodes, state, np.zeros(capacity))
    return Stack(nodes, state) if order == DEPTH_FIRST else Queue(nodes, state)


def enlarged(frontier: Frontier, capacity: int) -> Frontier:
    """Return the frontier with room for `capacity` nodes."""
    grown = {}
    for name, array in frontier._asdict().items():
        if name != "state":
            grown[name] = np.zeros(capacity, array.dtype)
            grown[name][: len(array)] = array
    return frontier._replace(**grown)


@inner
def is_empty(frontier):
    """Say whether no candidate is left."""
    return frontier.state[0] == frontier.state[1]


@dispatched
def put(frontier, node, key):
    """Add a candidate; only a priority queue looks at the key, the cost."""
    raise TypeError(type(frontier).__name__)


@dispatched
def peek(frontier):
    """Return the next candidate; it stays."""
    raise TypeError(type(frontier).__name__)


@dispatched
def drop(frontier):
    """Remove the next candidate."""
    raise TypeError(type(frontier).__name__)


@implements(put, Stack)
@implements(put, Queue)
def append(frontier, node, key):
    """Put it last."""
    frontier.nodes[frontier.state[1]] = node
    frontier.state[1] += 1


@implements(peek, Stack)
def last_of(frontier):
    """Return the youngest."""
    return frontier.nodes[frontier.state[1] - 1]


@implements(drop, Stack)
def drop_last(frontier):
    """Remove the youngest."""
    frontier.state[1] -= 1


@implements(peek, Queue)
@implements(peek, PriorityQueue)
def first_of(frontier):
    """Return the eldest, or the costliest."""
    return frontier.nodes[frontier.state[0]]


@implements(drop, Queue)
def drop_first(frontier):
    """Remove the eldest."""
    frontier.state[0] += 1


@inner
def comes_before(frontier, key, node, place):
    """Say whether a candidate goes before the one at a place of the heap."""
    other = frontier.keys[place]
    return key > other or (key == other and node < frontier.nodes[place])


@implements(put, PriorityQueue)
def rise(frontier, node, key):
    """Let it rise from the end of the heap to its place."""
    nodes, keys = frontier.nodes, frontier.keys
    i = frontier.state[1]
    frontier.state[1] = i + 1
    while i > 0 and comes_before(frontier, key, node, (i - 1) // 2):
        nodes[i], keys[i] = nodes[(i - 1) // 2], keys[(i - 1) // 2]
        i = (i - 1) // 2
    nodes[i], keys[i] = node, key


@implements(drop, PriorityQueue)
def sink(frontier):
    """Remove the first; the last one sinks from there to its place."""
    frontier.state[1] -= 1
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
