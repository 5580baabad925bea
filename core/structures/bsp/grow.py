"""Growing a BSP tree: which cell is split next, and what its children get.

Cells that wait have their references in long arrays, to which a split appends those of both
children. A stack has those of the next cell on top: whatever lies above belonged to cells that are
finished. In any other order the references of split cells become garbage, which is swept out when
an array is full.

A stack also has the polyhedron of every cell above the present one, a row for each level, and cuts
each cell out of its parent. Otherwise polyhedra are not kept: each is cut out of the root's box
again when the turn of its cell comes, by the same planes in the same order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inner, kernel, whole
from ..subdivision.frontier import DEPTH_FIRST, Frontier, drop, is_empty, peek, put
from ..subdivision.subtrees import ASIDE, DONE, PAUSED, SMALL
from .planes import SAMPLE, choose_plane
from .polyhedron import clip, measure_faces, measure_heights, side_areas
from .references import append_side, move_references

NEEDS_NODES, NEEDS_REFERENCES, NEEDS_POINTS, NEEDS_LISTED = range(3, 7)
"""How else a call of :func:`cut_cells` ends, beside DONE, PAUSED and ASIDE: room is lacking."""

WAITING = 0
"""Link of a node that waits: no node has the root as its child."""

ROWS = whole(0), whole(1), whole(2)
"""Rows for the polyhedra of the root and of the latest cells, where these are cut out of it."""

NO_ROW = whole(-1)

REFERENCES, POINTS, LISTED = range(3)
"""Places in `Lists.used`."""

LINK, PARENT, DEPTH, BEGIN, COUNT = range(5)
AREA, SHARE = 4, 5
"""Columns of a tree being built. Few arrays of many columns, since every array that is passed on
costs time to compile."""


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
        references, and so of the work: see :mod:`..subdivision.frontier`.
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


@inner
def cell_of(tree, node, room, path, shell, order):
    """Return the row that has the polyhedron of a node whose turn it is, or NO_ROW."""
    if order != DEPTH_FIRST:
        return cut_out(tree, node, room, path, shell)
    depth = tree.nodes[node, DEPTH]
    if node == 0:
        return depth
    above = tree.nodes[node, PARENT]
    sign = -1.0 if tree.nodes[above, LINK] == node else 1.0
    is_whole = clip(room, depth - 1, depth, tree.planes[above], sign, shell)
    return depth if is_whole else NO_ROW


@kernel
def cut_cells(rule, limits, tree, lists, room, scratch, facets, shell, work):
    """Split cells until none waits, one is to be put aside, room is lacking or `work` is done.

    `work` is a number of references to handle, more or less.
    """
    frontier, used, nodes, planes = tree.frontier, lists.used, tree.nodes, tree.planes
    is_stack = limits.order == DEPTH_FIRST
    while not is_empty(frontier):
        if work <= 0:
            return PAUSED
        node = whole(peek(frontier))
        begin, n, depth = nodes[node, BEGIN], nodes[node, COUNT], nodes[node, DEPTH]
        n_points = 0
        if n > 0:
            end = lists.start[begin + n - 1] + lists.size[begin + n - 1]
            n_points = end - lists.start[begin]
            if is_stack:
                used[REFERENCES], used[POINTS] = begin + n, end
        left = tree.used[0]
        if left + 2 > len(nodes):
            return NEEDS_NODES
        if used[REFERENCES] + 2 * n > len(lists.start):
            return NEEDS_REFERENCES
        if used[POINTS] + 2 * (n_points + n) > len(lists.points):
            return NEEDS_POINTS
        if used[LISTED] + n > len(lists.listed):
            return NEEDS_LISTED
        row, is_split = NO_ROW, False
        work -= 64 + n
        if n > limits.max_leaf_size and depth < limits.max_depth and left + 2 <= limits.budget:
            work -= 1024 + min(n, SAMPLE) * 16
            row = cell_of(tree, node, room, scratch.path, shell, limits.order)
            if SMALL < n <= limits.aside and row != NO_ROW:
                return ASIDE
            if row != NO_ROW:
                measure_faces(room, row)
                is_split = choose_plane(
                    rule, lists, begin, n, room, row, planes[node, AREA], scratch, facets, shell
                )
        drop(frontier)
        # What the children get is appended, on a stack that of the first to come last. It is
        # dropped again where it is too much.
        plane = planes[node]
        references, points = used[REFERENCES], used[POINTS]
        n_first, n_second = n - n, n - n  # zeros; the number 0 would be a type of its own
        if is_split:
            for i in range(4):
                plane[i] = scratch.plane[i]
            first_side = 1.0 if is_stack else -1.0
            n_first = append_side(lists, begin, n, plane, first_side, shell)
            n_second = append_side(lists, begin, n, plane, -first_side, shell)
            is_split = n_first + n_second <= limits.references * planes[node, SHARE]
        if not is_split:
            used[REFERENCES], used[POINTS] = references, points
            for i in range(4):
                plane[i] = 0.0
            leaf = tree.used[1]
            tree.used[1] = leaf + 1
            nodes[node, LINK] = -1 - leaf
            tree.done[0] += planes[node, SHARE]
            for i in range(n):
                lists.listed[used[LISTED] + i] = lists.item[begin + i]
            used[LISTED] += n
            nodes[node, BEGIN] = used[LISTED]
            continue
        measure_heights(room, row, plane)
        below, above = side_areas(room, row, plane, 0.0)
        nodes[node, LINK] = left
        tree.used[0] = left + 2
        for right in range(2):
            child = left + right
            is_first = (right == 1) == is_stack
            count = n_first if is_first else n_second
            nodes[child, LINK], nodes[child, PARENT] = WAITING, node
            nodes[child, DEPTH], nodes[child, COUNT] = depth + 1, count
            nodes[child, BEGIN] = references if is_first else references + n_first
            planes[child, AREA] = above if right == 1 else below
            planes[child, SHARE] = planes[node, SHARE] * count / (n_first + n_second)
        for i in range(2):
            # A stack hands out what came last.
            child = left + (1 - i if is_stack else i)
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
