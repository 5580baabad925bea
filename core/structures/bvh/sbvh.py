"""SBVH: top-down construction by the SAH with spatial splits beside object splits.

An object split divides the triangles, and a large or slanted one makes the boxes of both children
overlap. A spatial split divides space as a kd-tree does: triangles that straddle the plane are
referenced on both sides, each time with the box of the part that is there, so that nothing
overlaps. At each node the best object split is found as in :mod:`.binned_sah`. Only if its
children overlap by more than ALPHA of the root's area, the best spatial split is looked for too
(:mod:`.spatial_split`), and the cheaper one is taken.

The memory is bounded by the setting `duplication`. Every node has room for so many references; what
its own leave free is shared by its children in proportion to their sizes. Where there is none left,
a triangle is not cut any more. That depends on no other node: threads change nothing.

M. Stich, H. Friedrich, A. Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009.
V. Fuetterling, C. Lojewski, F.-J. Pfreundt, A. Ebert: Parallel Spatial Splits in Bounding Volume
Hierarchies, EGPGV 2016 (shares of free memory).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...geometry.box import area_of, surface_area
from ...geometry.clip import POLYGON_SIZE, clip
from ...geometry.rays import ULPS
from ...kernels import call, inner, kernel
from ...parallel import core_count, for_chunks
from ...progress import Progress
from ..contract import MAXIMUM_DEPTH, STACK_SIZE
from .binned_sah import best_split, bin_of, divide, fit
from .spatial_split import (
    LEFT,
    RIGHT,
    Bins,
    References,
    best_spatial_split,
    clear,
    divide_spatially,
    grow,
    make_bins,
    swap,
)
from .tree import Grouping, Pieces, Primitives, Tree, copy_depth_first

if TYPE_CHECKING:
    from .settings import BVHSettings

ALPHA = 1e-5
"""Overlap of an object split, as a share of the root's area, from which on a spatial split is
looked for; Stich's choice."""

SUBTREE = 1 << 14
"""References up to which a subtree is built by one kernel call."""


class SplitRule(NamedTuple):
    """What decides a split, for kernels."""

    max_leaf_size: int
    bins: int
    c_trav: float
    c_isect: float
    least_overlap: float


class Growing(NamedTuple):
    """The tree while it grows, with room for more nodes than it will have.

    Attributes
    ----------
    boxes, first, size
        As in :class:`.tree.Tree`; a size of -1 marks a number that no node has taken.
    cut_depth : (n_nodes,) int8
        Depth of a node with a spatial split; -1 for all others.
    """

    boxes: np.ndarray
    first: np.ndarray
    size: np.ndarray
    cut_depth: np.ndarray


class Scratch(NamedTuple):
    """Scratch memory of one building thread."""

    bounds: np.ndarray
    right_costs: np.ndarray
    bins: Bins
    stack: np.ndarray


def make_scratch(bins: int) -> Scratch:
    """Return scratch memory for one thread."""
    return Scratch(
        np.empty(12), np.empty(bins), make_bins(bins), np.empty((STACK_SIZE, 5), np.int64)
    )


@inner
def overlap_of(boxes, first, count, axis, last_left, low, scale, used, bins):
    """Return the surface area of what the children of an object split have in common.

    Parameters
    ----------
    axis, last_left
        As :func:`.binned_sah.best_split` returned them.
    """
    sides = bins.sides
    clear(sides, LEFT)
    clear(sides, RIGHT)
    for i in range(first, first + count):
        side = LEFT if bin_of(boxes[i], axis, low, scale, used) <= last_left else RIGHT
        grow(sides, side, boxes, i)
    common = bins.parts[LEFT]
    for k in range(3):
        common[k] = max(sides[LEFT, k], sides[RIGHT, k])
        common[3 + k] = min(sides[LEFT, 3 + k], sides[RIGHT, 3 + k])
        if common[k] > common[3 + k]:
            return 0.0
    return area_of(common)


@kernel
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
    axis, position
        Of the plane of a spatial split.
    """
    boxes, bounds, bins = references.boxes, scratch.bounds, scratch.bins
    fit(boxes, first, count, bounds)
    for face in range(6):
        tree.boxes[node, face] = bounds[face]
    area = area_of(bounds)
    axis, last_left, cost = -1, 0, np.inf
    space_axis, space_bin, n_left, n_right, space_cost = -1, 0, 0, 0, np.inf
    low, scale = 0.0, 0.0
    used = min(rule.bins, 4 + count)  # more than references would mostly be empty
    if count > 1 and depth < MAXIMUM_DEPTH // 2:
        axis, last_left, cost = best_split(
            boxes, first, count, bounds, used, bins.boxes, bins.starts, scratch.right_costs
        )
        overlap = area
        if axis >= 0:
            low = bounds[6 + axis]
            scale = used * (1.0 - 1e-6) / (bounds[9 + axis] - low)
            overlap = overlap_of(boxes, first, count, axis, last_left, low, scale, used, bins)
        if overlap > rule.least_overlap and room > count:
            space_axis, space_bin, n_left, n_right, space_cost = best_spatial_split(
                references, first, count, bounds, used, bins
            )
    is_spatial = space_cost < cost
    cost = space_cost if is_spatial else cost
    no_gain = rule.c_isect * count * area <= rule.c_trav * area + rule.c_isect * cost
    if count == 1 or (count <= rule.max_leaf_size and no_gain):
        tree.first[node], tree.size[node] = first, count
        return 0, 0, 0, -1, np.nan
    position = np.nan
    if is_spatial:
        axis = space_axis
        n_left, n_right, position = divide_spatially(
            references, first, count, room, bounds, axis, space_bin, n_left, n_right, used, bins
        )
    else:
        n_left = count // 2  # where nothing tells them apart: split by index
        if axis >= 0:
            n_left = divide(
                boxes, references.triangle, first, count, axis, last_left, low, scale, used
            )
        n_right = count - n_left
    # What is free goes to the children by their sizes. As many of the right ones as the gap is
    # wide go from in front of the others to behind them.
    free = room - n_left - n_right
    gap = free * n_left // (n_left + n_right)
    for i in range(first + n_left, first + n_left + min(gap, n_right)):
        swap(references, i, i + max(gap, n_right))
    left_room = n_left + gap
    tree.first[node], tree.size[node] = 2 * (first + left_room) - 1, 0
    tree.cut_depth[node] = depth if is_spatial else -1
    return n_left, n_right, left_room, axis, position


@inner
def push(stack, height, node, first, count, room, depth):
    """Remember a node to split."""
    stack[height, 0], stack[height, 1], stack[height, 2] = node, first, count
    stack[height, 3], stack[height, 4] = room, depth


@kernel
def build_subtree(tree, references, node, first, count, room, depth, rule, scratch):
    """Split a node and everything below it, depth-first."""
    stack = scratch.stack
    push(stack, 0, node, first, count, room, depth)
    height = 1
    while height > 0:
        height -= 1
        node, first, count = stack[height, 0], stack[height, 1], stack[height, 2]
        room, depth = stack[height, 3], stack[height, 4]
        n_left, n_right, left_room, _, _ = split_node(
            tree, references, node, first, count, room, depth, rule, scratch
        )
        if n_left > 0:
            left = tree.first[node]
            push(stack, height, left + 1, first + left_room, n_right, room - left_room, depth + 1)
            push(stack, height + 1, left, first, n_left, left_room, depth + 1)
            height += 2


class Node(NamedTuple):
    """A node that is still to be split: its number, its references, their room, its depth."""

    number: int
    first: int
    count: int
    room: int
    depth: int


class Split(NamedTuple):
    """A node that was split just now.

    Attributes
    ----------
    node, left, right : Node
    axis : int
    position : float
        Of the plane of a spatial split, otherwise NaN.
    """

    node: Node
    left: Node
    right: Node
    axis: int
    position: float


class Construction:
    """A tree under construction.

    Attributes
    ----------
    tree : Growing
    references : References
    root : Node
    """

    def __init__(self, primitives: Primitives, settings: BVHSettings) -> None:
        count = len(primitives.boxes)
        room = int(settings.duplication * count)
        boxes, triangle = np.empty((room, 6)), np.empty(room, np.int32)
        boxes[:count], triangle[:count] = primitives.boxes, np.arange(count)
        reach = np.abs(primitives.corners).max(axis=(0, 1))
        self.references = References(primitives.corners, ULPS * reach, triangle, boxes)
        n_nodes = 2 * room - 1
        self.tree = Growing(
            np.empty((n_nodes, 6)), np.empty(n_nodes, np.int32),
            np.full(n_nodes, -1, np.int32), np.full(n_nodes, -1, np.int8),
        )  # fmt: skip
        whole = np.concatenate([boxes[:count, :3].min(axis=0), boxes[:count, 3:].max(axis=0)])
        self.rule = SplitRule(
            settings.max_leaf_size, settings.bins, settings.C_trav, settings.C_isect,
            ALPHA * float(surface_area(whole)),
        )  # fmt: skip
        self.root = Node(0, 0, count, room, 0)
        self._scratch = make_scratch(settings.bins)

    def split(self, node: Node) -> Split | None:
        """Split a node; None if it becomes a leaf."""
        n_left, n_right, left_room, axis, position = call(
            split_node, self.tree, self.references, *node, self.rule, self._scratch
        )
        if n_left == 0:
            return None
        number, first, _, room, depth = node
        left = int(self.tree.first[number])
        return Split(
            node,
            Node(left, first, n_left, left_room, depth + 1),
            Node(left + 1, first + left_room, n_right, room - left_room, depth + 1),
            axis,
            position,
        )

    def finish(self, node: Node) -> int:
        """Split a node and everything below it; return how many references it had."""
        scratch = make_scratch(self.rule.bins)
        call(build_subtree, self.tree, self.references, *node, self.rule, scratch)
        return node.count


def build(primitives: Primitives, settings: BVHSettings, progress: Progress) -> Grouping:
    """Build the tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    work = Construction(primitives, settings)
    total, done = len(primitives.boxes), 0
    # The upper part, node by node; what is small enough is put aside.
    pending, subtrees = [work.root], []
    while pending:
        node = pending.pop()
        if node.count <= SUBTREE:
            subtrees.append(node)
            continue
        progress.report(0, total, "Building bvh")
        split = work.split(node)
        if split:
            pending += [split.left, split.right]
    # The lower parts, side by side.
    with ThreadPoolExecutor(core_count()) as pool:
        futures = [pool.submit(work.finish, node) for node in subtrees]
        try:
            for future in futures:
                done += future.result()
                progress.report(done, max(total, done), "Building bvh")
        finally:
            for future in futures:
                future.cancel()
    return finished(work, settings, progress)


# ------------------------------------------------------------------------------ without the gaps


def finished(work: Construction, settings: BVHSettings, progress: Progress) -> Grouping:
    """Return the tree without the room that was not needed."""
    growing = work.tree
    n_nodes = int((growing.size >= 0).sum())
    tree = Tree(np.empty((n_nodes, 6)), np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32))
    call(
        copy_depth_first, Tree(growing.boxes, growing.first, growing.size), tree,
        np.empty((STACK_SIZE, 4), np.int64),
    )  # fmt: skip
    leaves = np.flatnonzero(tree.size > 0)
    leaves = leaves[np.argsort(tree.first[leaves])]
    size = tree.size[leaves]
    begin = np.cumsum(size) - size
    kept = np.arange(size.sum()) + np.repeat(tree.first[leaves] - begin, size)
    tree.first[leaves] = begin
    triangle, boxes = work.references.triangle[kept], work.references.boxes[kept]
    pieces = None
    if settings.volume != "aabb":
        pieces = pieces_of(work.references, triangle, boxes, progress)
    return Grouping(tree, triangle, pieces, figures_of(work, len(kept)))


def figures_of(work: Construction, n_references: int) -> dict[str, Any]:
    """Return references per triangle, and how many spatial splits there are at which depth."""
    depth = work.tree.cut_depth
    return {
        "duplication": n_references / work.root.count,
        "spatial_splits": np.bincount(depth[depth >= 0]).tolist(),
    }


@kernel
def clip_references(corners, triangle, boxes, slack, first, last, offsets, out, polygon):
    """Write the parts of triangles in their boxes as fans of triangles.

    Where `out` has no room, write how many triangles each fan has, to ``offsets[reference + 1]``.

    Parameters
    ----------
    slack : (3,) float64
        The boxes are enlarged by it: a corner where an edge meets a face is rounded.
    first, last : int
        Which references.
    polygon : (2 * POLYGON_SIZE + 2, 3) float64
        Scratch for the polygon, and the enlarged box behind it.
    """
    box = polygon[2 * POLYGON_SIZE :].reshape(6)
    for i in range(first, last):
        for axis in range(3):
            box[axis] = boxes[i, axis] - slack[axis]
            box[3 + axis] = boxes[i, 3 + axis] + slack[axis]
        begin, end = clip(corners, triangle[i], box, polygon)
        if len(out) == 0:
            offsets[i + 1] = end - begin - 2
            continue
        to = offsets[i]
        for corner in range(begin + 1, end - 1):
            for axis in range(3):
                out[to, 0, axis] = polygon[begin, axis]
                out[to, 1, axis] = polygon[corner, axis]
                out[to, 2, axis] = polygon[corner + 1, axis]
            to += 1


def pieces_of(
    references: References, triangle: np.ndarray, boxes: np.ndarray, progress: Progress
) -> Pieces:
    """Return the parts of triangles (n,) in boxes (n, 6), for other volumes to be fitted to."""
    offsets = np.zeros(len(triangle) + 1, np.int64)

    def write(out: np.ndarray) -> None:
        def work(first: int, last: int) -> None:
            polygon = np.empty((2 * POLYGON_SIZE + 2, 3))
            call(
                clip_references, references.corners, triangle, boxes, references.slack,
                first, last, offsets, out, polygon,
            )  # fmt: skip

        for_chunks(work, len(triangle), 0, progress, "Clipping triangles")

    write(np.empty((0, 3, 3)))
    np.cumsum(offsets, out=offsets)
    corners = np.empty((int(offsets[-1]), 3, 3))
    write(corners)
    return Pieces(corners, offsets)
