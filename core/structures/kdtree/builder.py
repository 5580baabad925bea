"""Growing a kd-tree: what is the same whoever places the planes.

The builder takes a node that waits, splits it or makes it a leaf, and lets the children wait, until
there are none. Where the plane goes is the business of :mod:`.sah` and :mod:`.static`, which node
is next that of :mod:`..subdivision.frontier`. Without a budget every order gives the same tree,
because a split depends on its cell alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError
from ...kernels import call, dispatched, inner, kernel
from ...progress import Cancelled, Progress
from ..subdivision.frontier import DEPTH_FIRST, Frontier, drop, is_empty, peek, put
from .clip import divide_reference
from .storage import Piece
from .work import (
    AXIS,
    BEGIN,
    DEPTH,
    END,
    EVENTS,
    FIRST,
    LEAF,
    N_LISTED,
    N_NODES,
    N_REFERENCES,
    REFERENCES,
    SIZE,
    TOP,
    WIDTH,
    Limits,
    Work,
    with_room,
)

SMALL = 1024
"""References up to which a node is not worth a thread."""

DONE, PAUSED, FULL, ASIDE = range(4)
"""What a call of :func:`grow` ends with."""

BELOW, ABOVE, BOTH = range(3)
"""Sides of a reference."""


# --------------------------------------------------------------------------- what planes provide


@dispatched
def choose_plane(planes, work, node, scratch):
    """Choose the plane that splits a node; `work.positions` is free from `scratch` on.

    Returns
    -------
    axis : int
        LEAF if the node is better not split.
    position : float
    planar_below : bool
        Whether triangles that lie in the plane go below.
    """
    raise TypeError(type(planes).__name__)


@dispatched
def classify(planes, work, node, axis, position, planar_below, scratch):
    """Write the side of every reference of a node to `work.side`.

    Returns
    -------
    n_below, n_above, n_both : int
        Those on both sides are written to `work.codes` from `scratch` on.
    """
    raise TypeError(type(planes).__name__)


@dispatched
def divide_lists(planes, work, node, grows_below, grows_above, scratch, n_both):
    """Write the lists of a node's children.

    Parameters
    ----------
    grows_below, grows_above : bool
        Whether that child may be split. If not, it needs but a list of its references in place
        of the events along x.
    scratch : int
        From here on `work.codes` has `n_both` references that go below, then those that their
        parts above have got.
    """
    raise TypeError(type(planes).__name__)


# ----------------------------------------------------------------------------------- the builder


@inner
def area_of(cell):
    """Return half the surface area of a cell."""
    x, y, z = cell[3] - cell[0], cell[4] - cell[1], cell[5] - cell[2]
    return x * y + y * z + z * x


@inner
def make_child(nodes, node, depth, n, begin, n_references):
    """Write the row of a node that waits; its lists are still empty."""
    row = nodes[node]
    row[SIZE], row[DEPTH], row[BEGIN], row[REFERENCES] = n, depth, begin, n_references
    for axis in range(3):
        row[EVENTS + axis] = 0


@kernel
def grow(planes, limits, work, frontier, corners, allowance):
    """Split nodes until none waits, room or allowance is used up, or one is to hand back.

    Parameters
    ----------
    allowance : int
        Entries of lists to go through, so that the caller is asked back after a while.

    Returns
    -------
    DONE, PAUSED, FULL or ASIDE
    """
    state, nodes, codes = work.state, work.nodes, work.codes
    while not is_empty(frontier):
        node = peek(frontier, limits.order)
        row = nodes[node]
        n, depth = row[SIZE], row[DEPTH]
        if SMALL < n <= limits.aside:
            return ASIDE
        if allowance <= 0:
            return PAUSED
        room = state[WIDTH] * n + 1
        left, top, n_references = state[N_NODES], state[TOP], state[N_REFERENCES]
        if (
            left + 2 > nodes.shape[0]
            or state[N_LISTED] + n > work.listed.shape[0]
            or n_references + n > work.triangle.shape[0]
            or top + 2 * room + 4 * n > codes.shape[0]
        ):
            return FULL
        allowance -= room + 64
        drop(frontier, limits.order)
        if limits.order == DEPTH_FIRST:
            # Whatever lies above this node belonged to cells that are finished.
            top, n_references = row[BEGIN] + room, row[REFERENCES]

        # Where to split, if at all.
        axis, position, planar_below = LEAF, 0.0, True
        may_grow = n > limits.max_leaf_size and depth < limits.max_depth
        if may_grow and left + 2 <= limits.budget:
            axis, position, planar_below = choose_plane(planes, work, node, top)
        row[AXIS] = axis
        if axis == LEAF:
            row[FIRST] = state[N_LISTED]
            for i in range(row[BEGIN], row[BEGIN] + row[EVENTS]):
                # Every reference has one event that starts it or is planar.
                if codes[i] & 3 != END:
                    work.listed[state[N_LISTED]] = work.triangle[codes[i] >> 2]
                    state[N_LISTED] += 1
            continue
        row[FIRST] = left
        state[N_NODES] = left + 2
        scratch = top + 2 * room
        n_below, n_above, n_both = classify(
            planes, work, node, axis, position, planar_below, scratch
        )

        # The children. The left one's lists come last, on top of the stack.
        n_below, n_above = n_below + n_both, n_above + n_both
        make_child(nodes, left + 1, depth + 1, n_above, top, n_references + n_both)
        top += state[WIDTH] * n_above + 1
        make_child(nodes, left, depth + 1, n_below, top, n_references + n_both)
        state[TOP] = top + state[WIDTH] * n_below + 1
        for face in range(6):
            work.cells[left, face] = work.cells[left + 1, face] = work.cells[node, face]
        work.cells[left, 3 + axis] = work.cells[left + 1, axis] = position

        # Parts above the plane become references of their own. Leaves need no boxes.
        grows_below = n_below > limits.max_leaf_size and depth + 1 < limits.max_depth
        grows_above = n_above > limits.max_leaf_size and depth + 1 < limits.max_depth
        state[N_REFERENCES] = n_references + n_both
        for i in range(n_both):
            old, new = codes[scratch + i], n_references + i
            codes[scratch + n_both + i] = new
            work.triangle[new] = work.triangle[old]
            if grows_below or grows_above:
                divide_reference(
                    corners, work.triangle, work.cells, left, work.boxes, old, new, work.polygon
                )
        divide_lists(planes, work, node, grows_below, grows_above, scratch, n_both)

        # A stack gives back first what was put last.
        first = 1 if limits.order == DEPTH_FIRST else 0
        for i in range(2):
            child = left + (i ^ first)
            put(frontier, limits.order, child, area_of(work.cells[child]) * nodes[child, SIZE])
    return DONE


# -------------------------------------------------------------------------------- calling kernels

MOST_REFERENCES = 1 << 24
"""References at which a tree is refused, unless the scene has a sixteenth as many triangles."""

ALLOWANCE = 2_000_000
"""Entries of lists that one kernel call goes through, in some 20 ms."""


class Meter:
    """Adds up what several builders have done, reports it, and refuses what grows too large."""

    def __init__(self, total: int, progress: Progress) -> None:
        self.total = total
        self.most = max(MOST_REFERENCES, 16 * total)
        self.progress = progress
        self.listed: dict[int, int] = {}
        self.stopped = False

    def check(self, builder: int, listed: int) -> None:
        """Note how many references a builder, named by its root, has listed.

        Raises
        ------
        InputError
            If the tree gets too large.
        Cancelled
            If another builder has failed meanwhile.
        """
        self.listed[builder] = listed
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


class Builder:
    """Builds one tree, or the subtree below a node `root`; subtrees side by side."""

    def __init__(
        self,
        planes: Any,
        limits: Limits,
        memory: tuple[Work, Frontier],
        corners: np.ndarray,
        meter: Meter,
        root: int = 0,
    ) -> None:
        self.planes, self.limits, self.corners = planes, limits, corners
        self.meter, self.root = meter, root
        self.work, self.frontier = memory

    def next_node(self) -> int:
        """Return the node whose turn it is."""
        nodes, state = self.frontier.nodes, self.frontier.state
        return int(nodes[state[1] - 1] if self.limits.order == DEPTH_FIRST else nodes[state[0]])

    def leave_out(self, node: int) -> None:
        """Make the next node of a stack an empty leaf, in whose place a subtree will go."""
        self.frontier.state[1] -= 1
        self.work.nodes[node, [AXIS, FIRST, SIZE]] = LEAF, 0, 0

    def run(self, reports: bool = False) -> int:
        """Call :func:`grow` until it is DONE, or a node is to be put ASIDE.

        Parameters
        ----------
        reports : bool
            Whether to report progress, which a thread must leave to its caller.
        """
        while True:
            result = call(
                grow, self.planes, self.limits, self.work, self.frontier, self.corners, ALLOWANCE
            )
            self.meter.check(self.root, int(self.work.state[N_LISTED]))
            if result in (DONE, ASIDE):
                return result
            if reports:
                self.meter.report()
            if result == FULL:
                self.work, self.frontier = with_room(
                    self.work, self.frontier, self.next_node(), self.limits.order, self.meter.total
                )

    def finished(self) -> Piece:
        """Return the tree; all other memory is given back."""
        n_nodes, n_listed = self.work.state[[N_NODES, N_LISTED]]
        nodes = self.work.nodes[:n_nodes]
        axis, first = nodes[:, AXIS], nodes[:, FIRST]
        # The plane is where the left child ends.
        split = np.zeros(n_nodes)
        is_inner = axis != LEAF
        split[is_inner] = self.work.cells[first[is_inner], 3 + axis[is_inner]]
        return Piece(
            axis.astype(np.int8), split, first.copy(), nodes[:, SIZE].astype(np.int32),
            self.work.listed[:n_listed].copy(),
        )  # fmt: skip
