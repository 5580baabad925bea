"""Building a BSP tree: memory, progress, and who builds which part.

The kernels are in :mod:`.grow`. Where the order makes no difference, cells are split depth-first,
and large subtrees by threads of their own (:mod:`..subdivision.subtrees`, :mod:`.grown`).
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ...geometry.shapes import Shapes
from ...kernels import call
from ...memory import MOST_NUMBERS, refuse_if_too_large
from ...progress import Progress
from ...ranges import longer
from ..subdivision.frontier import DEPTH_FIRST, drop, enlarged, make_frontier, peek
from ..subdivision.settings import ADVICE
from ..subdivision.subtrees import (
    ASIDE,
    DONE,
    PAUSED,
    Limits,
    Meter,
    build_with_threads,
    follows_order,
    in_any_order,
)
from .grow import (
    AREA,
    BEGIN,
    COUNT,
    DEPTH,
    LINK,
    LISTED,
    NEEDS_LISTED,
    NEEDS_NODES,
    NEEDS_REFERENCES,
    PARENT,
    POINTS,
    REFERENCES,
    SHARE,
    Growing,
    cut_cells,
    sweep,
)
from .grown import Grown, joined, numbered
from .planes import make_scratch
from .polyhedron import Polyhedra, make_polyhedra
from .references import Lists

MOST_REFERENCES = 1 << 22
"""References at which a tree is refused, unless the scene has a sixteenth as many triangles."""

SLICE = 0.05
"""Seconds between two looks at the cancel button."""

SUBTREE = 1 << 13
"""References up to which a subtree is built by one thread."""


class Builder:
    """Builds one tree, or the subtree below a node `root`; subtrees side by side."""

    def __init__(
        self,
        rule: Any,
        limits: Limits,
        memory: tuple[Growing, Lists, Polyhedra],
        facets: np.ndarray,
        shell: float,
        meter: Meter,
        root: int = 0,
    ) -> None:
        self.rule, self.limits, self.facets, self.shell = rule, limits, facets, shell
        self.tree, self.lists, self.room = memory
        self.meter, self.root = meter, root
        self.scratch = make_scratch()
        self.work = 1 << 12

    def run(self, reports: bool = False) -> int:
        """Split cells until the tree is DONE, or a cell is to be put ASIDE.

        Parameters
        ----------
        reports : bool
            Whether to report progress, which a thread must leave to its caller.
        """
        while True:
            begin = time.perf_counter()
            status = call(
                cut_cells, self.rule, self.limits, self.tree, self.lists, self.room, self.scratch,
                self.facets, self.shell, self.work,
            )  # fmt: skip
            seconds = time.perf_counter() - begin
            self.meter.check(
                self.root, int(self.lists.used[LISTED]), int(self.tree.used[0]),
                float(self.tree.done[0]),
            )  # fmt: skip
            if reports:
                self.meter.report()
            if status in (DONE, ASIDE):
                return status
            if status == PAUSED:
                self.work = 2 * self.work if seconds < SLICE else max(self.work // 2, 1)
                continue
            most, order = self.meter.most_references, self.limits.order
            self.tree, self.lists = with_room(self.tree, self.lists, status, most, order)

    def hand_out(self) -> tuple[int, Builder]:
        """Return the next node of a stack and a builder for the subtree below it.

        The node becomes an empty leaf, in whose place the subtree will go.
        """
        node = int(peek(self.tree.frontier))
        row = self.tree.nodes[node]
        begin, n, depth = int(row[BEGIN]), int(row[COUNT]), int(row[DEPTH])
        lists, references = self.lists, slice(begin, begin + n)
        first = int(lists.start[begin])
        points = lists.points[first : int(lists.start[begin + n - 1] + lists.size[begin + n - 1])]
        tree, own = make_memory(
            lists.item[references], lists.start[references] - first, lists.size[references],
            points, lists.is_cut, DEPTH_FIRST,
        )  # fmt: skip
        tree.nodes[0, DEPTH] = depth
        tree.planes[0, [AREA, SHARE]] = self.tree.planes[node, [AREA, SHARE]]
        room = make_polyhedra(len(self.room.n_faces), np.zeros(6))
        for mine, theirs in zip(room[:3], self.room[:3], strict=True):
            mine[depth] = theirs[depth]
        drop(self.tree.frontier)
        leaf = int(self.tree.used[1])
        self.tree.used[1] = leaf + 1
        row[[LINK, BEGIN]] = -1 - leaf, lists.used[LISTED]
        builder = Builder(
            self.rule, self.limits._replace(aside=0), (tree, own, room), self.facets, self.shell,
            self.meter, node,
        )  # fmt: skip
        return node, builder

    def finished(self) -> Grown:
        """Return the tree; all other memory is given back."""
        return finish(self.tree, self.lists)


def grow_tree(
    rule: Any,
    limits: Limits,
    shapes: Shapes,
    box: np.ndarray,
    shell: float,
    progress: Progress,
    threads: int = 0,
) -> Grown:
    """Build a tree; the number of threads makes no difference to it.

    Parameters
    ----------
    rule : Heuristic or Autopartition
    limits : Limits
        Without a budget the order only decides how nodes are numbered.
    shapes : Shapes
        Of the items.
    box : (6,) float64
        The root's cell.
    shell : float
        Distance from a plane within which a point counts as on it.
    threads : int
        0 takes every core.

    Raises
    ------
    InputError
        When the tree gets too large.
    Cancelled
        From `progress`.
    """
    n = len(shapes.start)
    order = limits.order
    in_order = follows_order(limits)
    if not in_order:
        limits = in_any_order(limits, n, SUBTREE)
    tree, lists = start(shapes, box, limits.order)
    rows = limits.max_depth + 1 if limits.order == DEPTH_FIRST else 3
    meter = Meter(
        "bsp", n, progress, max(MOST_REFERENCES, 16 * n), MOST_NUMBERS, lambda done: min(done, 1.0)
    )
    meter.report()
    top = Builder(
        rule, limits, (tree, lists, make_polyhedra(rows, box)), shapes.facets, shell, meter
    )
    pieces = build_with_threads(top, meter, threads)
    grown = top.finished()
    if pieces:
        grown = joined(grown, pieces)
        meter.report()
    if not in_order:
        grown = numbered(grown, order)
    progress.report(1.0, 1.0, "Building bsp")
    return grown


# ------------------------------------------------------------------------------------- memory


def start(shapes: Shapes, box: np.ndarray, order: int) -> tuple[Growing, Lists]:
    """Return a tree of a root that waits."""
    tree, lists = make_memory(
        np.arange(len(shapes.start)), shapes.start, shapes.size, shapes.points, shapes.is_cut, order
    )
    sides = box[3:] - box[:3]
    tree.planes[0, AREA] = 2.0 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0])
    tree.planes[0, SHARE] = 1.0
    return tree, lists


def make_memory(
    item: np.ndarray, start: np.ndarray, size: np.ndarray, points: np.ndarray,
    is_cut: np.ndarray, order: int,
) -> tuple[Growing, Lists]:  # fmt: skip
    """Return a tree of a root that waits with these references, without area and share."""
    n, capacity = len(item), 1024
    tree = Growing(
        np.zeros((capacity, 5), np.int64), np.zeros((capacity, 6)), make_frontier(capacity, order),
        np.array([1, 0]), np.zeros(1),
    )  # fmt: skip
    tree.nodes[0, COUNT] = n
    tree.frontier.state[1] = 1  # the root waits
    room, corners = 4 * n + 256, 4 * len(points) + 2 * n + 1024
    lists = Lists(
        np.zeros(room, np.int32), np.zeros(room, np.int64), np.zeros(room, np.int32),
        np.zeros((corners, 3)), np.zeros(4 * n + 256, np.int32),
        np.array([n, len(points), 0]), is_cut,
    )  # fmt: skip
    lists.item[:n], lists.start[:n], lists.size[:n] = item, start, size
    lists.points[: len(points)] = points
    return tree, lists


def with_room(
    tree: Growing, lists: Lists, status: int, most: int, order: int
) -> tuple[Growing, Lists]:
    """Return both with room to go on."""
    node = int(peek(tree.frontier))
    if status == NEEDS_NODES:
        capacity = 2 * len(tree.nodes)
        refuse_if_too_large(104 * capacity, f"a bsp of over {capacity // 2} nodes", ADVICE)
        return Growing(
            longer(tree.nodes, capacity), longer(tree.planes, capacity),
            enlarged(tree.frontier, capacity), tree.used, tree.done,
        ), lists  # fmt: skip
    if status == NEEDS_LISTED:
        size = min(2 * len(lists.listed), most) + int(tree.nodes[node, COUNT])
        refuse_if_too_large(4 * size, f"a bsp of over {lists.used[LISTED]} references", ADVICE)
        return tree, lists._replace(listed=longer(lists.listed, size))
    # Sweeping is enough where it frees a good part of what is lacking.
    before = int(lists.used[REFERENCES]), int(lists.used[POINTS])
    if order != DEPTH_FIRST:  # on a stack there is no garbage
        call(sweep, tree, lists)
    n = int(tree.nodes[node, COUNT])
    begin = int(tree.nodes[node, BEGIN])
    own = int(lists.start[begin + n - 1] + lists.size[begin + n - 1] - lists.start[begin])
    if status == NEEDS_REFERENCES:
        if (
            lists.used[REFERENCES] + 2 * n > len(lists.start)
            or 2 * lists.used[REFERENCES] > before[0]
        ):
            size = 2 * len(lists.start) + 2 * n
            refuse_if_too_large(16 * size, f"a bsp of over {before[0]} references", ADVICE)
            lists = lists._replace(
                item=longer(lists.item, size), start=longer(lists.start, size),
                size=longer(lists.size, size),
            )  # fmt: skip
    elif (
        lists.used[POINTS] + 2 * (own + n) > len(lists.points) or 2 * lists.used[POINTS] > before[1]
    ):
        size = 2 * len(lists.points) + 2 * (own + n)
        refuse_if_too_large(24 * size, f"a bsp of over {before[0]} references", ADVICE)
        lists = lists._replace(points=longer(lists.points, size))
    return tree, lists


def finish(tree: Growing, lists: Lists) -> Grown:
    """Return what stays of the builder's memory."""
    n_nodes, n_leaves = int(tree.used[0]), int(tree.used[1])
    link, parent, depth, count = (
        tree.nodes[:n_nodes, column].astype(np.int32) for column in (LINK, PARENT, DEPTH, COUNT)
    )
    leaves = np.flatnonzero(link < 0)
    offsets = np.zeros(n_leaves + 1, np.int64)
    offsets[-link[leaves]] = tree.nodes[leaves, BEGIN]
    return Grown(
        tree.planes[:n_nodes, :4].copy(), link, parent, depth,
        tree.planes[:n_nodes, AREA].copy(), count, offsets,
        lists.listed[: lists.used[LISTED]].copy(),
    )  # fmt: skip
