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
from .clip import fit_to_part
from .storage import Piece
from .work import (
    AXIS,
    BEGIN,
    DEPTH,
    END,
    EVENTS,
    FIRST,
    LEAF,
    MOST_SORTED,
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
def choose_plane(planes, work, node):
    """Choose the plane that splits a node.

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
def area_of(cells, node):
    """Return half the surface area of a cell."""
    x = cells[node, 3] - cells[node, 0]
    y = cells[node, 4] - cells[node, 1]
    z = cells[node, 5] - cells[node, 2]
    return x * y + y * z + z * x


@inner
def list_leaf(state, nodes, node, codes, triangle, listed):
    """Write the triangles of a leaf, in ascending order unless there are many of them.

    Every reference has one event that starts it or is planar.
    """
    begin, place, n = nodes[node, BEGIN], state[N_LISTED], 0
    nodes[node, FIRST] = place
    for i in range(begin, begin + nodes[node, EVENTS]):
        if codes[i] & 3 == END:
            continue
        id_, j = triangle[codes[i] >> 2], place + n
        while n < MOST_SORTED and j > place and listed[j - 1] > id_:
            listed[j] = listed[j - 1]
            j -= 1
        listed[j] = id_
        n += 1
    state[N_LISTED] = place + n


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
    state, nodes, cells = work.state, work.nodes, work.cells
    triangle, boxes, codes = work.triangle, work.boxes, work.codes
    while not is_empty(frontier):
        node = peek(frontier, limits.order)
        n, depth = nodes[node, SIZE], nodes[node, DEPTH]
        if SMALL < n <= limits.aside:
            return ASIDE
        if allowance <= 0:
            return PAUSED
        room = state[WIDTH] * n + 1
        if (
            state[N_NODES] + 2 > nodes.shape[0]
            or state[N_LISTED] + n > work.listed.shape[0]
            or state[N_REFERENCES] + n > triangle.shape[0]
            or state[TOP] + 2 * room + 4 * n > codes.shape[0]
        ):
            return FULL
        allowance -= room + 64
        drop(frontier, limits.order)
        if limits.order == DEPTH_FIRST:
            # Whatever lies above this node belonged to cells that are finished.
            state[TOP] = nodes[node, BEGIN] + room
            state[N_REFERENCES] = nodes[node, REFERENCES]

        # Where to split, if at all.
        axis, position, planar_below = LEAF, 0.0, True
        may_grow = n > limits.max_leaf_size and depth < limits.max_depth
        if may_grow and state[N_NODES] + 2 <= limits.budget:
            axis, position, planar_below = choose_plane(planes, work, node)
        nodes[node, AXIS] = axis
        if axis == LEAF:
            list_leaf(state, nodes, node, codes, triangle, work.listed)
            continue
        left = state[N_NODES]
        state[N_NODES] += 2
        nodes[node, FIRST] = left
        scratch = state[TOP] + 2 * room
        n_below, n_above, n_both = classify(
            planes, work, node, axis, position, planar_below, scratch
        )

        # The children. The left one's lists come last, on top of the stack.
        for side in range(1, -1, -1):
            child = left + side
            nodes[child, DEPTH] = depth + 1
            nodes[child, SIZE] = n_both + (n_above if side == ABOVE else n_below)
            nodes[child, BEGIN] = state[TOP]
            nodes[child, REFERENCES] = state[N_REFERENCES] + n_both
            for other in range(3):
                nodes[child, EVENTS + other] = 0
            state[TOP] += state[WIDTH] * nodes[child, SIZE] + 1
            for face in range(6):
                cells[child, face] = cells[node, face]
            cells[child, axis + 3 * (1 - side)] = position

        # Parts above the plane become references of their own.
        for i in range(n_both):
            reference, new = codes[scratch + i], state[N_REFERENCES] + i
            codes[scratch + n_both + i] = new
            triangle[new] = triangle[reference]
            for face in range(6):
                boxes[new, face] = boxes[reference, face]
        state[N_REFERENCES] += n_both
        grows_below = nodes[left, SIZE] > limits.max_leaf_size and depth + 1 < limits.max_depth
        grows_above = nodes[left + 1, SIZE] > limits.max_leaf_size and depth + 1 < limits.max_depth
        first = 0 if grows_below else n_both
        last = 2 * n_both if grows_above else n_both
        for i in range(first, last):
            reference = codes[scratch + i]
            child = left + BELOW if i < n_both else left + ABOVE
            fit_to_part(corners, triangle[reference], cells, child, work.polygon, boxes, reference)
        divide_lists(planes, work, node, grows_below, grows_above, scratch, n_both)
        for side in range(2):
            # A stack gives back first what was put last.
            child = left + 1 - side if limits.order == DEPTH_FIRST else left + side
            put(frontier, limits.order, child, area_of(cells, child) * nodes[child, SIZE])
    return DONE


# -------------------------------------------------------------------------------- calling kernels

MOST_REFERENCES = 1 << 25
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
