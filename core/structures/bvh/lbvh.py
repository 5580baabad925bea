"""Linear BVH (LBVH): a node is an interval of sorted Morton codes, cut where their bits differ.

In an interval of sorted codes the highest bit in which any two differ is that in which the first
and the last differ, and it is 0 in all codes before some place and 1 from there on. There the
interval is cut: a split in the middle of an octree cell. Nobody asks what that costs; in return
building takes no longer than sorting.

Of equal codes the bits of the index decide, as if they followed those of the code. A leaf is made
where going on would cost more than testing all triangles, as in :mod:`.collapse`.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha: Fast BVH Construction on GPUs,
Eurographics 2009. The same tree with all its nodes at once: :mod:`.lbvh_parallel`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...geometry.box import area_of
from ...kernels import call, inner, kernel
from ...parallel import Team
from ...progress import Progress
from ..contract import STACK_SIZE
from .collapse import LeafRule, leaf_or_node
from .morton import sort_by_code
from .tree import Grouping, Primitives, Tree, copy_depth_first

if TYPE_CHECKING:
    from .settings import BVHSettings

SUBTREE = 1 << 14
"""References up to which a subtree is built by one thread alone."""


class Intervals(NamedTuple):
    """The tree while it is made.

    The children of a node that is cut between the references k - 1 and k are 2k - 1 and 2k: every
    place is cut at most once, so threads need not agree on who takes which number. A thread that
    has an interval [l, r) to itself takes the numbers 2l + 1 ... 2r - 2 in another order, namely
    depth-first.

    Attributes
    ----------
    boxes : (2n - 1, 6) float64
    begin, size : (2n - 1,) int32
        The interval of references. Once leaves are chosen, a size of 0 marks an inner node.
    first : (2n - 1,) int32
        Left child of an inner node (the right one is the next), first reference of a leaf.
    cost : (2n - 1,) float64
        Of the best subtree, in units of area.
    """

    boxes: np.ndarray
    begin: np.ndarray
    size: np.ndarray
    first: np.ndarray
    cost: np.ndarray


def make_intervals(count: int) -> Intervals:
    """Return room for a tree over a number of references; node 0 has them all."""
    nodes = 2 * count - 1
    begin, size, first = (np.zeros(nodes, np.int32) for _ in range(3))
    size[0] = count
    return Intervals(np.empty((nodes, 6)), begin, size, first, np.empty(nodes))


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
def find_cut(tree, codes, node):
    """Return where the interval of a node is cut: the first index of the right part."""
    begin, last = tree.begin[node], tree.begin[node] + tree.size[node] - 1
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


@kernel
def link(tree, node, child, middle):
    """Cut the interval of a node at `middle` into those of its children, `child` and the next."""
    begin, size = tree.begin[node], tree.size[node]
    tree.first[node] = child
    tree.begin[child], tree.size[child] = begin, middle - begin
    tree.begin[child + 1], tree.size[child + 1] = middle, begin + size - middle


@inner
def cut_all(tree, codes, root, stack):
    """Cut the interval of a node, then those of its children, down to single references."""
    child = 2 * tree.begin[root] + 1
    stack[0] = root
    height = 1
    while height > 0:
        height -= 1
        node = stack[height]
        if tree.size[node] > 1:
            link(tree, node, child, find_cut(tree, codes, node))
            stack[height], stack[height + 1] = child + 1, child
            height += 2
            child += 2


@inner
def fit_and_choose(tree, boxes, order, rule, node):
    """Fit the box of a node whose children are done, and say whether it is a leaf."""
    box, child, count = tree.boxes[node], tree.first[node], tree.size[node]
    if count == 1:
        for side in range(6):
            box[side] = boxes[order[tree.begin[node]], side]
        tree.first[node] = tree.begin[node]
        tree.cost[node] = rule.c_isect * area_of(box)
        return
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
def build_subtrees(tree, codes, boxes, order, rule, roots, stack, first, last):
    """Build what is below the nodes ``roots[first:last]``."""
    for i in range(first, last):
        root = roots[i]
        begin, end = tree.begin[root], tree.begin[root] + tree.size[root]
        cut_all(tree, codes, root, stack)
        for node in range(2 * end - 2, 2 * begin, -1):
            fit_and_choose(tree, boxes, order, rule, node)
        fit_and_choose(tree, boxes, order, rule, root)


@kernel
def finish_upper(tree, boxes, order, rule, upper):
    """Fit the upper nodes, listed with parents before children."""
    for i in range(len(upper) - 1, -1, -1):
        fit_and_choose(tree, boxes, order, rule, upper[i])


def build(primitives: Primitives, settings: BVHSettings, progress: Progress) -> Grouping:
    """Sort, cut, choose leaves.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    with Team(progress, "Building bvh") as team:
        codes, order = sort_by_code(primitives.boxes, int(settings.morton_bits), team)
        tree = make_intervals(len(codes))
        root, nothing = np.zeros(1, np.int64), np.zeros(0, np.int64)
        return complete(tree, codes, primitives.boxes, order, nothing, root, settings, team)


def complete(
    tree: Intervals,
    codes: np.ndarray,
    boxes: np.ndarray,
    order: np.ndarray,
    upper: np.ndarray,
    roots: np.ndarray,
    settings: BVHSettings,
    team: Team,
) -> Grouping:
    """Build what is missing of a tree.

    Parameters
    ----------
    codes : (n,) int64
        Ascending in the interval of each root.
    boxes : (n, 6) float64
        Of the triangles.
    order : (n,) int32
        The triangle of each reference.
    upper : (k,) int64
        The nodes that are linked already, parents before children.
    roots : (k + 1,) int64
        The others, below which everything is missing.

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    rule = LeafRule(settings.max_leaf_size, settings.C_trav, settings.C_isect)
    # What is too large for one thread is cut node by node.
    is_large = tree.size[roots] > SUBTREE
    pending, cut, subtrees = roots[is_large].tolist(), [], roots[~is_large].tolist()
    while pending:
        node = pending.pop()
        if tree.size[node] <= SUBTREE:
            subtrees.append(node)
            continue
        middle = call(find_cut, tree, codes, node)
        call(link, tree, node, 2 * middle - 1, middle)
        cut.append(node)
        pending += [2 * middle, 2 * middle - 1]

    # The lower parts, side by side.
    listed = np.array(subtrees)

    def build_some(first: int, last: int) -> None:
        stack = np.empty(STACK_SIZE, np.int64)
        call(build_subtrees, tree, codes, boxes, order, rule, listed, stack, first, last)

    team.run(build_some, len(listed), max(len(listed) * SUBTREE // len(codes), 1))
    call(finish_upper, tree, boxes, order, rule, np.append(upper, cut).astype(np.int64))
    out = Tree(np.empty_like(tree.boxes), np.empty_like(tree.first), np.empty_like(tree.size))
    stack = np.empty((STACK_SIZE, 2), np.int64)
    taken = call(copy_depth_first, Tree(tree.boxes, tree.first, tree.size), out, stack)
    return Grouping(Tree(*(array[:taken].copy() for array in out)), order)
