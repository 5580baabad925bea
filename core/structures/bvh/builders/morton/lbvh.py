"""Linear BVH (LBVH): a node is an interval of sorted Morton codes, cut where their bits differ.

In an interval of sorted codes the highest bit in which any two differ is that in which the first
and the last differ, and it is 0 in all codes before some place and 1 from there on. There the
interval is cut: a split in the middle of an octree cell. Nobody asks what that costs; in return
building takes no longer than sorting.

Of equal codes the bits of the index decide, as if they followed those of the code. A leaf is made
where going on would cost more than testing all triangles, as in :mod:`...topology.collapse`.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha: Fast BVH Construction on GPUs,
Eurographics 2009. The same tree with all its nodes at once: :mod:`.lbvh_parallel`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....contract.build_log import BuildLog
from .....contract.workspace import STACK_SIZE
from .....geometry.box import area_of
from .....kernels import call, inner, kernel, whole
from .....parallel import Team
from .....progress import SILENT, Progress
from ...topology.build_log import log_of_splits
from ...topology.collapse import LeafRule, leaf_or_node
from ...topology.tree import (
    Builder,
    Grouping,
    Primitives,
    Splits,
    Tree,
    copy_depth_first,
    make_splits,
    ranges_of,
)
from .codes import MortonSettings, coding_over, planes_between, sort_by_code

SUBTREE = 1 << 13
"""References up to which a subtree is built by one thread alone, in memory that fits its cache."""


class Intervals(NamedTuple):
    """Nodes while they are made; children come behind their parents.

    Attributes
    ----------
    boxes : (n, 6) float64
    begin, size : (n,) int32
        The interval of references. Once leaves are chosen, a size of 0 marks an inner node.
    first : (n,) int32
        Left child of an inner node (the right one is the next), first reference of a leaf.
    cost : (n,) float64
        Of the best subtree, in units of area.
    """

    boxes: np.ndarray
    begin: np.ndarray
    size: np.ndarray
    first: np.ndarray
    cost: np.ndarray


def make_intervals(count: int) -> Intervals:
    """Return room for a number of nodes."""
    begin, size, first = (np.zeros(count, np.int32) for _ in range(3))
    return Intervals(np.empty((count, 6)), begin, size, first, np.empty(count))


class Parts(NamedTuple):
    """Subtrees that are built on their own.

    Attributes
    ----------
    begin, size : (k,) int64
        The interval of references of each.
    kept : (k,) int64
        Its nodes once leaves are chosen.
    cost : (k,) float64
        Of the whole, in units of area.
    place, below : (k,) int64
        In the finished tree: the number of its root, and that of the first node below.
    """

    begin: np.ndarray
    size: np.ndarray
    kept: np.ndarray
    cost: np.ndarray
    place: np.ndarray
    below: np.ndarray


@inner
def highest_bit(x):
    """Return the highest bit of a positive number, as a number."""
    x |= x >> 1
    x |= x >> 2
    x |= x >> 4
    x |= x >> 8
    x |= x >> 16
    x |= x >> 32
    return x - (x >> 1)


@kernel
def find_cut(codes, begin, end):
    """Return where an interval of sorted codes is cut: the first index of the right part."""
    last = end - 1
    if codes[begin] == codes[last]:
        return last & -highest_bit(begin ^ last)
    bit = highest_bit(codes[begin] ^ codes[last])
    low, high = begin, last  # the bit is 0 at low, 1 at high
    while low + 1 < high:
        middle = (low + high) >> 1
        if codes[middle] & bit:
            high = middle
        else:
            low = middle
    return high


@inner
def cut_all(tree, codes, stack):
    """Cut the interval of node 0, then those of its children, down to single references."""
    child, height = 1, 1
    stack[0, 0] = 0
    while height > 0:
        height -= 1
        node = stack[height, 0]
        if tree.size[node] > 1:
            begin = whole(tree.begin[node])
            end = begin + tree.size[node]
            middle = find_cut(codes, begin, end)
            tree.first[node] = child
            tree.begin[child], tree.size[child] = begin, middle - begin
            tree.begin[child + 1], tree.size[child + 1] = middle, end - middle
            stack[height, 0], stack[height + 1, 0] = child + 1, child
            height += 2
            child += 2


@inner
def choose(tree, rule, node):
    """Fit the box of a node around its children, and say whether it is a leaf."""
    box, child, count = tree.boxes[node], tree.first[node], tree.size[node]
    for side in range(3):
        a, b = tree.boxes[child, side], tree.boxes[child + 1, side]
        box[side] = b if b < a else a
        a, b = tree.boxes[child, 3 + side], tree.boxes[child + 1, 3 + side]
        box[3 + side] = b if b > a else a
    below = tree.cost[child] + tree.cost[child + 1]
    is_leaf, tree.cost[node] = leaf_or_node(rule, count, area_of(box), below)
    if is_leaf:
        tree.first[node] = tree.begin[node]
    else:
        tree.size[node] = 0


@kernel
def build_parts(tree, codes, boxes, order, rule, parts, out, stack, first, last):
    """Build the parts ``first <= i < last``, in `tree`, and copy what is kept to `out`.

    Part i goes to row ``2 * parts.begin[i]`` and those behind.
    """
    for i in range(first, last):
        tree.begin[0], tree.size[0] = parts.begin[i], parts.size[i]
        cut_all(tree, codes, stack)
        for node in range(2 * parts.size[i] - 2, -1, -1):
            if tree.size[node] > 1:
                choose(tree, rule, node)
                continue
            tree.first[node] = tree.begin[node]
            for side in range(6):
                tree.boxes[node, side] = boxes[order[tree.begin[node]], side]
            tree.cost[node] = rule.c_isect * area_of(tree.boxes[node])
        parts.cost[i] = tree.cost[0]
        place = 2 * parts.begin[i]
        parts.kept[i] = copy_depth_first(tree, 0, out, place, place + 1, stack)


@kernel
def choose_upper(top, rule, upper):
    """Choose among the upper nodes, listed with parents before children."""
    for i in range(len(upper) - 1, -1, -1):
        choose(top, rule, upper[i])


@kernel
def place_parts(parts, source, out, first, last):
    """Copy the parts ``first <= i < last`` to their places in the finished tree."""
    for i in range(first, last):
        begin = 2 * parts.begin[i]
        shift = parts.below[i] - 1 - begin
        for k in range(parts.kept[i]):
            old, new = begin + k, parts.place[i] if k == 0 else shift + begin + k
            for side in range(6):
                out.boxes[new, side] = source.boxes[old, side]
            out.size[new] = source.size[old]
            out.first[new] = source.first[old] + (shift if source.size[old] == 0 else 0)


def build_lbvh(
    primitives: Primitives, settings: MortonSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Sort, cut, choose leaves.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    with Team(progress, "Building bvh") as team:
        codes, order = sort_by_code(primitives.boxes, settings, team)
        top = make_intervals(1)
        top.size[0] = len(codes)
        tree = complete(top, [], [0], codes, primitives.boxes, order, settings, team)
    if not log:
        return Grouping(tree, order)
    boxes = primitives.boxes
    return Grouping(tree, order, log=lambda: log_of_codes(tree, codes, boxes, settings))


def splits_by_codes(
    tree: Tree, codes: np.ndarray, boxes: np.ndarray, settings: MortonSettings
) -> Splits:
    """Return the splits of a tree whose nodes are intervals of sorted codes, (n,) int64.

    Parameters
    ----------
    boxes : (n, 6) float64
        Of the triangles, in any order.
    """
    begin, end = ranges_of(tree.first, tree.size, np.full(len(tree.size), 2))
    inner = np.flatnonzero(tree.size == 0)
    begin, end, cuts = begin[inner], end[inner], begin[tree.first[inner] + 1]
    splits = make_splits(len(codes))
    with Team(SILENT, "Reading the codes") as team:
        coding = coding_over(boxes, settings, team)
    splits.axis[cuts], splits.position[cuts] = planes_between(codes[begin], codes[end - 1], coding)
    splits.counts[cuts, 0], splits.counts[cuts, 1] = cuts - begin, end - cuts
    return splits


def log_of_codes(
    tree: Tree, codes: np.ndarray, boxes: np.ndarray, settings: MortonSettings
) -> BuildLog:
    """Return the log of such a tree, a level a step."""
    return log_of_splits(tree, splits_by_codes(tree, codes, boxes, settings), by_level=True)


def complete(
    top: Intervals,
    upper: list[int],
    roots: list[int],
    codes: np.ndarray,
    boxes: np.ndarray,
    order: np.ndarray,
    settings: MortonSettings,
    team: Team,
) -> Tree:
    """Build what is below some nodes, choose leaves, and return the finished tree.

    Parameters
    ----------
    top : Intervals
        The upper tree.
    upper, roots : list of int
        Its nodes that have children, and those that are to get some.
    codes : (n,) int64
        Ascending in the interval of each root.
    boxes : (n, 6) float64
        Of the triangles.
    order : (n,) int32
        The triangle of each reference.

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    rule = LeafRule.of(settings)
    top, upper, roots = cut_upper(top, upper, roots, codes)
    begin, size = top.begin[roots].astype(np.int64), top.size[roots].astype(np.int64)
    kept, place, below = (np.zeros(len(roots), np.int64) for _ in range(3))
    parts = Parts(begin, size, kept, np.empty(len(roots)), place, below)
    rows = make_tree(2 * len(codes))

    def build_some(first: int, last: int) -> None:
        tree, stack = make_intervals(2 * SUBTREE), np.empty((STACK_SIZE, 2), np.int64)
        call(build_parts, tree, codes, boxes, order, rule, parts, rows, stack, first, last)

    some = max(4 * SUBTREE * len(roots) // len(codes), 1)  # parts that are worth a call
    team.run(build_some, len(roots), some)
    top.boxes[roots], top.cost[roots] = rows.boxes[2 * begin], parts.cost
    call(choose_upper, top, rule, np.array(upper, np.int64))

    number, n_nodes = arrange(top, roots, parts)
    out = make_tree(n_nodes)
    upper = [node for node in upper if number[node] >= 0]
    for source, target in zip((top.boxes, top.first, top.size), out, strict=True):
        target[number[upper]] = source[upper]
    team.run(lambda *block: call(place_parts, parts, rows, out, *block), len(roots), some)
    return out


def make_tree(count: int) -> Tree:
    """Return room for a number of nodes; memory is taken when it is written to."""
    return Tree(np.empty((count, 6)), np.empty(count, np.int32), np.empty(count, np.int32))


def cut_upper(
    top: Intervals, upper: list[int], roots: list[int], codes: np.ndarray
) -> tuple[Intervals, list[int], list[int]]:
    """Return the upper tree, its upper nodes and its roots, with no root of more than SUBTREE."""
    begin, size, first = top.begin.tolist(), top.size.tolist(), top.first.tolist()
    pending, upper, small = roots[::-1], upper.copy(), []
    while pending:
        node = pending.pop()
        if size[node] <= SUBTREE:
            small.append(node)
            continue
        a, b = begin[node], begin[node] + size[node]
        middle = call(find_cut, codes, a, b)
        first[node] = len(begin)
        pending += [len(begin) + 1, len(begin)]
        begin += [a, middle]
        size += [middle - a, b - middle]
        first += [0, 0]
        upper.append(node)
    out = make_intervals(len(begin))
    out.begin[:], out.size[:], out.first[:] = begin, size, first
    return out, upper, small


def arrange(top: Intervals, roots: list[int], parts: Parts) -> tuple[np.ndarray, int]:
    """Give the nodes numbers, depth-first, siblings together, and the parts their places.

    Returns
    -------
    number : (n,) int64
        Of the nodes of the upper tree; -1 for what is below a leaf.
    n_nodes : int
        Number of all nodes.
    """
    part = dict(zip(roots, range(len(roots)), strict=True))
    first, size, kept = top.first.tolist(), top.size.tolist(), parts.kept.tolist()
    parts.kept[:] = 0  # a part below a leaf is not needed
    number = np.full(len(first), -1)
    pending, taken = [(0, 0)], 1
    while pending:
        node, new = pending.pop()
        number[node] = new
        i = part.get(node)
        if i is not None:
            parts.place[i], parts.below[i], parts.kept[i] = new, taken, kept[i]
            taken += kept[i] - 1
        elif size[node] == 0:
            pending += [(first[node] + 1, taken + 1), (first[node], taken)]
            top.first[node] = taken
            taken += 2
    return number, taken


BUILDER = Builder(
    "Intervals of sorted Morton codes (Lauterbach 2009)",
    MortonSettings,
    build_lbvh,
)
