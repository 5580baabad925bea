"""R-tree by insertion: one box after the other, each into the leaf that grows least.

From the root down, the child is chosen whose surface grows least when it takes the box in. A leaf
with more than M entries is split in two, its parent gets one child more, and may have to be split
in turn; when the root is, the tree grows by a level. How the M + 1 entries of a full node are
shared out is Guttman's question:

- Quadratic: the two that would waste most surface in one box are put apart. Of the others, that is
  next which prefers one group to the other most, until all have gone to where they add less.
- Linear: those two are put apart that are farthest apart along some axis for the width of all. The
  others come as they are.

A group that needs all the rest to have m entries gets them. The order of insertion shapes the tree;
here it is that of the triangles.

Guttman measures boxes by area in the plane; here it is the surface, since the volume of flat boxes
is zero and tells nothing.

A. Guttman: R-Trees: A Dynamic Index Structure for Spatial Searching, SIGMOD 1984.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .....contract.build_log import INSERT, BuildLog
from .....geometry.box import area_of, union_area
from .....kernels import call, inner, kernel
from .....progress import Progress
from .....settings import setting
from ...topology.build_log import grouping_of_merges
from ...topology.collapse import LeafRule, LeafSettings
from ...topology.tree import Builder, Grouping, Primitives
from .nodes import LEAST, MOST, RTree, binary, enlarge

BOXES_PER_CALL = 4096
"""Boxes that one kernel call inserts, in some 20 ms; then the cancel button is looked at."""

MOST_LEVELS = 24
"""No tree of less than 2^31 references has more: every level has at least 3 times fewer nodes."""


@dataclass(frozen=True)
class Settings(LeafSettings):
    """Settings of the R-tree by insertion."""

    rtree_split: str = setting(
        "quadratic",
        "R-tree Split",
        "How a full node of an R-tree is shared out between two",
        choices={
            "quadratic": "The pair that wastes most surface apart, the most decided entry next",
            "linear": "The pair farthest apart along an axis, then the others as they come",
        },
    )


@inner
def choose_child(boxes, row, count, box):
    """Return which of the first entries of a row grows least to hold a box; of equals the smallest.

    The first one of those.
    """
    best, best_growth, best_area = 0, np.inf, np.inf
    for i in range(count):
        area = area_of(boxes[row[i]])
        growth = union_area(boxes[row[i]], box) - area
        if growth < best_growth or (growth == best_growth and area < best_area):
            best, best_growth, best_area = row[i], growth, area
    return best


@inner
def quadratic_seeds(boxes, row):
    """Return the places of the two entries whose common box wastes most surface, lower first."""
    worst, a, b = -np.inf, 0, 1
    for j in range(1, len(row)):
        for i in range(j):
            one, other = boxes[row[i]], boxes[row[j]]
            waste = union_area(one, other) - area_of(one) - area_of(other)
            if waste > worst:
                worst, a, b = waste, i, j
    return a, b


@inner
def linear_seeds(boxes, row):
    """Return the places of the two entries farthest apart along an axis, lower first."""
    widest, a, b = -np.inf, 0, 1
    for axis in range(3):
        last_begin, first_end = 0, 0
        low, high = np.inf, -np.inf
        for i in range(len(row)):
            low, high = min(low, boxes[row[i], axis]), max(high, boxes[row[i], 3 + axis])
            if boxes[row[i], axis] > boxes[row[last_begin], axis]:
                last_begin = i
            if boxes[row[i], 3 + axis] < boxes[row[first_end], 3 + axis]:
                first_end = i
        gap = boxes[row[last_begin], axis] - boxes[row[first_end], 3 + axis]
        # One entry may be both, and a flat node has no width: another axis tells them apart.
        if last_begin != first_end and high > low and gap / (high - low) > widest:
            widest = gap / (high - low)
            a, b = min(last_begin, first_end), max(last_begin, first_end)
    return a, b


@inner
def preference(boxes, entry, a, b):
    """Return how much more surface an entry adds to box b than to box a."""
    growth_a = union_area(boxes[a], boxes[entry]) - area_of(boxes[a])
    growth_b = union_area(boxes[b], boxes[entry]) - area_of(boxes[b])
    return growth_b - growth_a


@inner
def most_decided(boxes, row, first, last, a, b):
    """Return the place in ``row[first:last]`` of the entry that prefers a or b most."""
    most, best = -1.0, first
    for i in range(first, last):
        size = abs(preference(boxes, row[i], a, b))
        if size > most:
            most, best = size, i
    return best


@inner
def put_box(boxes, to, entry):
    """Give an entry the box of another."""
    for side in range(6):
        boxes[to, side] = boxes[entry, side]


@inner
def split(rtree, node, new, is_linear):
    """Share the MOST + 1 entries of a node out between it and a new one."""
    boxes, row = rtree.boxes, rtree.children[node]
    n = len(boxes) - len(rtree.size)
    a, b = n + node, n + new
    seed_a, seed_b = linear_seeds(boxes, row) if is_linear else quadratic_seeds(boxes, row)
    # The node keeps row[:first], the new one gets row[last:], what is between is to be decided.
    row[0], row[seed_a] = row[seed_a], row[0]
    row[MOST], row[seed_b] = row[seed_b], row[MOST]
    put_box(boxes, a, row[0])
    put_box(boxes, b, row[MOST])
    first, last = 1, MOST
    while first < last:
        pick = first if is_linear else most_decided(boxes, row, first, last, a, b)
        entry = row[pick]
        if last == LEAST:
            to_a = True
        elif MOST + 1 - first == LEAST:
            to_a = False
        else:
            # Of equals the smaller one takes it, and of those the emptier.
            gain = preference(boxes, entry, a, b)
            if gain == 0.0:
                gain = area_of(boxes[b]) - area_of(boxes[a])
            to_a = gain > 0.0 or (gain == 0.0 and first <= MOST + 1 - last)
        if to_a:
            row[pick], row[first] = row[first], entry
            first += 1
            enlarge(boxes, a, entry)
        else:
            last -= 1
            row[pick], row[last] = row[last], entry
            enlarge(boxes, b, entry)
    rtree.size[node], rtree.size[new] = first, MOST + 1 - first
    rtree.level[new] = rtree.level[node]
    for i in range(first, MOST + 1):
        rtree.children[new, i - first] = row[i]


@kernel
def insert_some(rtree, first, last, root, used, is_linear, path):
    """Insert the references ``first <= i < last``; return the root and the number of nodes then."""
    boxes, level = rtree.boxes, rtree.level
    n = len(boxes) - len(level)
    for reference in range(first, last):
        # Down to a leaf: all on the way have to contain it.
        node, height = root, 0
        enlarge(boxes, n + node, reference)
        while level[node] > 0:
            path[height] = node
            height += 1
            row, count = rtree.children[node], rtree.size[node]
            node = choose_child(boxes, row, count, boxes[reference]) - n
            enlarge(boxes, n + node, reference)
        path[height] = node
        # Up again while nodes get too full: the new half of one is an entry more for its parent.
        entry = reference
        while entry >= 0 and height >= 0:
            node = path[height]
            rtree.children[node, rtree.size[node]] = entry
            rtree.size[node] += 1
            entry = -1
            if rtree.size[node] > MOST:
                split(rtree, node, used, is_linear)
                entry = n + used
                used += 1
                height -= 1
        if entry >= 0:  # the root was split, too
            rtree.children[used, 0], rtree.children[used, 1] = n + root, entry
            rtree.size[used], level[used] = 2, level[root] + 1
            put_box(boxes, n + used, entry)
            enlarge(boxes, n + used, n + root)
            root = used
            used += 1
    return root, used


def insert_all(boxes: np.ndarray, *, is_linear: bool, progress: Progress) -> RTree:
    """Return the R-tree into which boxes (n, 6) are inserted in their order.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    n = len(boxes)
    # All nodes but the root have at least 3 children: fewer than n / 3 + n / 9 + ... = n / 2.
    room = n // 2 + 2
    rtree = RTree(
        np.concatenate([boxes, np.empty((room, 6))]), np.empty((room, MOST + 1), np.int64),
        np.zeros(room, np.int32), np.zeros(room, np.int32),
    )  # fmt: skip
    rtree.boxes[n, :3], rtree.boxes[n, 3:] = np.inf, -np.inf
    root, used, path = 0, 1, np.empty(MOST_LEVELS, np.int64)
    for first in range(0, n, BOXES_PER_CALL):
        progress.report(first, n, "Building bvh")
        last = min(first + BOXES_PER_CALL, n)
        root, used = call(insert_some, rtree, first, last, root, used, is_linear, path)
    progress.report(n, n, "Building bvh")
    return RTree(
        rtree.boxes[: n + used], rtree.children[:used], rtree.size[:used], rtree.level[:used]
    )


def build_rtree_insert(
    primitives: Primitives, settings: Settings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    is_linear = settings.rtree_split == "linear"
    rtree = insert_all(primitives.boxes, is_linear=is_linear, progress=progress)
    tree, rule = binary(rtree, progress), LeafRule.of(settings)
    if not log:
        return grouping_of_merges(tree, rule, None)
    # A node is complete when the last of its triangles has been inserted.
    n, complete = len(primitives.boxes), np.arange(1, len(tree.left) + 1)
    call(find_last, tree, complete)
    made = grouping_of_merges(tree, rule, complete[n:])
    return replace(made, log=lambda: with_insertions(made, n))


@kernel
def find_last(tree, complete):
    """Write for each inner node the last step of those below it; children come before parents."""
    for node in range((len(complete) + 1) // 2, len(complete)):
        complete[node] = max(complete[tree.left[node]], complete[tree.right[node]])


def with_insertions(made: Grouping, count: int) -> BuildLog:
    """Return the log of a grouping with the insertion of every triangle, a step each."""
    assert made.log is not None
    merges, references = made.log(), np.arange(count)
    inserted = BuildLog.of(INSERT, references + 1, references, cells=merges.cells)
    return replace(inserted.merged_with(merges), leaves=merges.leaves)


BUILDER = Builder(
    "R-tree, one triangle inserted after the other (Guttman 1984)",
    Settings,
    build_rtree_insert,
    bytes_per_triangle=570,
)
