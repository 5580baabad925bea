"""Growing a kd-tree: what is the same whoever places the planes.

A candidate is a cell that may still be split: its box, and where its references are listed. The
builder takes a candidate, splits it or makes it a leaf, and puts its children among the candidates,
until there are none. Where the plane goes is the business of :mod:`.sah` and :mod:`.static`.

Which candidate is next is the business of :mod:`..subdivision.frontier`. Without a budget every
order gives the same tree, because a split depends on its cell alone. Depth-first needs the least
memory: the lists of a cell lie on top of those of the cells that wait, like a stack.

A *reference* is one triangle in one cell, with the box of the part that is inside. Splitting a cell
keeps the number of a reference on one side and gives it a new one on the other.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...kernels import call, dispatched, inlined, kernel
from ...memory import refuse_if_too_large
from ...progress import Cancelled, Progress
from ..subdivision.frontier import (
    DEPTH_FIRST,
    Frontier,
    drop,
    enlarged,
    is_empty,
    make_frontier,
    peek,
    put,
)
from .clip import POLYGON_SIZE

LEAF = 3
"""Axis of a node that is not split."""

SMALL = 1024
"""References up to which a candidate is not worth a thread."""

# What a call of :func:`grow` ends with.
DONE, PAUSED, FULL, ASIDE = range(4)

# Places in `Work.state`.
N_NODES, N_REFERENCES, N_LISTED, N_SLOTS, N_FREE, TOP = range(6)

# Columns of a candidate.
NODE, DEPTH, SIZE, BEGIN, REFERENCES, EVENTS = range(6)  # EVENTS: of x, then y, then z
N_COLUMNS = 8


class Limits(NamedTuple):
    """When to stop.

    Attributes
    ----------
    max_depth, max_leaf_size : int
    budget : int
        Most nodes of the tree.
    order : int
        DEPTH_FIRST, FIFO or PRIORITY.
    aside : int
        Candidates with at most so many references, but more than SMALL, are left to the caller;
        0 for none.
    """

    max_depth: int
    max_leaf_size: int
    budget: int
    order: int
    aside: int


class Work(NamedTuple):
    """Memory of one builder: the tree so far, the candidates and their lists, scratch.

    Attributes
    ----------
    state : (6,) int64
        How much of the arrays is in use, see N_NODES and the following.
    axis : (nodes,) int8
        Axis of the plane, LEAF for leaves.
    split : (nodes,) float64
    first, size : (nodes,) int32
        Left child of an inner node; place in `listed` and number of references of a leaf.
    listed : (m,) int32
        Triangles of the leaves.
    triangle : (references,) int32
    boxes : (references, 6) float64
    side : (references,) int8
        While a cell is split: where each of its references goes.
    frontier : Frontier
        Nodes that wait; while one does, `first` holds the row of its candidate.
    candidates : (c, N_COLUMNS) int64
    cells : (c, 6) float64
    free : (c,) int32
        Rows of the former that are not in use, N_FREE of the first N_SLOTS.
    positions : (lists,) float64
    codes : (lists,) int32
        The candidates' lists: events or references.
    taken : (3, N_COLUMNS) int64
        The candidate being split, and its two children.
    cell : (1, 6) float64
        The box of the former.
    straddlers : (n,) int32
    fresh_positions : (2 n,) float64
    fresh_codes : (2 n,) int32
        Events of the clipped parts.
    polygon, bounds : (2 * POLYGON_SIZE, 3), (2, 6) float64
    """

    state: np.ndarray
    axis: np.ndarray
    split: np.ndarray
    first: np.ndarray
    size: np.ndarray
    listed: np.ndarray
    triangle: np.ndarray
    boxes: np.ndarray
    side: np.ndarray
    frontier: Frontier
    candidates: np.ndarray
    cells: np.ndarray
    free: np.ndarray
    positions: np.ndarray
    codes: np.ndarray
    taken: np.ndarray
    cell: np.ndarray
    straddlers: np.ndarray
    fresh_positions: np.ndarray
    fresh_codes: np.ndarray
    polygon: np.ndarray
    bounds: np.ndarray


def make_work(n: int, n_lists: int, cell: np.ndarray) -> Work:
    """Return memory to build a tree over n references, whose candidate is in place.

    The system gives pages when they are first written: room that is not needed costs nothing.

    Parameters
    ----------
    n_lists : int
        Length of the root's lists.
    cell : (6,) float64
    """
    work = Work(
        state=np.zeros(6, np.int64),
        axis=np.empty(8 * n + 8, np.int8),
        split=np.empty(8 * n + 8),
        first=np.empty(8 * n + 8, np.int32),
        size=np.empty(8 * n + 8, np.int32),
        listed=np.empty(8 * n + 8, np.int32),
        triangle=np.empty(4 * n + 8, np.int32),
        boxes=np.empty((4 * n + 8, 6)),
        side=np.empty(4 * n + 8, np.int8),
        frontier=make_frontier(8 * n + 8),
        candidates=np.empty((256, N_COLUMNS), np.int64),
        cells=np.empty((256, 6)),
        free=np.empty(256, np.int32),
        positions=np.empty(6 * n_lists),
        codes=np.empty(6 * n_lists, np.int32),
        taken=np.empty((3, N_COLUMNS), np.int64),
        cell=np.empty((1, 6)),
        straddlers=np.empty(n, np.int32),
        fresh_positions=np.empty(2 * n),
        fresh_codes=np.empty(2 * n, np.int32),
        polygon=np.empty((2 * POLYGON_SIZE, 3)),
        bounds=np.empty((2, 6)),
    )
    work.state[[N_NODES, N_REFERENCES, N_SLOTS, TOP]] = 1, n, 1, n_lists
    work.first[0] = 0
    put(work.frontier, DEPTH_FIRST, 0, 0.0)
    work.candidates[0] = 0, 0, n, 0, n, 0, 0, 0
    work.cells[0] = cell
    return work


# --------------------------------------------------------------------------- what planes provide


@dispatched
def list_size(planes, n):
    """Return the room that the lists of a cell with n references take."""
    raise TypeError(type(planes).__name__)


@dispatched
def split_cell(planes, limits, work, corners):
    """Split the candidate in row 0 of `work.taken`, if that is any good.

    Writes the children's lists to `work.positions` and `work.codes` from TOP on, the right child's
    first, and the children to rows 1 and 2 of `work.taken`: SIZE, BEGIN and EVENTS.

    Returns
    -------
    axis : int
        LEAF if the cell is better not split.
    position : float
    """
    raise TypeError(type(planes).__name__)


@dispatched
def list_references(planes, work):
    """Append the triangles of the candidate in row 0 of `work.taken` to `work.listed`."""
    raise TypeError(type(planes).__name__)


# ----------------------------------------------------------------------------------- the builder


@inlined
def box_cost(cells, row, n):
    """Return SA n of a cell, which decides its turn in a priority queue."""
    x = cells[row, 3] - cells[row, 0]
    y = cells[row, 4] - cells[row, 1]
    z = cells[row, 5] - cells[row, 2]
    return (x * y + y * z + z * x) * n


@kernel
def grow(planes, limits, work, corners, allowance):
    """Split candidates until none is left, room or allowance is used up, or one is to hand back.

    Parameters
    ----------
    allowance : int
        Entries of lists to go through, so that the caller is asked back after a while.

    Returns
    -------
    DONE, PAUSED, FULL or ASIDE
    """
    state, taken, cell = work.state, work.taken, work.cell
    frontier, candidates, cells = work.frontier, work.candidates, work.cells
    while not is_empty(frontier):
        node = peek(frontier, limits.order)
        row = work.first[node]
        n = candidates[row, SIZE]
        if SMALL < n <= limits.aside:
            return ASIDE
        if allowance <= 0:
            return PAUSED
        room = list_size(planes, n)
        if (
            state[N_NODES] + 2 > work.axis.shape[0]
            or state[N_LISTED] + n > work.listed.shape[0]
            or state[N_REFERENCES] + n > work.triangle.shape[0]
            or state[N_SLOTS] + 2 > candidates.shape[0]
            or state[TOP] + 2 * room > work.codes.shape[0]
        ):
            return FULL
        allowance -= room + 64

        # Take the candidate out.
        drop(frontier, limits.order)
        work.free[state[N_FREE]] = row
        state[N_FREE] += 1
        for column in range(N_COLUMNS):
            taken[0, column] = candidates[row, column]
        for side in range(6):
            cell[0, side] = cells[row, side]
        depth = taken[0, DEPTH]
        if limits.order == DEPTH_FIRST:
            # Whatever lies above this candidate belonged to cells that are finished.
            state[TOP] = taken[0, BEGIN] + room
            state[N_REFERENCES] = taken[0, REFERENCES]
        axis, position = LEAF, 0.0
        may_split = n > limits.max_leaf_size and depth < limits.max_depth
        if may_split and state[N_NODES] + 2 <= limits.budget:
            axis, position = split_cell(planes, limits, work, corners)
        work.axis[node] = axis
        work.split[node] = position
        if axis == LEAF:
            work.first[node] = state[N_LISTED]
            work.size[node] = n
            list_references(planes, work)
            continue

        left = state[N_NODES]
        state[N_NODES] += 2
        work.first[node] = left
        work.size[node] = 0
        for i in range(2):
            # Depth-first puts the left child last, whose turn is then next.
            child = 2 - i if limits.order == DEPTH_FIRST else 1 + i
            row = state[N_SLOTS]
            if state[N_FREE] > 0:
                state[N_FREE] -= 1
                row = work.free[state[N_FREE]]
            else:
                state[N_SLOTS] += 1
            taken[child, NODE] = left + child - 1
            taken[child, DEPTH] = depth + 1
            taken[child, REFERENCES] = state[N_REFERENCES]
            for column in range(N_COLUMNS):
                candidates[row, column] = taken[child, column]
            for side in range(6):
                cells[row, side] = cell[0, side]
            cells[row, axis if child == 2 else 3 + axis] = position
            work.first[left + child - 1] = row
            put(frontier, limits.order, left + child - 1, box_cost(cells, row, taken[child, SIZE]))
    return DONE


# -------------------------------------------------------------------------------- calling kernels

MOST_REFERENCES = 1 << 25
"""References at which a tree is refused, unless the scene has a sixteenth as many triangles."""


class Meter:
    """Adds up what several builders have done, reports it, and refuses what grows too large."""

    def __init__(self, total: int, progress: Progress) -> None:
        self.total = total
        self.most = max(MOST_REFERENCES, 16 * total)
        self.progress = progress
        self.listed: dict[int, int] = {}
        self.stopped = False

    def check(self, builder: int, work: Work) -> None:
        """Note the references that a builder has listed, one number per builder.

        Raises
        ------
        InputError
            If the tree gets too large.
        Cancelled
            If another builder has failed meanwhile.
        """
        self.listed[builder] = int(work.state[N_LISTED])
        if sum(tuple(self.listed.values())) > self.most:
            raise InputError(
                f"the kdtree has more than {self.most} references to {self.total} triangles; "
                "lower max_depth, raise max_leaf_size or set a budget"
            )
        if self.stopped:
            raise Cancelled

    def report(self) -> None:
        """Report progress; the number of references in the end is not known before."""
        listed = sum(tuple(self.listed.values()))
        self.progress.report(listed, max(4 * self.total, 2 * listed), "Building kdtree")


ALLOWANCE = 2_000_000
"""Entries of lists that one kernel call goes through, in some 20 ms."""


def grow_all(
    planes: Any, limits: Limits, work: Work, corners: np.ndarray, meter: Meter, builder: int
) -> tuple[int, Work]:
    """Call :func:`grow` until it is DONE, or a candidate is to be put ASIDE.

    Returns
    -------
    result : int
    work : Work
        With larger arrays, where they were too small.
    """
    while True:
        result = call(grow, planes, limits, work, corners, ALLOWANCE)
        meter.check(builder, work)
        if result in (DONE, ASIDE):
            return result, work
        if builder == 0:
            meter.report()
        if result == FULL:
            work = enlarged_work(planes, limits, work, meter.total)


def enlarged_work(planes: Any, limits: Limits, work: Work, total: int) -> Work:
    """Return the memory with room to split the next candidate."""
    state = work.state
    n = int(work.candidates[work.first[peek(work.frontier, limits.order)], SIZE])
    if limits.order != DEPTH_FIRST:
        close_gaps(planes, work)
    new: dict[str, Any] = {}

    def provide(used: int, needed: int, *names: str) -> None:
        if used + needed <= len(getattr(work, names[0])):
            return
        length = 2 * (used + needed)
        row_bytes = sum(getattr(work, name)[:1].nbytes for name in names)
        refuse_if_too_large(
            length * row_bytes, f"a kdtree over {total} triangles",
            "lower max_depth, raise max_leaf_size or set a budget",
        )  # fmt: skip
        for name in names:
            old = getattr(work, name)
            new[name] = np.empty((length, *old.shape[1:]), old.dtype)
            new[name][:used] = old[:used]

    provide(int(state[N_NODES]), 2, "axis", "split", "first", "size")
    if "axis" in new:
        new["frontier"] = enlarged(work.frontier, len(new["axis"]))
    provide(int(state[N_LISTED]), n, "listed")
    provide(int(state[N_REFERENCES]), n, "triangle", "boxes", "side")
    provide(int(state[N_SLOTS]), 2, "candidates", "cells", "free")
    provide(int(state[TOP]), 2 * list_size(planes, n), "positions", "codes")
    return work._replace(**new)


def close_gaps(planes: Any, work: Work) -> None:
    """Move the lists of the candidates together; those of split cells lie in between.

    A stack gets rid of them by itself.
    """
    first, last = work.frontier.state
    rows = work.first[work.frontier.nodes[first:last]]
    top = 0
    for row in rows[np.argsort(work.candidates[rows, BEGIN])]:
        begin = int(work.candidates[row, BEGIN])
        length = list_size(planes, int(work.candidates[row, SIZE]))
        for lists in (work.positions, work.codes):
            lists[top : top + length] = lists[begin : begin + length].copy()
        work.candidates[row, BEGIN] = top
        top += length
    work.state[TOP] = top
