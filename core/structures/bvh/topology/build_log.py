"""The build log of a hierarchy, see :mod:`....contract.build_log`: from what builders have noted.

A builder from the top down notes its splits by the place where each cuts the order of references
(:class:`.tree.Splits`), since threads that split side by side need not agree on any other name. One
from the bottom up numbers the inner nodes of its linked tree as it makes them. Which cells of the
finished tree they are follows from walking down both trees at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....contract.build_log import FIT, MERGE, MOVE, SPLIT, BuildLog
from ....geometry.box_shape import surface_area
from ....kernels import call, kernel
from .collapse import LeafRule, collapse, list_preorder, references_below
from .tree import Grouping, LinkedTree, Splits, Tree, depths_of, linked_numbers, ranges_of, root_of
from .wide import WideTree


def log_of_splits(tree: Tree, splits: Splits, *, by_level: bool) -> BuildLog:
    """Return the log of a tree that was built from the top down; names are its nodes.

    Parameters
    ----------
    by_level : bool
        All nodes of a level are split in one step; otherwise one after the other, breadth-first.
    """
    inner = breadth_first(tree)
    begin, _ = ranges_of(tree.first, tree.size, np.full(len(tree.size), 2))
    first = tree.first[inner]
    cuts = begin[first + 1]
    width = np.where(tree.size > 0, 0, 2)
    step = np.arange(len(inner))
    if by_level:
        step = depths_of(tree.first, tree.size, width)[inner]
    return BuildLog.of(
        SPLIT, 1 + step, inner, first[:, None] + np.arange(2),
        axis=splits.axis[cuts], position=splits.position[cuts], cost=splits.cost[cuts],
        counts=splits.counts[cuts], cells=np.arange(len(tree.size)),
    )  # fmt: skip


def breadth_first(tree: Tree) -> np.ndarray:
    """Return the inner nodes level by level, each from left to right."""
    levels, level = [np.empty(0, np.int64)], np.zeros(1, np.int64)
    while len(level):
        inner = level[tree.size[level] == 0]
        levels.append(inner)
        left = tree.first[inner].astype(np.int64)
        level = np.stack([left, left + 1], axis=1).ravel()
    return np.concatenate(levels)


def log_of_merges(
    tree: LinkedTree, step: np.ndarray, areas: np.ndarray, cells: np.ndarray
) -> BuildLog:
    """Return the log of a tree that was built from the bottom up; names are the linked nodes.

    Parameters
    ----------
    step : (n - 1,) int
        In which step every inner node was made.
    areas : (n - 1,) float64
        Of the boxes of inner nodes.
    cells : (2n - 1,) int32
        See :func:`cells_of`.
    """
    n_leaves = (len(tree.left) + 1) // 2
    node = np.arange(n_leaves, len(tree.left))
    children = np.stack([tree.left[node], tree.right[node]], axis=1)
    return BuildLog.of(
        MERGE, step, node, children, cost=areas,
        counts=references_below(tree)[children], cells=cells,
    )  # fmt: skip


def grouping_of_merges(tree: LinkedTree, rule: LeafRule, step: np.ndarray | None) -> Grouping:
    """Choose the leaves of a tree that was built from the bottom up.

    Parameters
    ----------
    tree : LinkedTree
        Its inner nodes have the numbers n, n + 1, ... in the order in which they were made.
    step : (n - 1,) int or None
        In which step every inner node was made, if there is to be a log.
    """
    if step is None:
        return Grouping(*collapse(tree, rule))
    n_leaves = (len(tree.left) + 1) // 2
    # What is collapsed may be balanced, too, and the log is to have what was there before.
    as_built = tree._replace(left=tree.left.copy(), right=tree.right.copy())
    areas = surface_area(tree.boxes[n_leaves:])
    finished, order = collapse(tree, rule)

    def log() -> BuildLog:
        cells = cells_of(tree.left, tree.right, root_of(tree), finished)
        made = replace(log_of_merges(as_built, step, areas, cells), leaves=order)
        return made.then(log_of_balancing(tree, as_built.left, as_built.right))

    return Grouping(finished, order, log=log)


class LogSoFar:
    """The log of a tree that is rearranged, as it goes on; names are those of the builder.

    Only what will be lost is noted while the work is under way.

    Parameters
    ----------
    grouping : Grouping
        With a log, and one reference per leaf.
    tree : LinkedTree
        The same tree.
    """

    def __init__(self, grouping: Grouping, tree: LinkedTree) -> None:
        self._grouping = grouping
        self._later: list[Callable[[], BuildLog]] = []
        self._left, self._right = tree.left.copy(), tree.right.copy()

    def go_on(self, tree: LinkedTree, log: Callable[[], BuildLog] | None) -> None:
        """Append what was done to the tree; names in the log are its nodes."""
        assert log is not None
        self._later.append(log)
        self._left, self._right = tree.left.copy(), tree.right.copy()

    def until(self, tree: LinkedTree, finished: Tree, order: np.ndarray) -> Callable[[], BuildLog]:
        """Return what puts the log together up to here, where the tree was collapsed just now."""
        balanced = log_of_balancing(tree, self._left, self._right)
        self.go_on(tree, lambda: balanced)
        left, right, later = self._left, self._right, self._later.copy()
        root = root_of(tree)

        def log() -> BuildLog:
            assert self._grouping.log is not None
            built = self._grouping.log()
            numbers = linked_numbers(self._grouping.tree)[built.cells]
            names = np.empty_like(numbers)  # of the linked nodes: all of them have one
            names[numbers] = np.arange(len(numbers))
            cells = cells_of(left, right, root, finished)[numbers]
            whole = replace(built, cells=cells, leaves=names[order])
            for each in later:
                whole = whole.then(each().renamed(names))
            return whole

        return log


def cells_of(left: np.ndarray, right: np.ndarray, root: int, finished: Tree) -> np.ndarray:
    """Return which node of a collapsed tree every linked node is, -1 for those below leaves.

    Parameters
    ----------
    left, right : (2n - 1,) int32
        Children of the linked nodes.
    """
    cells = np.full(len(left), -1, np.int32)
    linked, nodes = np.array([root]), np.zeros(1, np.int64)
    while len(nodes):
        cells[linked] = nodes
        is_inner = finished.size[nodes] == 0
        above, first = linked[is_inner], finished.first[nodes[is_inner]].astype(np.int64)
        linked = np.concatenate([left[above], right[above]])
        nodes = np.concatenate([first, first + 1])
    return cells


def widened_cells(tree: Tree, wide: WideTree) -> np.ndarray:
    """Return which node of a wide tree every node of the binary one is, -1 for those left out.

    Nodes of both are known by their references: no two of one tree have the same.
    """
    begin, end = ranges_of(tree.first, tree.size, np.full(len(tree.size), 2))
    wide_begin, wide_end = ranges_of(wide.first, wide.size, wide.width)
    n_references = int(end.max()) + 1
    keys, wide_keys = begin * n_references + end, wide_begin * n_references + wide_end
    order = np.argsort(wide_keys)
    place = np.minimum(np.searchsorted(wide_keys[order], keys), len(order) - 1)
    found = order[place]
    return np.where(wide_keys[found] == keys, found, -1).astype(np.int32)


def log_of_balancing(tree: LinkedTree, left: np.ndarray, right: np.ndarray) -> BuildLog:
    """Return the moves of :func:`.collapse.limit_depth`, if there were any: one step.

    Parameters
    ----------
    left, right : (2n - 1,) int32
        The children of all nodes before.
    """
    moved = np.flatnonzero((tree.left != left) | (tree.right != right))
    children = np.stack([tree.left[moved], tree.right[moved]], axis=1)
    step, names = np.ones(len(moved), np.int64), np.arange(len(left))
    moves = BuildLog.of(MOVE, step, moved, children, cells=names)
    return moves.with_events(BuildLog.of(FIT, step, moved, cells=names))


def tree_as_built(log: BuildLog, boxes: np.ndarray) -> LinkedTree:
    """Return the tree that the builder made, before anything was moved; its nodes are the names.

    Parameters
    ----------
    log : BuildLog
        One that goes down to single references.
    boxes : (r, 6) float64
        Of the references, in the order of the finished structure.
    """
    assert log.leaves is not None
    count = len(log.cells)
    links = (np.full(count, -1, np.int32) for _ in range(3))
    tree = LinkedTree(np.empty((count, 6)), *links)
    tree.boxes[log.leaves] = boxes
    makes = np.isin(log.kind, (SPLIT, MERGE))
    node, children = log.node[makes], log.children[makes]
    tree.left[node], tree.right[node] = children[:, 0], children[:, 1]
    tree.parent[children] = node[:, None]
    nodes = np.empty(count, np.int32)
    call(list_preorder, tree, root_of(tree), nodes)
    call(fit_listed, tree, nodes)
    return tree


@kernel
def fit_listed(tree, nodes):
    """Fit the boxes of inner nodes; children come behind their parents in the list."""
    for i in range(len(nodes) - 1, -1, -1):
        node = nodes[i]
        if tree.left[node] < 0:
            continue
        box, a, b = tree.boxes[node], tree.boxes[tree.left[node]], tree.boxes[tree.right[node]]
        for axis in range(3):
            box[axis] = min(a[axis], b[axis])
            box[3 + axis] = max(a[3 + axis], b[3 + axis])


def splits_of_nodes(log: BuildLog, n_nodes: int) -> dict[str, np.ndarray]:
    """Return axis, position and cost of the split of every node; -1 and NaN where there is none."""
    columns = {
        "split_axis": (np.full(n_nodes, -1, np.int32), log.axis),
        "split_position": (np.full(n_nodes, np.nan), log.position),
        "split_cost": (np.full(n_nodes, np.nan), log.cost),
    }
    is_split = (log.kind == SPLIT) & (log.cells[log.node] >= 0)
    nodes = log.cells[log.node[is_split]]
    for values, column in columns.values():
        values[nodes] = column[is_split]
    return {name: values for name, (values, _) in columns.items()}
