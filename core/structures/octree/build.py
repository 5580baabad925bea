"""Building an octree: which cell is split, by which planes, and who goes into which octant.

All reference lists live in one long array, the arena. Splitting a cell appends the lists of its
eight octants; its own becomes garbage, which is swept out when the arena is full. So depth-first,
breadth-first and best-first building are one loop, and only the frontier differs.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...geometry.box import area_of
from ...kernels import call, inner, kernel
from ...memory import MOST_NUMBERS, refuse_if_too_large
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
from ..subdivision.settings import ADVICE
from .assignment import octant_box, octants_of
from .planes import choose_plane
from .storage import BuiltTree

NODES_PER_TRIANGLE, MOST_NODES = 16, 1 << 23
REFERENCES_PER_TRIANGLE, MOST_REFERENCES = 64, 1 << 25
"""Where building gives up, the larger of the two each: so many per triangle, or so many at all.

Where triangles meet in one point, are long compared with the cells, or leaves are to hold fewer
than meet, every level multiplies the cells and helps nobody.
"""

MANY, IN_VAIN = 64, 3
"""A cell of more than MANY triangles is not split where as many levels above it were IN_VAIN:
several octants got all of the triangles, the others none. Identical triangles would fill their
cells down to the last level."""

FINISHED, NEEDS_NODES, NEEDS_ARENA, PAUSED = range(4)
"""Why :func:`subdivide` returns."""

SLICE = 0.05
"""Seconds between two looks at the cancel button."""


class Rule(NamedTuple):
    """What decides splits, for kernels.

    `budget` is a number of nodes, `references` a number of them in the whole tree or inf. Without
    `descends`, the octants of a cell that is split are left as they are.

    `placement` is a record of :mod:`.planes`, `assignment` one of :mod:`.assignment`; the kernels
    for them are chosen by their types.
    """

    max_depth: int
    max_leaf_size: int
    budget: int
    order: int
    references: float
    placement: Any
    assignment: Any
    descends: bool = True


class Growing(NamedTuple):
    """A tree being built.

    Attributes
    ----------
    boxes : (capacity, 6) float64
    planes : (capacity, 3) float64
    first : (capacity,) int32
        First of eight children in a row; for leaves -1, less the number of levels in a row above
        them that were split in vain.
    begin, count : (capacity,) int64
        Reference list in the arena.
    level : (capacity,) uint8
    share : (capacity,) float64
        Of the references that the tree may have, see :mod:`..subdivision.frontier`.
    arena : (capacity of the arena,) int32
    frontier : Frontier
    used : (2,) int64
        Nodes taken, arena taken.
    """

    boxes: np.ndarray
    planes: np.ndarray
    first: np.ndarray
    begin: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of that name
    level: np.ndarray
    share: np.ndarray
    arena: np.ndarray
    frontier: Frontier
    used: np.ndarray


class Scratch(NamedTuple):
    """Scratch memory: octants of each reference as bits, numbers for a median, octant counts."""

    masks: np.ndarray
    values: np.ndarray
    counts: np.ndarray


@inner
def may_be_split(tree, node, rule):
    """Say whether a node is a candidate for splitting."""
    if tree.count[node] > MANY and tree.first[node] <= -1 - IN_VAIN:
        return False
    return tree.count[node] > rule.max_leaf_size and tree.level[node] < rule.max_depth


@inner
def offer(tree, node, rule):
    """Put a node into the frontier if it may be split."""
    if may_be_split(tree, node, rule):
        put(tree.frontier, node, area_of(tree.boxes[node]) * tree.count[node])


@inner
def place_planes(tree, node, rule, values):
    """Choose the three planes of a node; say whether each lies strictly inside."""
    for axis in range(3):
        low, high = tree.boxes[node, axis], tree.boxes[node, 3 + axis]
        plane = choose_plane(
            rule.placement, tree.boxes[node], axis,
            tree.arena, tree.begin[node], tree.count[node], rule.assignment, values,
        )  # fmt: skip
        if not low < plane < high:
            return False
        tree.planes[node, axis] = plane
    return True


@kernel
def subdivide(tree, rule, scratch, work):
    """Split candidates until there are none, room is lacking or `work` references are handled."""
    arena, frontier = tree.arena, tree.frontier
    while not is_empty(frontier):
        if work <= 0:
            return PAUSED
        node = peek(frontier)
        n_nodes, n_arena = tree.used[0], tree.used[1]
        if n_nodes + 8 > rule.budget:
            return FINISHED
        if n_nodes + 8 > len(tree.first):
            return NEEDS_NODES
        begin, count = tree.begin[node], tree.count[node]
        work -= 64 + count
        if not place_planes(tree, node, rule, scratch.values):
            drop(frontier)  # numbers cannot tell the halves apart: it stays a leaf
            continue
        # How many references go into each octant, then where.
        total = 0
        for octant in range(8):
            scratch.counts[octant] = 0
        cell, planes = tree.boxes[node], tree.planes[node]
        for i in range(count):
            mask = octants_of(rule.assignment, cell, planes, arena[begin + i])
            scratch.masks[i] = mask
            for octant in range(8):
                if mask >> octant & 1:
                    scratch.counts[octant] += 1
                    total += 1
        if total > rule.references * tree.share[node]:
            drop(frontier)
            continue
        if n_arena + total > len(arena):
            return NEEDS_ARENA
        drop(frontier)
        mark = tree.first[node] - 1 if total > count else np.int32(-1)
        for octant in range(8):
            if 0 < scratch.counts[octant] < count:
                mark = np.int32(-1)
        tree.first[node] = n_nodes
        tree.used[0], tree.used[1] = n_nodes + 8, n_arena + total
        for octant in range(8):
            new = n_nodes + octant
            octant_box(cell, planes, octant, tree.boxes[new])
            tree.first[new] = mark
            tree.level[new] = tree.level[node] + 1
            tree.begin[new], tree.count[new] = n_arena, scratch.counts[octant]
            tree.share[new] = tree.share[node] * tree.count[new] / total
            scratch.counts[octant] = n_arena  # from here on: place of the next reference
            n_arena += tree.count[new]
        for i in range(count):
            mask = scratch.masks[i]
            for octant in range(8):
                if mask >> octant & 1:
                    arena[scratch.counts[octant]] = arena[begin + i]
                    scratch.counts[octant] += 1
        # A stack hands out what came last.
        for octant in range(7, -1, -1):
            if rule.descends:
                offer(tree, n_nodes + octant, rule)
    return FINISHED


@kernel
def move_lists(source, begin, offsets, out):
    """Copy the lists that begin at ``source[begin[i]]`` to ``out[offsets[i]:offsets[i + 1]]``."""
    for i in range(len(begin)):
        for k in range(offsets[i + 1] - offsets[i]):
            out[offsets[i] + k] = source[begin[i] + k]


def sweep(tree: Growing) -> None:
    """Move the lists of leaves and candidates together, over those of inner nodes."""
    # Lists lie in the arena in the order of their nodes, so none is overwritten before it moves.
    leaves = np.flatnonzero(tree.first[: tree.used[0]] < 0)
    offsets = starts_of(tree.count[leaves])
    call(move_lists, tree.arena, tree.begin[leaves], offsets, tree.arena)
    tree.begin[leaves] = offsets[:-1]
    tree.used[1] = offsets[-1]


def starts_of(sizes: np.ndarray) -> np.ndarray:
    """Return where lists of these sizes begin, one behind the other, and where the last ends."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])


class Cutter:
    """Cuts cells of a tree into octants, and makes room for them.

    Parameters
    ----------
    n : int
        Triangles.
    box : (6,) float64
        The root's cell.

    Attributes
    ----------
    tree : Growing
        As far as it is cut, also if cutting is refused or stopped.
    """

    def __init__(self, n: int, box: np.ndarray, rule: Rule) -> None:
        self.n, self.rule = n, rule
        self.tree = with_room(None, 1024, max(4 * n, 1024), rule.order)
        self.tree.boxes[0], self.tree.first[0] = box, -1
        self.tree.count[0], self.tree.share[0] = n, 1.0
        self.tree.arena[:n] = np.arange(n)
        self.tree.used[:] = 1, n
        self.scratch = Scratch(np.empty(n, np.uint8), np.empty(n), np.empty(8, np.int64))

    def offer_root(self) -> None:
        """Let the root wait for being cut, if it may be."""
        if self.n > self.rule.max_leaf_size and self.rule.max_depth > 0:
            self.tree.frontier.state[1] = 1

    def cut(self, progress: Progress) -> None:
        """Cut what waits until nothing does.

        Raises
        ------
        InputError
            When nodes or references do not fit into memory.
        Cancelled
            From `progress`.
        """
        n, status, work = self.n, PAUSED, 1 << 12
        while status != FINISHED:
            tree = self.tree
            # Half way with a node for each triangle: how many there will be is not known before.
            progress.report(float(tree.used[0] / (tree.used[0] + n)), 1.0, "Building octree")
            start = time.perf_counter()
            status = call(subdivide, tree, self.rule, self.scratch, work)
            seconds = time.perf_counter() - start
            if status == NEEDS_NODES:
                most = min(max(NODES_PER_TRIANGLE * n, MOST_NODES), MOST_NUMBERS // 2)
                refuse_if_too_many(len(tree.first), most, "nodes")
                self.tree = with_room(tree, 2 * len(tree.first), len(tree.arena))
            elif status == NEEDS_ARENA:
                before = int(tree.used[1])
                sweep(tree)
                # Sweeping pays if it frees a good part, and there is room for the next list.
                if tree.used[1] > before // 2 or len(tree.arena) - tree.used[1] < 8 * n:
                    most = max(REFERENCES_PER_TRIANGLE * n, MOST_REFERENCES)
                    refuse_if_too_many(len(tree.arena), most, "references")
                    self.tree = with_room(tree, len(tree.first), 2 * len(tree.arena))
            elif seconds < SLICE:
                work *= 2
            elif seconds > 2 * SLICE:
                work = max(work // 2, 1)
        progress.report(1.0, 1.0, "Building octree")


def cut_into_octants(n: int, box: np.ndarray, rule: Rule, progress: Progress) -> Growing:
    """Build a whole tree over n triangles; see :class:`Cutter`."""
    cutter = Cutter(n, box, rule)
    cutter.offer_root()
    cutter.cut(progress)
    return cutter.tree


def refuse_if_too_many(room: int, most: int, what: str) -> None:
    """Raise InputError where all the room there may be, for `most` of a kind, has been taken."""
    if room >= most:
        raise InputError(f"the octree gets more than {most} {what}; {ADVICE}")


def with_room(
    old: Growing | None, n_nodes: int, n_references: int, order: int = DEPTH_FIRST
) -> Growing:
    """Return a growing tree with that much room; the arrays that fit already are kept."""
    if old is not None and n_nodes == len(old.first):
        refuse_if_too_large(
            4 * n_references, f"an octree with over {len(old.arena)} references", ADVICE
        )
        arena = np.empty(n_references, np.int32)
        arena[: old.used[1]] = old.arena[: old.used[1]]
        return old._replace(arena=arena)
    refuse_if_too_large(120 * n_nodes, f"an octree with over {n_nodes // 2} nodes", ADVICE)
    new = Growing(
        np.zeros((n_nodes, 6)), np.zeros((n_nodes, 3)), np.full(n_nodes, -1, np.int32),
        np.zeros(n_nodes, np.int64), np.zeros(n_nodes, np.int64), np.zeros(n_nodes, np.uint8),
        np.zeros(n_nodes),
        np.empty(n_references, np.int32) if old is None else old.arena,
        make_frontier(n_nodes, order) if old is None else enlarged(old.frontier, n_nodes),
        np.zeros(2, np.int64) if old is None else old.used,
    )  # fmt: skip
    if old is not None:
        for mine, theirs in zip(new[:7], old[:7], strict=True):
            mine[: len(theirs)] = theirs
    return new


# ------------------------------------------------------------------------------- renumbering


def finish(tree: Growing) -> BuiltTree:
    """Renumber: inner nodes level by level, leaves depth-first; list references by leaf."""
    n_nodes = int(tree.used[0])
    first, count = tree.first[:n_nodes], tree.count[:n_nodes]
    is_inner = first >= 0
    n_inner = int(is_inner.sum())
    # Inner nodes, level by level in the order of octants; leaves below each node, from the bottom.
    levels = [np.zeros(1, np.int64)]
    while len(levels[-1]):
        inner = levels[-1][is_inner[levels[-1]]]
        levels.append((first[inner][:, None].astype(np.int64) + np.arange(8)).ravel())
    n_leaves = (~is_inner).astype(np.int64)
    for level in reversed(levels):
        inner = level[is_inner[level]]
        n_leaves[inner] = n_leaves[first[inner][:, None] + np.arange(8)].sum(axis=1)
    number = np.zeros(n_nodes, np.int64)
    before = np.zeros(n_nodes, np.int64)  # leaves in front of each node
    taken = 0
    for level in levels:
        inner = level[is_inner[level]]
        number[inner] = taken + np.arange(len(inner))
        taken += len(inner)
        below = first[inner][:, None] + np.arange(8)
        sizes = n_leaves[below]
        before[below] = before[inner][:, None] + np.cumsum(sizes, axis=1) - sizes
    number[~is_inner] = n_inner + before[~is_inner]
    old = np.empty(n_nodes, np.int64)
    old[number] = np.arange(n_nodes)
    inner, leaves = old[:n_inner], old[n_inner:]
    children = number[first[inner][:, None] + np.arange(8)].astype(np.int32)
    offsets = starts_of(count[leaves])
    references = np.empty(int(offsets[-1]), np.int32)
    call(move_lists, tree.arena, tree.begin[leaves], offsets, references)
    return BuiltTree(
        tree.boxes[0].copy(), tree.planes[inner], children.reshape(-1, 8), tree.level[old],
        offsets, references, (old + 7) // 8, count[old],  # every step made eight nodes
    )  # fmt: skip
