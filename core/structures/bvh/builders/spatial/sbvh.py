"""SBVH: top-down construction by the SAH with spatial splits beside object splits.

An object split divides the triangles, and a large or slanted one makes the boxes of both children
overlap. A spatial split divides space as a kd-tree does: triangles that straddle the plane are
referenced on both sides, each time with the box of the part that is there, so that nothing
overlaps. At each node the best object split is found as in :mod:`..top_down.binned_sah`. Only if
its children overlap by more than ALPHA of the root's area, the best spatial split is looked for too
(:mod:`.spatial_split`), and the cheaper one is taken.

The memory is bounded by the setting `duplication`. Every node has room for so many references; what
its own leave free is shared by its children in proportion to their sizes. Planes that would need
more are not taken. That depends on no other node: threads change nothing.

M. Stich, H. Friedrich, A. Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009.
V. Fuetterling, C. Lojewski, F.-J. Pfreundt, A. Ebert: Parallel Spatial Splits in Bounding Volume
Hierarchies, EGPGV 2016 (shares of free memory).
"""

from __future__ import annotations

import functools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .....contract.workspace import MAXIMUM_DEPTH, STACK_SIZE
from .....errors import InputError
from .....geometry.box import area_of
from .....geometry.box_shape import surface_area
from .....geometry.csg.trees import Csg
from .....geometry.instances import is_of_triangles
from .....geometry.rays import ULPS
from .....geometry.solids.mixed import Mixed
from .....geometry.triangles import Triangles
from .....kernels import call, inner, kernel, whole
from .....parallel import core_count
from .....progress import Progress
from .....ranges import ranges
from .....settings import setting
from ...topology.build_log import log_of_splits
from ...topology.tree import (
    Builder,
    Grouping,
    Primitives,
    Splits,
    Tree,
    make_splits,
    note_split,
)
from ..top_down.binned_sah import BinnedSettings
from ..top_down.recursion import TEXT, Limits, compact, enclose_boxes, limits_of, swap
from .chop import References
from .spatial_split import (
    OBJECT,
    SPATIAL,
    Bins,
    best_split,
    divide,
    make_bins,
    overlap_of,
)

ALPHA = 1e-5
"""Overlap of an object split, as a share of the root's area, from which on a spatial split is
looked for; Stich's choice."""

SUBTREE = 1 << 13
"""References up to which a subtree is built by one kernel call."""


@dataclass(frozen=True)
class Settings(BinnedSettings):
    """Settings of SBVH."""

    duplication: float = setting(
        2.0,
        "Duplication",
        "Most references that spatial splits may make, per triangle",
        minimum=1.0,
        maximum=16.0,
    )


class SplitRule(NamedTuple):
    """What decides a split, for kernels.

    Attributes
    ----------
    limits : Limits
    bins : int
    least_overlap : float
        Area from which on a spatial split is looked for.
    """

    limits: Limits
    bins: int
    least_overlap: float


class Growing(NamedTuple):
    """The tree while it grows, with room for more nodes than it will have.

    Attributes
    ----------
    boxes, first, size
        As in :class:`...topology.tree.Tree`; a size of -1 marks a number that no node has taken.
    cut_depth : (n_nodes,) int8
        Depth of a node with a spatial split; -1 for all others.
    splits : Splits
        Notes for the log.
    """

    boxes: np.ndarray
    first: np.ndarray
    size: np.ndarray
    cut_depth: np.ndarray
    splits: Splits


class Scratch(NamedTuple):
    """Scratch memory of one building thread.

    Attributes
    ----------
    bounds : (3, 6) float64
        Of the node that was split last: its box; the box around its references' centroids,
        doubled; if it was split in space, the third row starts with axis and position.
    bins : Bins
    """

    bounds: np.ndarray
    bins: Bins


def make_scratch(bins: int) -> Scratch:
    """Return scratch memory for one thread."""
    return Scratch(np.empty((3, 6)), make_bins(bins))


@inner
def push(stack, height, node, first, count, room, depth):
    """Remember a node to split."""
    stack[height, 0], stack[height, 1], stack[height, 2] = node, first, count
    stack[height, 3], stack[height, 4] = room, depth


@inner
def split_node(tree, references, node, first, count, room, depth, rule, scratch):
    """Fit a node's box, then split it or make it a leaf.

    The children of a node whose right child starts at place k have the numbers 2k - 1 and 2k. Every
    place starts a right child at most once, so threads need not agree on who takes which number.

    Parameters
    ----------
    first, count, room : int
        Its references, and how many there may be below it.

    Returns
    -------
    n_left, n_right : int
        References of the children; 0 for a leaf.
    left_room : int
        Room of the left child; the right one starts behind it.
    """
    bounds, bins, limits = scratch.bounds, scratch.bins, rule.limits
    enclose_boxes(references.boxes, first, count, bounds)
    for face in range(6):
        tree.boxes[node, face] = bounds[0, face]
    area = area_of(bounds[0])
    kind, axis, last_left, n_left, n_right, cost = OBJECT, -1, 0, 0, 0, np.inf
    used = min(rule.bins, 4 + count)  # more than references would mostly be empty
    if count > 1 and depth < MAXIMUM_DEPTH // 2:
        axis, last_left, n_left, n_right, cost = best_split(
            references, first, count, room, OBJECT, bounds, used, bins, limits, depth, np.inf
        )
        overlap = overlap_of(bins.parts) if axis >= 0 else area
        if overlap > rule.least_overlap and room > count:
            other_axis, other_bin, other_left, other_right, other_cost = best_split(
                references, first, count, room, SPATIAL, bounds, used, bins, limits, depth, cost
            )
            if other_axis >= 0:
                kind, axis, last_left = SPATIAL, other_axis, other_bin
                n_left, n_right, cost = other_left, other_right, other_cost
    no_gain = limits.c_isect * count * area <= limits.c_trav * area + limits.c_isect * cost
    if count == 1 or (count <= limits.max_leaf_size and no_gain):
        tree.first[node], tree.size[node] = first, count
        return 0, 0, 0
    if axis >= 0:
        n_left, n_right, plane = divide(
            references, first, count, kind, bounds, axis, last_left, n_left, n_right, used, bins
        )
        bounds[2, 0], bounds[2, 1] = axis, plane
    if n_left == 0 or n_right == 0:
        # Nothing tells them apart: split by index.
        kind, axis, n_left, n_right = OBJECT, -1, count // 2, count - count // 2
    # What is free goes to the children by their sizes. As many of the right ones as the gap is
    # wide go from in front of the others to behind them.
    free = room - n_left - n_right
    gap = free * n_left // (n_left + n_right)
    for i in range(first + n_left, first + n_left + min(gap, n_right)):
        swap(references.boxes, references.triangle, i, i + max(gap, n_right))
    left_room = n_left + gap
    tree.first[node], tree.size[node] = 2 * (first + left_room) - 1, 0
    tree.cut_depth[node] = depth if kind == SPATIAL else -1
    split_cost = np.nan
    if axis >= 0 and area > 0.0:
        split_cost = limits.c_trav + limits.c_isect * cost / area
    position = bounds[2, 1] if kind == SPATIAL else 0.5 * bounds[2, 1]
    note_split(tree.splits, first + left_room, axis, position, split_cost, n_left, n_right)
    return n_left, n_right, left_room


@kernel
def build_subtree(
    tree, references, node, first, count, room, depth, rule, scratch, stack, only_one
):
    """Split a node and everything below it, depth-first; return how many wait on the stack.

    Parameters
    ----------
    stack : (STACK_SIZE, 5) int64
        Rows are as in :class:`Node`.
    only_one : bool
        Stop after the first: its children wait, the right one below the left one.
    """
    height = 0
    push(stack, height, node, first, count, room, depth)
    height += 1
    while height > 0:
        height -= 1
        node, first, count = stack[height, 0], stack[height, 1], stack[height, 2]
        room, depth = stack[height, 3], stack[height, 4]
        n_left, n_right, left_room = split_node(
            tree, references, node, first, count, room, depth, rule, scratch
        )
        if n_left > 0:
            left = whole(tree.first[node])
            push(stack, height, left + 1, first + left_room, n_right, room - left_room, depth + 1)
            push(stack, height + 1, left, first, n_left, left_room, depth + 1)
            height += 2
        if only_one:
            break
    return height


class Node(NamedTuple):
    """A node that is still to be split: its number, its references, their room, its depth."""

    number: int
    first: int
    size: int
    room: int
    depth: int


class Construction:
    """A tree under construction.

    Attributes
    ----------
    tree : Growing
    references : References
    root : Node
    """

    def __init__(self, primitives: Primitives, settings: Settings, log: bool = False) -> None:
        count = len(primitives.boxes)
        room = int(settings.duplication * count)
        boxes, triangle = np.empty((room, 6)), np.empty(room, np.int32)
        boxes[:count], triangle[:count] = primitives.boxes, np.arange(count)
        geometry = primitives.geometry
        if isinstance(geometry, Triangles):
            reach = np.abs(geometry.corners).max(axis=(0, 1))
        elif isinstance(geometry, Mixed):
            reach = geometry.reach
        elif isinstance(geometry, Csg):
            raise InputError(
                "sbvh cuts what it groups into pieces, and the scene holds trees of solids; choose "
                "another builder, such as binned_sah"
            )
        else:
            first = "--instances flatten or " * is_of_triangles(geometry)
            raise InputError(
                "sbvh cuts what it groups into pieces, and the scene holds instances; choose "
                f"{first}another builder, such as binned_sah"
            )
        self.references = References(geometry, ULPS * reach, triangle, boxes)
        n_nodes = 2 * room - 1
        self.tree = Growing(
            np.empty((n_nodes, 6)), np.empty(n_nodes, np.int32),
            np.full(n_nodes, -1, np.int32), np.full(n_nodes, -1, np.int8),
            make_splits(room if log else 0),
        )  # fmt: skip
        whole = np.concatenate([boxes[:count, :3].min(axis=0), boxes[:count, 3:].max(axis=0)])
        self.rule = SplitRule(
            limits_of(settings), settings.bins, ALPHA * float(surface_area(whole))
        )
        self.root = Node(0, 0, count, room, 0)
        self._scratch = make_scratch(settings.bins)

    def split(self, node: Node) -> list[Node]:
        """Split a node; return its children, or nothing if it becomes a leaf."""
        stack = np.empty((STACK_SIZE, 5), np.int64)
        if self._build_subtree(node, self._scratch, stack, True) == 0:
            return []
        right, left = (Node(*row) for row in stack[:2].tolist())
        return [left, right]

    def finish(self, node: Node) -> int:
        """Split a node and everything below it; return how many references it had."""
        stack = np.empty((STACK_SIZE, 5), np.int64)
        self._build_subtree(node, make_scratch(self.rule.bins), stack, False)
        return node.size

    def _build_subtree(self, node: Node, scratch: Scratch, stack: np.ndarray, one: bool) -> int:
        return call(
            build_subtree, self.tree, self.references, *node, self.rule, scratch, stack, one
        )


def build_sbvh(
    primitives: Primitives, settings: Settings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    work = Construction(primitives, settings, log)
    total, done = len(primitives.boxes), 0
    # The upper part, node by node; what is small enough is put aside.
    pending, subtrees = [work.root], []
    while pending:
        node = pending.pop()
        if node.size <= SUBTREE:
            subtrees.append(node)
            continue
        progress.report(0, total, TEXT)
        pending += work.split(node)
    # The lower parts, side by side.
    with ThreadPoolExecutor(core_count()) as pool:
        futures = [pool.submit(work.finish, node) for node in subtrees]
        try:
            for future in futures:
                done += future.result()
                progress.report(done, max(total, done), TEXT)
        finally:
            for future in futures:
                future.cancel()
    return finished(work, log)


# ------------------------------------------------------------------------------ without the gaps


def finished(work: Construction, log: bool) -> Grouping:
    """Return the tree without the room that was not needed."""
    growing = work.tree
    tree = compact(Tree(growing.boxes, growing.first, growing.size))
    leaves = np.flatnonzero(tree.size > 0)
    leaves = leaves[np.argsort(tree.first[leaves])]
    size = tree.size[leaves]
    kept = ranges(tree.first[leaves], size)
    tree.first[leaves] = np.cumsum(size) - size
    are_whole = len(kept) == work.root.size
    parts = None if are_whole else work.references.boxes[kept]
    told = None
    if log:
        splits = Splits(*(column[kept] for column in growing.splits))
        told = functools.partial(log_of_splits, tree, splits, by_level=False)
    order, figures = work.references.triangle[kept], figures_of(work, len(kept))
    return Grouping(tree, order, parts, figures, told)


def figures_of(work: Construction, n_references: int) -> dict[str, Any]:
    """Return references per triangle, and how many spatial splits there are at which depth."""
    depth = work.tree.cut_depth
    return {
        "duplication": n_references / work.root.size,
        "spatial_splits": np.bincount(depth[depth >= 0]).tolist(),
    }


BUILDER = Builder(
    "Binned SAH with spatial splits, which cut triangles (Stich 2009)",
    Settings,
    build_sbvh,
    most_duplicates=lambda settings: settings.duplication,
)
