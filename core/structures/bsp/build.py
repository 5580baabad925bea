"""Growing a BSP tree: which cell is split next, and what its children get.

Cells that wait have their references in long arrays. A split appends those of both children; the
cell's own become garbage, which is swept out when an array is full. The polyhedron of a cell is not
kept: it is cut out of the root's box again when the turn of the cell comes.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...geometry.triangle import Triangles
from ...kernels import call, inner, kernel
from ...memory import refuse_if_too_large
from ...progress import Progress
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
from .planes import SAMPLE, Scratch, choose_plane
from .polyhedron import clip, make_polyhedra, measure_heights, side_areas
from .references import Lists, append_side, move_references

ADVICE = "lower max_depth, raise max_leaf_size or set a budget"

MOST_REFERENCES = 1 << 22
"""References at which a tree is refused, unless the scene has a sixteenth as many triangles."""

DONE, PAUSED, NEEDS_NODES, NEEDS_REFERENCES, NEEDS_POINTS, NEEDS_LISTED = range(6)
"""What a call of :func:`grow` ends with."""

SLICE = 0.05
"""Seconds between two looks at the cancel button."""

WAITING = 0
"""Link of a node that waits: no node has the root as its child."""

ROWS = np.int64(0), np.int64(1), np.int64(2)
"""Rows for the polyhedra of the root and of the latest cells; the plain numbers would be types of
their own for Numba, and callees compiled for each."""

NO_ROW = np.int64(-1)

REFERENCES, POINTS, LISTED = range(3)
"""Places in `Lists.used`."""

LINK, PARENT, DEPTH, BEGIN, COUNT = range(5)
AREA, SHARE = 4, 5
"""Columns of a tree being built. Few arrays of many columns, since every array that is passed on
costs time to compile."""


class Limits(NamedTuple):
    """When to stop: `budget` is a number of nodes, `order` the discipline of the frontier."""

    max_depth: int
    max_leaf_size: int
    budget: int
    order: int


class Growing(NamedTuple):
    """A tree being built.

    Attributes
    ----------
    nodes : (capacity, 5) int64
        Columns LINK: left child of an inner node (the right one is next), ``-1 - leaf`` for leaves,
        or WAITING; PARENT; DEPTH; BEGIN, COUNT: references of a node that waits. Of a leaf, BEGIN
        is the end of its list.
    planes : (capacity, 6) float64
        Unit normal and position along it; columns AREA: surface area of the cell; SHARE: of the
        work, 1 for the root, divided among children by their references.
    frontier : Frontier
    used : (2,) int64
        Nodes and leaves so far.
    done : (1,) float64
        Sum of the shares of leaves.
    """

    nodes: np.ndarray
    planes: np.ndarray
    frontier: Frontier
    used: np.ndarray
    done: np.ndarray


@inner
def cut_out(tree, node, room, path, shell):
    """Cut the polyhedron of a node out of the root's; return its row, or NO_ROW if that fails."""
    height, row = 0, ROWS[0]
    while node > 0:
        path[height] = node
        height += 1
        node = tree.nodes[node, PARENT]
    while height > 0:
        height -= 1
        node = path[height]
        above = tree.nodes[node, PARENT]
        sign = -1.0 if tree.nodes[above, LINK] == node else 1.0
        target = ROWS[2] if row == 1 else ROWS[1]
        if not clip(room, row, target, tree.planes[above], sign, shell):
            return NO_ROW
        row = target
    return row


@kernel
def grow(rule, limits, tree, lists, room, scratch, corners, shell, work):
    """Split cells until none waits, room is lacking or `work` references are handled."""
    frontier, used, nodes, planes = tree.frontier, lists.used, tree.nodes, tree.planes
    while not is_empty(frontier):
        if work <= 0:
            return PAUSED
        node = np.int64(peek(frontier))
        begin, n = nodes[node, BEGIN], nodes[node, COUNT]
        n_points = 0
        if n > 0:
            n_points = lists.start[begin + n - 1] + lists.size[begin + n - 1] - lists.start[begin]
        left = tree.used[0]
        if left + 2 > len(nodes):
            return NEEDS_NODES
        if used[REFERENCES] + 2 * n > len(lists.start):
            return NEEDS_REFERENCES
        if used[POINTS] + 2 * (n_points + n) > len(lists.points):
            return NEEDS_POINTS
        if used[LISTED] + n > len(lists.listed):
            return NEEDS_LISTED
        drop(frontier)
        depth, row, is_split = nodes[node, DEPTH], NO_ROW, False
        work -= 64 + n
        if n > limits.max_leaf_size and depth < limits.max_depth and left + 2 <= limits.budget:
            work -= 1024 + min(n, SAMPLE) * 16
            row = cut_out(tree, node, room, scratch.path, shell)
            is_split = row != NO_ROW and choose_plane(
                rule, lists, begin, n, room, row, planes[node, AREA], scratch, corners, shell
            )
        if not is_split:
            leaf = tree.used[1]
            tree.used[1] = leaf + 1
            nodes[node, LINK] = -1 - leaf
            tree.done[0] += planes[node, SHARE]
            for i in range(n):
                lists.listed[used[LISTED] + i] = lists.triangle[begin + i]
            used[LISTED] += n
            nodes[node, BEGIN] = used[LISTED]
            continue
        plane = planes[node]
        for i in range(4):
            plane[i] = scratch.plane[i]
        measure_heights(room, row, plane)
        below, above = side_areas(room, row, plane, 0.0)
        nodes[node, LINK] = left
        tree.used[0] = left + 2
        total = 0
        for right in range(2):
            child = left + right
            nodes[child, LINK], nodes[child, PARENT] = WAITING, node
            nodes[child, DEPTH], nodes[child, BEGIN] = depth + 1, used[REFERENCES]
            count = append_side(lists, begin, n, plane, 2.0 * right - 1.0, shell)
            nodes[child, COUNT] = count
            total += count
            planes[child, AREA] = above if right == 1 else below
        for i in range(2):
            # A stack hands out what came last.
            child = left + (1 - i if limits.order == DEPTH_FIRST else i)
            planes[child, SHARE] = planes[node, SHARE] * nodes[child, COUNT] / total
            put(frontier, child, planes[child, AREA] * nodes[child, COUNT])
    return DONE


@kernel
def sweep(tree, lists):
    """Move the references of nodes that wait together, over those of cells that are split."""
    place, corner, nodes = 0, 0, tree.nodes
    # References lie in the order of their nodes.
    for node in range(tree.used[0]):
        if nodes[node, LINK] == WAITING:
            corner = move_references(lists, nodes[node, BEGIN], nodes[node, COUNT], place, corner)
            nodes[node, BEGIN] = place
            place += nodes[node, COUNT]
    lists.used[REFERENCES], lists.used[POINTS] = place, corner


class Grown(NamedTuple):
    """A finished tree; nodes are numbered in the order in which they were made.

    Attributes
    ----------
    planes : (n, 4) float64
    link, parent, depth : (n,) int32
    area : (n,) float64
        Of all nodes, as in :class:`Growing`.
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32
        Triangles, leaf after leaf.
    """

    planes: np.ndarray
    link: np.ndarray
    parent: np.ndarray
    depth: np.ndarray
    area: np.ndarray
    offsets: np.ndarray
    references: np.ndarray


def grow_tree(
    rule: Any,
    limits: Limits,
    triangles: Triangles,
    box: np.ndarray,
    shell: float,
    progress: Progress,
) -> Grown:
    """Build a tree.

    Parameters
    ----------
    rule : Heuristic or Autopartition
    box : (6,) float64
        The root's cell.
    shell : float
        Distance from a plane within which a point counts as on it.

    Raises
    ------
    InputError
        When the tree gets too large.
    Cancelled
        From `progress`.
    """
    n = len(triangles.ids)
    tree, lists = start(triangles, box, limits.order)
    room = make_polyhedra(3, box)
    scratch = Scratch(
        np.empty(SAMPLE * 2), np.empty(SAMPLE * 2), np.zeros(4), np.zeros(4), np.zeros(64, np.int64)
    )
    most = max(MOST_REFERENCES, 16 * n)
    tree.frontier.state[1] = 1  # the root waits
    status, work = PAUSED, 1 << 12
    while status != DONE:
        progress.report(min(float(tree.done[0]), 1.0), 1.0, "Building bsp")
        begin = time.perf_counter()
        status = call(
            grow, rule, limits, tree, lists, room, scratch, triangles.corners, shell, work
        )  # fmt: skip
        seconds = time.perf_counter() - begin
        if int(lists.used[LISTED]) > most:
            raise InputError(f"the bsp has more than {most} references to {n} triangles; {ADVICE}")
        if status == PAUSED:
            work = 2 * work if seconds < SLICE else max(work // 2, 1)
        elif status != DONE:
            tree, lists = with_room(tree, lists, status, most)
    progress.report(1.0, 1.0, "Building bsp")
    return finish(tree, lists)


def start(triangles: Triangles, box: np.ndarray, order: int) -> tuple[Growing, Lists]:
    """Return a tree of a root that waits."""
    n = len(triangles.ids)
    capacity = 1024
    tree = Growing(
        np.zeros((capacity, 5), np.int64), np.zeros((capacity, 6)), make_frontier(capacity, order),
        np.array([1, 0]), np.zeros(1),
    )  # fmt: skip
    sides = box[3:] - box[:3]
    tree.planes[0, AREA] = 2.0 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0])
    tree.planes[0, SHARE], tree.nodes[0, COUNT] = 1.0, n
    room, corners = 4 * n + 256, 14 * n + 1024
    lists = Lists(
        np.zeros(room, np.int32), np.zeros(room, np.int64), np.zeros(room, np.int32),
        np.zeros((corners, 3)), np.zeros(4 * n + 256, np.int32), np.array([n, 3 * n, 0]),
    )  # fmt: skip
    lists.triangle[:n] = np.arange(n)
    lists.start[:n] = 3 * np.arange(n)
    lists.size[:n] = 3
    lists.points[: 3 * n] = triangles.corners.reshape(-1, 3)
    return tree, lists


def with_room(tree: Growing, lists: Lists, status: int, most: int) -> tuple[Growing, Lists]:
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
                triangle=longer(lists.triangle, size), start=longer(lists.start, size),
                size=longer(lists.size, size),
            )  # fmt: skip
    elif (
        lists.used[POINTS] + 2 * (own + n) > len(lists.points) or 2 * lists.used[POINTS] > before[1]
    ):
        size = 2 * len(lists.points) + 2 * (own + n)
        refuse_if_too_large(24 * size, f"a bsp of over {before[0]} references", ADVICE)
        lists = lists._replace(points=longer(lists.points, size))
    return tree, lists


def longer(array: np.ndarray, length: int) -> np.ndarray:
    """Return an array with room for `length` rows."""
    new = np.zeros((length, *array.shape[1:]), array.dtype)
    new[: len(array)] = array
    return new


def finish(tree: Growing, lists: Lists) -> Grown:
    """Return what stays of the builder's memory."""
    n_nodes, n_leaves = int(tree.used[0]), int(tree.used[1])
    link, parent, depth = tree.nodes[:n_nodes, [LINK, PARENT, DEPTH]].T.astype(np.int32)
    leaves = np.flatnonzero(link < 0)
    offsets = np.zeros(n_leaves + 1, np.int64)
    offsets[-link[leaves]] = tree.nodes[leaves, BEGIN]
    return Grown(
        tree.planes[:n_nodes, :4].copy(), link.copy(), parent.copy(), depth.copy(),
        tree.planes[:n_nodes, AREA].copy(), offsets, lists.listed[: lists.used[LISTED]].copy(),
    )  # fmt: skip
