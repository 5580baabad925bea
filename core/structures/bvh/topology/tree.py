"""The trees of hierarchies: what builders make, what optimisers rearrange, what walks take.

Topology and volume are independent. A builder groups references to triangles, here into a
:class:`Grouping`: a tree whose leaves are ranges of references. Volumes are fitted to it afterwards
(:mod:`.fit`).

An optimiser moves subtrees about, for which a :class:`LinkedTree` with one reference per leaf is
handier: :func:`linked` makes one, :func:`.collapse.collapse` makes a grouping of it again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from ....contract.build_log import BuildLog
from ....geometry.box import box_at, put_box
from ....kernels import call, inner, kernel, unsigned
from ....progress import Progress
from ....ranges import ranges


class Primitives(NamedTuple):
    """What a builder builds over.

    Attributes
    ----------
    geometry : NamedTuple of arrays
        Of the scene, for builders that cut what they group.
    boxes : (n, 6) float64
        Box of each item; the builder may reorder or overwrite them.
    """

    geometry: Any
    boxes: np.ndarray


class Tree(NamedTuple):
    """A binary tree; node 0 is the root, siblings are neighbours.

    Attributes
    ----------
    boxes : (n_nodes, 6) float64
    first : (n_nodes,) int32
        Left child of an inner node (the right one is the next), first reference of a leaf.
    size : (n_nodes,) int32
        References of a leaf; 0 marks an inner node.
    """

    boxes: np.ndarray
    first: np.ndarray
    size: np.ndarray


class LinkedTree(NamedTuple):
    """A binary tree that can be rearranged: every node knows its parent and its children.

    Of n leaves with one reference each: leaf i is node i and has reference i, inner nodes are
    ``n ... 2n - 2`` in any order.

    Attributes
    ----------
    boxes : (2n - 1, 6) float64
    left, right : (2n - 1,) int32
        -1 for leaves.
    parent : (2n - 1,) int32
        -1 for the root.
    """

    boxes: np.ndarray
    left: np.ndarray
    right: np.ndarray
    parent: np.ndarray


class Splits(NamedTuple):
    """The splits by which a tree was built from the top down, as its builder notes them for a log.

    A split is known by the place in the order of references where it cuts: the first reference of
    the right child. Without any rows, nothing is noted.

    Attributes
    ----------
    axis : (n_references,) int8
        Of the plane; -1 where a node was split by index, and where there is no split.
    position : (n_references,) float64
        NaN where a node was split by index.
    cost : (n_references,) float64
        Cost(V -> {L, R}), see :mod:`..builders.top_down.recursion`; NaN where nobody asked for it.
    counts : (n_references, 2) int32
        References of both children.
    """

    axis: np.ndarray
    position: np.ndarray
    cost: np.ndarray
    counts: np.ndarray


def make_splits(count: int) -> Splits:
    """Return room for the splits of a tree over so many references; 0 notes none."""
    return Splits(
        np.full(count, -1, np.int8), np.full(count, np.nan), np.full(count, np.nan),
        np.full((count, 2), -1, np.int32),
    )  # fmt: skip


@inner
def note_split(splits, cut, axis, position, cost, n_left, n_right):
    """Note a split, if there is room."""
    if cut < len(splits.axis):
        splits.axis[cut], splits.cost[cut] = axis, cost
        splits.position[cut] = position if axis >= 0 else np.nan
        splits.counts[cut, 0], splits.counts[cut, 1] = n_left, n_right


@dataclass(frozen=True)
class Grouping:
    """What a builder makes.

    Attributes
    ----------
    tree : Tree
    order : (n_references,) int32
        The triangle of each reference. A leaf's references follow each other, and those of every
        subtree do, too.
    parts : (n_references, 6) float64, optional
        Box of the part of its triangle that each reference stands for; None if it is the whole one.
    figures : dict
        Figures of this builder only, for the statistics.
    log : callable, optional
        Puts the log of the building together, if it was asked for. Its cells are the nodes.
    """

    tree: Tree
    order: np.ndarray
    parts: np.ndarray | None = None
    figures: dict[str, Any] = field(default_factory=dict)
    log: Callable[[], BuildLog] | None = None


class Builds(Protocol):
    """Makes a grouping, with a log if asked for one."""

    def __call__(
        self, primitives: Primitives, settings: Any, progress: Progress, log: bool = ...
    ) -> Grouping:
        """Group primitives as settings say."""


class Builder(NamedTuple):
    """A way to group primitives.

    Attributes
    ----------
    summary : str
        One sentence without a full stop.
    Settings : type
        Its settings dataclass.
    build : callable
        Makes a grouping: ``build(primitives, settings, progress, log)``, where `log` says whether
        it is to have a log.
    most_duplicates : callable
        Returns how many references its settings allow beside one per triangle, per triangle.
    bytes_per_triangle : int
        Memory at the peak of a build, from the boxes to the finished structure, with a triangle per
        leaf and without a log. Measured over 16,000 and 63,000 triangles, and a few bytes more.
    """

    summary: str
    Settings: type
    build: Builds
    most_duplicates: Callable[[Any], float] = lambda settings: 0.0
    bytes_per_triangle: int = 330


@kernel
def copy_depth_first(tree, root, out, place, below, stack):
    """Copy a subtree, its nodes renumbered depth-first, siblings together.

    Its root gets the number `place`, all others get `below` and those that follow. Returns how many
    nodes there are. A walk that goes down then mostly goes on in memory: 10% faster on random rays.
    """
    stack[0, 0], stack[0, 1] = root, place
    height, taken = 1, below
    while height > 0:
        height -= 1
        old, new = unsigned(stack[height, 0]), unsigned(stack[height, 1])
        put_box(out.boxes, new, box_at(tree.boxes, old))
        out.first[new], out.size[new] = tree.first[old], tree.size[old]
        if tree.size[old] == 0:
            out.first[new] = taken
            for right in range(1, -1, -1):
                stack[height, 0], stack[height, 1] = tree.first[old] + right, taken + right
                height += 1
            taken += 2
    return taken - below + 1


def leaves_only(boxes: np.ndarray) -> LinkedTree:
    """Return the leaves with these boxes, (n, 6), and room for the tree that is to connect them."""
    nodes = 2 * len(boxes) - 1
    links = (np.full(nodes, -1, np.int32) for _ in range(3))
    return LinkedTree(np.concatenate([boxes, np.empty((len(boxes) - 1, 6))]), *links)


def root_of(tree: LinkedTree) -> int:
    """Return the node without a parent."""
    return int(np.flatnonzero(tree.parent < 0)[0])


def linked_numbers(tree: Tree) -> np.ndarray:
    """Return which node of the linked tree every node of one with one reference per leaf is."""
    is_leaf = tree.size > 0
    count = int(is_leaf.sum())
    number = np.empty(len(tree.size), np.int32)
    number[is_leaf] = tree.first[is_leaf]
    number[~is_leaf] = count + np.arange(len(number) - count)
    return number


def linked(tree: Tree) -> LinkedTree:
    """Return a tree with one reference per leaf as a linked one.

    Raises
    ------
    ValueError
        If a leaf has several.
    """
    is_leaf = tree.size > 0
    if (tree.size[is_leaf] != 1).any():
        raise ValueError("a leaf has several references")
    number = linked_numbers(tree)
    out = LinkedTree(
        np.empty((len(number), 6)), *(np.full(len(number), -1, np.int32) for _ in range(3))
    )
    out.boxes[number] = tree.boxes
    inner, first = number[~is_leaf], tree.first[~is_leaf]
    out.left[inner], out.right[inner] = number[first], number[first + 1]
    out.parent[number[first]] = out.parent[number[first + 1]] = inner
    return out


def depths_of(first: np.ndarray, size: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Return the depth of every node of a tree whose inner nodes have `width` children."""
    depth = np.zeros(len(size), dtype=np.int64)
    level = np.zeros(1, dtype=np.int64)
    below = 0
    while len(level):
        depth[level] = below
        parents = level[size[level] == 0]
        children = width[parents]
        level = ranges(first[parents], children)
        below += 1
    return depth


@kernel
def find_ranges(first, size, width, begin, end):
    """Write the range of references below every node; children come behind their parents."""
    for node in range(len(size) - 1, -1, -1):
        if size[node] > 0:
            begin[node], end[node] = first[node], first[node] + size[node]
        else:
            begin[node] = begin[first[node]]
            end[node] = end[first[node] + width[node] - 1]


def ranges_of(
    first: np.ndarray, size: np.ndarray, width: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return begin and end of the references below every node, (n_nodes,) int64 each."""
    begin, end = np.empty(len(size), np.int64), np.empty(len(size), np.int64)
    call(find_ranges, first, size, width, begin, end)
    return begin, end
