"""Growing a kd-tree: what is the same whoever places the planes.

The builder takes a node that waits, splits it or makes it a leaf, and lets the children wait, until
there are none. Where the plane goes is the business of :mod:`.sah` and :mod:`.static`, which node
is next that of :mod:`..subdivision.frontier`. Without a budget every order gives the same tree,
because a split depends on its cell alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...geometry.box import area_of
from ...geometry.clip import divide_reference
from ...kernels import call, dispatched, kernel
from ...memory import MOST_NUMBERS
from ...progress import Progress
from ..subdivision.frontier import DEPTH_FIRST, Frontier, drop, is_empty, peek, put
from ..subdivision.subtrees import ASIDE, DONE, PAUSED, SMALL, Limits, Meter
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
    SHARE,
    SIZE,
    TOP,
    WAITING,
    WIDTH,
    Work,
    allowed,
    extract,
    room_to_split,
    with_room,
)

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
    n_below, n_both : int
        References below or on both sides, and those on both sides only; these are written to
        `work.codes` from `scratch` on.
    """
    raise TypeError(type(planes).__name__)


@dispatched
def divide_lists(planes, work, node, scratch, n_both):
    """Write the lists of a node's children, and the number of their events.

    A child that is a LEAF already needs but a list of its references, in place of the events
    along x.

    Parameters
    ----------
    scratch : int
        From here on `work.codes` has `n_both` references that go below, then those that their
        parts above have got.
    """
    raise TypeError(type(planes).__name__)


# ----------------------------------------------------------------------------------- the builder


@kernel
def divide_cells(planes, limits, work, frontier, geometry, allowance):
    """Split nodes until none waits, the next has no room, or it is one to hand back.

    Parameters
    ----------
    allowance : int
        Room to use up, as :func:`.work.room_to_split` reckons it. No more arrays are looked at:
        who gives an allowance has seen to it that there is room in all of them.

    Returns
    -------
    DONE, PAUSED or ASIDE
    """
    state, nodes, codes, cells = work.state, work.nodes, work.codes, work.cells
    width = state[WIDTH]
    while not is_empty(frontier):
        node = peek(frontier)
        row = nodes[node]
        n, depth = row[SIZE], row[DEPTH]
        if SMALL < n <= limits.aside and row[AXIS] != LEAF:
            return ASIDE
        allowance -= room_to_split(width, n)
        if allowance < 0:
            return PAUSED
        drop(frontier)
        left, top, n_references = state[N_NODES], state[TOP], state[N_REFERENCES]
        if limits.order == DEPTH_FIRST:
            # Whatever lies above this node belonged to cells that are finished.
            top, n_references = row[BEGIN] + width * n + 1, row[REFERENCES]

        # Where to split, if at all.
        axis, position, planar_below = LEAF, 0.0, True
        if row[AXIS] != LEAF and left + 2 <= limits.budget:
            axis, position, planar_below = choose_plane(planes, work, node, top)
        scratch, n_below, n_both = top + 2 * (width * n + 1), 0, 0
        if axis != LEAF:
            n_below, n_both = classify(planes, work, node, axis, position, planar_below, scratch)
            if n + n_both > limits.references * cells[node, SHARE]:
                axis = LEAF
        row[AXIS] = axis
        if axis == LEAF:
            listed = state[N_LISTED]
            row[FIRST] = listed
            for i in range(row[BEGIN], row[BEGIN] + row[EVENTS]):
                # Every reference has one event that starts it or is planar.
                if codes[i] & 3 != END:
                    work.listed[listed] = work.triangle[codes[i] >> 2]
                    listed += 1
            state[N_LISTED] = listed
            continue
        row[FIRST] = left

        # The children. The left one's lists come last, on top of the stack.
        n_child = n - n_below + n_both
        for child in range(left + 1, left - 1, -1):
            new = nodes[child]
            may_grow = n_child > limits.max_leaf_size and depth + 1 < limits.max_depth
            new[AXIS] = WAITING if may_grow else LEAF
            new[SIZE], new[DEPTH], new[BEGIN] = n_child, depth + 1, top
            new[REFERENCES] = n_references + n_both
            for face in range(6):
                cells[child, face] = cells[node, face]
            cells[child, SHARE] = cells[node, SHARE] * n_child / (n + n_both)
            top += width * n_child + 1
            n_child = n_below
        cells[left, 3 + axis] = cells[left + 1, axis] = position
        state[N_NODES], state[TOP], state[N_REFERENCES] = left + 2, top, n_references + n_both
        # Parts above the plane become references of their own. Leaves need no boxes.
        needs_boxes = nodes[left, AXIS] != LEAF or nodes[left + 1, AXIS] != LEAF
        for i in range(scratch, scratch + n_both):
            codes[i + n_both] = n_references
            triangle = work.triangle[codes[i]]
            work.triangle[n_references] = triangle
            if needs_boxes:
                divide_reference(
                    geometry, triangle, cells, left, axis, work.boxes, codes[i], n_references,
                    work.polygon,
                )  # fmt: skip
            n_references += 1
        divide_lists(planes, work, node, scratch, n_both)

        # A stack gives back first what was put last.
        first = 1 if limits.order == DEPTH_FIRST else 0
        for i in range(2):
            child = left + (i ^ first)
            put(frontier, child, area_of(cells[child]) * nodes[child, SIZE])
    return DONE


# -------------------------------------------------------------------------------- calling kernels

MOST_REFERENCES, MOST_NODES = 1 << 24, 1 << 21
"""At how many a tree is refused, unless the scene has a sixteenth as many triangles, or a
thirty-second."""

MOST_LINKS = MOST_NUMBERS // 4
"""Nodes that can be linked to: two bits of a link are taken by the axis (:mod:`.storage`)."""

ALLOWANCE = 5_000_000
"""Most room that one kernel call uses up, in some 20 ms."""


def meter_of(total: int, progress: Progress) -> Meter:
    """Return what adds up the builders of a tree over `total` triangles.

    Half of it is done with two references for each triangle: how many there will be is not known
    before.
    """
    return Meter(
        "kdtree",
        total,
        progress,
        max(MOST_REFERENCES, 16 * total),
        min(max(MOST_NODES, 32 * total), MOST_LINKS),
        lambda listed: listed / (listed + 2 * total),
    )


class Builder:
    """Builds one tree, or the subtree below a node `root`; subtrees side by side."""

    def __init__(
        self,
        planes: Any,
        limits: Limits,
        memory: tuple[Work, Frontier],
        geometry: Any,
        meter: Meter,
        root: int = 0,
    ) -> None:
        self.planes, self.limits, self.geometry = planes, limits, geometry
        self.meter, self.root = meter, root
        self.work, self.frontier = memory

    def next_node(self) -> int:
        """Return the node whose turn it is."""
        return int(peek(self.frontier))

    def hand_out(self) -> tuple[int, Builder]:
        """Return the next node of a stack and a builder for it.

        Here it becomes an empty leaf, in whose place the subtree will go.
        """
        node, inside = self.next_node(), self.limits._replace(aside=0)
        own = extract(self.work, node, self.limits)
        drop(self.frontier)
        self.work.nodes[node, [AXIS, FIRST, SIZE]] = LEAF, 0, 0
        return node, Builder(self.planes, inside, own, self.geometry, self.meter, node)

    def run(self, reports: bool = False) -> int:
        """Call :func:`divide_cells` until it is DONE, or a node is to be put ASIDE.

        Parameters
        ----------
        reports : bool
            Whether to report progress, which a thread must leave to its caller.
        """
        order = self.limits.order
        while True:
            node = self.next_node()
            room = room_to_split(int(self.work.state[WIDTH]), int(self.work.nodes[node, SIZE]))
            allowance = allowed(self.work, node, order)
            if allowance < room:
                self.work, self.frontier = with_room(
                    self.work, self.frontier, node, order, self.meter.total
                )
                allowance = allowed(self.work, node, order)
            result = call(
                divide_cells, self.planes, self.limits, self.work, self.frontier, self.geometry,
                min(allowance, max(ALLOWANCE, room)),
            )  # fmt: skip
            n_nodes, n_listed = self.work.state[[N_NODES, N_LISTED]].tolist()
            self.meter.check(self.root, n_listed, n_nodes, n_listed)
            if result != PAUSED:
                return result
            if reports:
                self.meter.report()

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
