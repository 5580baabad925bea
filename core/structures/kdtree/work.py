"""The memory of one builder of a kd-tree: the nodes so far, their lists, scratch.

A node that may still be split waits in a frontier (:mod:`..subdivision.frontier`), and its row says
where its lists are. Depth-first needs the least memory: the lists of a cell lie on top of those of
the cells that wait, like a stack.

A *reference* is one triangle in one cell, with the box of the part that is inside. Splitting a cell
keeps the number of a reference on one side and gives it a new one on the other.

A cell's lists hold *events*: along an axis, the box of a reference ends, lies in a plane, or starts
at a position. A code is 4 * reference + kind. Where only the references matter, all are starts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...geometry.clip import POLYGON_SIZE
from ...kernels import kernel
from ...memory import refuse_if_too_large
from ..subdivision.frontier import DEPTH_FIRST, Frontier, enlarged, make_frontier
from ..subdivision.settings import ADVICE
from ..subdivision.subtrees import Limits

LEAF = 3
"""Axis of a node that is not split."""

WAITING = -1
"""Axis of a node that may still be split."""

END, PLANAR, START = range(3)
"""Kinds of events."""

# Places in `Work.state`.
N_NODES, N_REFERENCES, N_LISTED, TOP, WIDTH = range(5)

# Columns of a node.
AXIS, FIRST, SIZE, DEPTH, BEGIN, REFERENCES, EVENTS = range(7)  # EVENTS: of x, then y, then z
N_COLUMNS = 9
LEAST_ROOM = 1 << 12
"""Triangles that there is room for at least: a deep tree over a few of them would otherwise come
back for more after every few nodes."""

SHARE = 6
"""Column of a cell, after its box."""


class Work(NamedTuple):
    """Memory of one builder.

    Attributes
    ----------
    state : (5,) int64
        How much is in use: nodes, references, `listed`, lists (TOP). WIDTH is the room that the
        lists of a cell need per reference.
    nodes : (nodes, N_COLUMNS) int64
        AXIS of the plane, LEAF for leaves; FIRST, the left child, of a leaf its place in `listed`;
        SIZE, the references; DEPTH; while it waits: BEGIN and number of its EVENTS per axis, and
        how many REFERENCES there were.
    cells : (nodes, 7) float64
        Box, then the SHARE of the references that the tree may have.
    listed : (m,) int32
        Triangles of the leaves.
    triangle : (references,) int32
    boxes : (references, 6) float64
    side : (references,) int8
        While a cell is split: where each of its references goes.
    positions : (lists,) float64
    codes : (lists,) int32
        The events.
    polygon : (2 * POLYGON_SIZE, 3) float64
        Scratch.
    """

    state: np.ndarray
    nodes: np.ndarray
    cells: np.ndarray
    listed: np.ndarray
    triangle: np.ndarray
    boxes: np.ndarray
    side: np.ndarray
    positions: np.ndarray
    codes: np.ndarray
    polygon: np.ndarray


def make_work(n: int, width: int, cell: np.ndarray, limits: Limits) -> tuple[Work, Frontier]:
    """Return memory to build a tree over n references, whose root waits without lists.

    The system gives pages when they are first written: room that is not needed costs nothing.

    Parameters
    ----------
    width : int
        See `Work.state`.
    cell : (7,) float64
        Box and share.
    """
    room = max(n, LEAST_ROOM)
    lists = 6 * (width * room + 1)
    work = Work(
        state=np.array([1, n, 0, width * n + 1, width]),
        nodes=np.empty((8 * room + 8, N_COLUMNS), np.int64),
        cells=np.empty((8 * room + 8, 7)),
        listed=np.empty(8 * room + 8, np.int32),
        triangle=np.empty(4 * room + 8, np.int32),
        boxes=np.empty((4 * room + 8, 6)),
        side=np.empty(4 * room + 8, np.int8),
        positions=np.empty(lists),
        codes=np.empty(lists, np.int32),
        polygon=np.empty((2 * POLYGON_SIZE, 3)),
    )
    axis = WAITING if n > limits.max_leaf_size and limits.max_depth > 0 else LEAF
    work.nodes[0] = axis, 0, n, 0, 0, n, 0, 0, 0
    work.cells[0] = cell
    frontier = make_frontier(len(work.nodes), limits.order)
    frontier.state[1] = 1  # the root waits
    return work, frontier


def start(
    boxes: np.ndarray,
    cell: np.ndarray,
    width: int,
    lists: list[tuple[np.ndarray, np.ndarray]],
    limits: Limits,
) -> tuple[Work, Frontier]:
    """Return the memory of a builder that starts with a list of events per axis.

    Parameters
    ----------
    boxes : (n, 6) float64
        Of all triangles.
    cell : (7,) float64
        Box and share.
    lists
        Positions and codes of the events along x, y and z.
    """
    n = len(boxes)
    work, frontier = make_work(n, width, cell, limits)
    work.triangle[:n] = np.arange(n)
    work.boxes[:n] = boxes
    for axis, (positions, codes) in enumerate(lists):
        begin = 2 * n * axis
        work.positions[begin : begin + len(positions)] = positions
        work.codes[begin : begin + len(codes)] = codes
        work.nodes[0, EVENTS + axis] = len(codes)
    return work, frontier


def extract(work: Work, node: int, limits: Limits) -> tuple[Work, Frontier]:
    """Return the memory of a builder of its own for a node, whose references are numbered anew."""
    row = work.nodes[node]
    n, begin = int(row[SIZE]), int(row[BEGIN])
    lists = []
    for axis in range(3):
        first = begin + 2 * n * axis
        last = first + int(row[EVENTS + axis])
        lists.append((work.positions[first:last], work.codes[first:last]))
    codes = lists[0][1]
    references = codes[(codes & 3) != END] >> 2
    number = np.empty(int(work.state[N_REFERENCES]), np.int32)
    number[references] = np.arange(n)
    lists = [(positions, 4 * number[codes >> 2] + (codes & 3)) for positions, codes in lists]
    own, frontier = start(
        work.boxes[references], work.cells[node], int(work.state[WIDTH]), lists, limits,
    )  # fmt: skip
    own.triangle[:n] = work.triangle[references]
    own.nodes[0, [AXIS, DEPTH]] = row[[AXIS, DEPTH]]
    return own, frontier


def with_room(
    work: Work, frontier: Frontier, node: int, order: int, total: int
) -> tuple[Work, Frontier]:
    """Return the memory with room to split a node.

    Parameters
    ----------
    total : int
        Triangles of the scene, for the message.

    Raises
    ------
    InputError
        If the machine has too little memory.
    """
    state, n = work.state, int(work.nodes[node, SIZE])
    room = room_to_split(int(state[WIDTH]), n)
    if order != DEPTH_FIRST:
        close_gaps(work, frontier)
        room += int(state[TOP])  # half of the room is to be free, or the gaps come back too soon
    new: dict[str, Any] = {}

    def provide(used: int, needed: int, *names: str) -> None:
        if used + needed <= len(getattr(work, names[0])):
            return
        length = 2 * (used + needed)
        row_bytes = sum(getattr(work, name)[:1].nbytes for name in names)
        refuse_if_too_large(
            length * row_bytes, f"a kdtree over {total} triangles",
            ADVICE,
        )  # fmt: skip
        for name in names:
            old = getattr(work, name)
            new[name] = np.empty((length, *old.shape[1:]), old.dtype)
            new[name][:used] = old[:used]

    provide(int(state[N_NODES]), room // 4 + 1, "nodes", "cells")
    if "nodes" in new:
        frontier = enlarged(frontier, len(new["nodes"]))
    provide(int(state[N_LISTED]), n, "listed")
    provide(int(state[N_REFERENCES]), n, "triangle", "boxes", "side")
    provide(int(state[TOP]), room, "positions", "codes")
    return work._replace(**new), frontier


@kernel
def room_to_split(width, n):
    """Return the room that splitting a cell takes above TOP: two cells' lists, and scratch."""
    return 2 * (width * n + 1) + 4 * n


def allowed(work: Work, node: int, order: int) -> int:
    """Return how much room nodes may use up, as :func:`room_to_split` reckons, before some is full.

    A node takes as many places for references at most as it has. One that is split has a triangle
    at least, so its room is eight or more for the two new nodes.
    """
    state, row = work.state, work.nodes[node]
    top, n_references, width = int(state[TOP]), int(state[N_REFERENCES]), int(state[WIDTH])
    if order == DEPTH_FIRST:
        # Whatever lies above the next node is free.
        top, n_references = int(row[BEGIN] + width * row[SIZE]) + 1, int(row[REFERENCES])
    of_references = min(
        len(work.listed) - int(state[N_LISTED]), len(work.triangle) - n_references
    )  # fmt: skip
    return min(
        4 * (len(work.nodes) - int(state[N_NODES])), room_to_split(width, of_references),
        len(work.codes) - top,
    )  # fmt: skip


def close_gaps(work: Work, frontier: Frontier) -> None:
    """Move the lists of the nodes that wait together; those of split cells lie in between.

    A stack gets rid of them by itself.
    """
    first, last = frontier.state
    waiting = frontier.nodes[first:last]
    waiting = waiting[np.argsort(work.nodes[waiting, BEGIN])]
    sizes = work.state[WIDTH] * work.nodes[waiting, SIZE] + 1
    begins = np.cumsum(sizes) - sizes
    moved = np.repeat(work.nodes[waiting, BEGIN] - begins, sizes)
    old = np.arange(len(moved)) + moved
    for lists in (work.positions, work.codes):
        lists[: len(old)] = lists[old]
    work.nodes[waiting, BEGIN] = begins
    work.state[TOP] = len(old)
