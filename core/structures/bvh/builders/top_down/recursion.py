"""Construction from the top down: divide the triangles of a node in two, then go on with each part.

What is common to all such builders. A node is split by a *rule*: a NamedTuple of a builder's
settings and arrays, whose type says how a split is chosen (:func:`choose`) and how the triangles
are divided (:func:`divide`). Whether a node is split at all is decided here, by

    Cost(V -> {L, R}) = C_trav + C_isect * (SA(L) / SA(V) * N_L + SA(R) / SA(V) * N_R)

It becomes a leaf where that is no less than the cost of testing all its triangles, C_isect * N,
unless they are more than a leaf may have.

Large nodes are split one by one, small subtrees by one kernel call each, all of them side by side
on different threads.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .....contract.build_log import BuildLog
from .....contract.workspace import MAXIMUM_DEPTH, STACK_SIZE
from .....geometry.box import NOTHING, area_of, around, box_at, put_box
from .....kernels import call, dispatched, inlined, inner, kernel, unsigned, whole
from .....parallel import Spare, Team, core_count, work_off
from .....progress import SILENT, Progress
from .....settings import setting
from ...topology.build_log import log_of_splits
from ...topology.collapse import LeafSettings
from ...topology.tree import Splits, Tree, copy_depth_first, make_splits, note_split

SUBTREE = 1 << 16
"""Triangles up to which a subtree is built by one kernel call, in some 50 ms. Between calls the
builder looks at the cancel button."""

SHARES, SMALLEST = 8, 1 << 10
"""Subtrees for each core, so that all have something to do until the end; but a call for fewer
triangles costs more than it is worth."""

PART = 1 << 14
"""References up to which a subtree is copied by one call, in some tenths of a millisecond."""

TEXT = "Building bvh"


class Limits(NamedTuple):
    """What every rule has to obey, for kernels.

    Attributes
    ----------
    max_leaf_size : int
    c_trav, c_isect : float
    in_turn : bool
        Split across x, y and z in turn by depth, instead of whichever is best.
    """

    max_leaf_size: int
    c_trav: float
    c_isect: float
    in_turn: bool


@dataclass(frozen=True)
class TopDownSettings(LeafSettings):
    """Settings of every builder from the top down."""

    axis: str = setting(
        "best",
        "Axis",
        "Across which axis a builder from the top down may split a node",
        choices={
            "best": "Whichever is best: by cost, or for medians the longest",
            "round_robin": "x, y and z in turn",
        },
    )


def limits_of(settings: TopDownSettings) -> Limits:
    """Return what the settings of all rules say."""
    in_turn = settings.axis == "round_robin"
    return Limits(settings.max_leaf_size, settings.C_trav, settings.C_isect, in_turn)


# --------------------------------------------------------------- what a rule has to implement
#
# Every rule has the fields `limits` and `bounds` (2, 6). One that looks at several candidates has
# `curve`, too, with no rows in a build; if it has some, `choose` fills them (:func:`note`).


@dispatched
def enclose(rule, first, count):
    """Write the box around a range of triangles into ``rule.bounds[0]``.

    ``rule.bounds[1]`` is the rule's own; most keep the box around the centroids there.
    """
    raise TypeError(f"no enclose for {type(rule).__name__}")


@dispatched
def choose(rule, first, count, depth):
    """Return the best split of a range of at least two triangles, whose bounds are known.

    Returns
    -------
    axis : int
        -1 if nothing tells the triangles apart.
    place : int
        Whatever :func:`divide` wants to know.
    position : float
        Of the plane, in scene units.
    cost : float
        SA(L) N_L + SA(R) N_R.
    """
    raise TypeError(f"no choose for {type(rule).__name__}")


@dispatched
def divide(rule, first, count, axis, place, position):
    """Reorder a range so that what goes left comes first; return how many those are."""
    raise TypeError(f"no divide for {type(rule).__name__}")


@inner
def axis_at(limits, depth, turn):
    """Return which axis is looked at as number `turn`; those in turn stop at the first that can."""
    return (depth + turn) % 3 if limits.in_turn else turn


@inner
def note(curve, row, axis, position, n_left, n_right, cost):
    """Write down a candidate, if there is room: see :class:`.....sah.split_curve.SplitCurve`."""
    if row < len(curve):
        curve[row, 0], curve[row, 1] = axis, position
        curve[row, 2], curve[row, 3], curve[row, 4] = n_left, n_right, cost


@inner
def enclose_boxes(boxes, first, count, out):
    """Write into `out` (2, 6) the box around boxes and that around their centroids, doubled."""
    around_all, centroids = NOTHING, NOTHING
    for i in range(unsigned(first), unsigned(first + count)):
        box = box_at(boxes, i)
        x, y, z = box[0] + box[3], box[1] + box[4], box[2] + box[5]
        around_all = around(around_all, box)
        centroids = around(centroids, (x, y, z, x, y, z))
    put_box(out, 0, around_all)
    put_box(out, 1, centroids)


@inner
def swap(boxes, order, i, j):
    """Exchange two triangles, or whatever the boxes are of and `order` has the numbers of."""
    i, j = unsigned(i), unsigned(j)
    a, b = box_at(boxes, i), box_at(boxes, j)
    put_box(boxes, i, b)
    put_box(boxes, j, a)
    order[i], order[j] = order[j], order[i]


# ----------------------------------------------------------------------------- one node, a subtree
#
# There are as many nodes as triangles, most of them of two to four. What each of them takes one
# call of is inlined: passing on every field of every array took an eighth of a build.


@inlined
def settle(rule, tree, splits, node, first, count, axis, place, position, cost):
    """Split a node as proposed or make it a leaf; return the size of its left child or 0.

    The children of a node that is cut between the triangles k - 1 and k are 2k - 1 and 2k. Every
    place is cut at most once, so threads need not agree on who takes which number.
    """
    limits, box = rule.limits, rule.bounds[0]
    for side in range(6):
        tree.boxes[node, side] = box[side]
    area = area_of(box)
    no_gain = limits.c_isect * count * area <= limits.c_trav * area + limits.c_isect * cost
    if count == 1 or (count <= limits.max_leaf_size and no_gain):
        tree.first[node], tree.size[node] = first, count
        return 0
    n_left = count // 2  # where nothing tells the triangles apart: split by index
    if axis >= 0:
        divided = divide(rule, first, count, axis, place, position)
        if 0 < divided < count:
            n_left = divided
        else:
            axis = -1  # a plane between numbers that have none between them has one side empty
    cut = first + n_left
    tree.first[node], tree.size[node] = 2 * cut - 1, 0
    split_cost = np.nan
    if axis >= 0 and cost < np.inf and area > 0.0:
        split_cost = limits.c_trav + limits.c_isect * cost / area
    note_split(splits, cut, axis, position, split_cost, n_left, count - n_left)
    return n_left


@inlined
def split_node(rule, tree, splits, node, first, count, depth):
    """Fit a node's box, then split it or make it a leaf; return the size of its left child or 0."""
    enclose(rule, first, count)
    axis, place, position, cost = -1, 0, 0.0, np.inf
    if count > 1 and depth < MAXIMUM_DEPTH // 2:
        axis, place, position, cost = choose(rule, first, count, depth)
    return settle(rule, tree, splits, node, first, count, axis, place, position, cost)


@inner
def push(stack, height, node, first, count, depth):
    """Remember a node to split."""
    stack[height, 0], stack[height, 1] = node, first
    stack[height, 2], stack[height, 3] = count, depth


@kernel
def build_subtree(rule, tree, splits, node, first, count, depth, stack, only_one):
    """Split a node and everything below it, depth-first, or only itself.

    One kernel for both, since each that Python calls costs compiling. Returns the size of the left
    child if it is only one, otherwise 0.
    """
    height = 0
    push(stack, height, node, first, count, depth)
    height += 1
    while height > 0:
        height -= 1
        node, first = stack[height, 0], stack[height, 1]
        count, depth = stack[height, 2], stack[height, 3]
        n_left = split_node(rule, tree, splits, node, first, count, depth)
        if only_one:
            return n_left
        if n_left > 0:
            left = whole(tree.first[node])
            push(stack, height, left + 1, first + n_left, count - n_left, depth + 1)
            push(stack, height + 1, left, first, n_left, depth + 1)
            height += 2
    return 0


# ------------------------------------------------------------------------------------ all nodes


def room_for(count: int, log: bool) -> tuple[Tree, Splits]:
    """Return room for a tree over so many triangles, and for notes of its splits if asked.

    A size of -1 marks a number that no node has taken.
    """
    n_nodes = 2 * count - 1
    tree = Tree(np.zeros((n_nodes, 6)), np.zeros(n_nodes, np.int32), np.full(n_nodes, -1, np.int32))
    return tree, make_splits(count if log else 0)


def compact(tree: Tree, part: int = PART) -> Tree:
    """Return a tree without the numbers that no node has taken, depth-first.

    Nodes need to be numbered as :func:`settle` does it: what is below one that has the references
    from `first` on, before `end`, has numbers between ``2 first`` and ``2 end - 1``.

    Parameters
    ----------
    part : int
        References up to which a subtree is copied by one call.
    """
    parts, upper, taken = [], [], 1
    pending = [(0, 0, 0, (len(tree.size) + 1) // 2)]
    while pending:
        old, new, first, end = pending.pop()
        if end - first <= part or tree.size[old] > 0:
            parts.append((old, new, taken))
            taken += int(np.count_nonzero(tree.size[2 * first + 1 : 2 * end - 1] >= 0))
        else:
            upper.append((old, new, taken))
            left = int(tree.first[old])
            cut = (left + 1) // 2
            pending += [(left + 1, taken + 1, cut, end), (left, taken, first, cut)]
            taken += 2
    out = Tree(np.empty((taken, 6)), np.empty(taken, np.int32), np.empty(taken, np.int32))
    for old, new, child in upper:
        out.boxes[new], out.first[new], out.size[new] = tree.boxes[old], child, 0

    def copy_some(begin: int, end: int) -> None:
        stack = np.empty((STACK_SIZE, 4), np.int64)
        for old, new, below in parts[begin:end]:
            call(copy_depth_first, tree, old, out, new, below, stack)

    with Team(SILENT, TEXT) as team:
        team.run(copy_some, len(parts), 1)
    return out


class Subtree(NamedTuple):
    """A node that is to be split: its number, its triangles, its depth."""

    node: int
    first: int
    size: int
    depth: int


def split_recursively(
    make_rule: Callable[[], Any],
    count: int,
    progress: Progress,
    log: bool,
    largest: int = SUBTREE,
) -> tuple[Tree, Callable[[], BuildLog] | None]:
    """Build a tree over so many triangles.

    Returns it, and what puts the log together, if `log` asks for one.

    Parameters
    ----------
    make_rule : callable
        Returns a rule with scratch memory of its own, for one thread.
    largest : int
        Triangles up to which a subtree is built by one call.

    Raises
    ------
    Cancelled
        From `progress`; calls under way are awaited first.
    """
    tree, splits = room_for(count, log)
    spare = Spare(lambda: (make_rule(), np.empty((STACK_SIZE, 4), np.int64)))
    shares = SHARES * core_count() if core_count() > 1 else 1
    whole_size = min(max(count // shares, SMALLEST), largest)

    def work(part: Subtree) -> list[Subtree]:
        """Split a node, or all below it; return the children that are left to do."""
        with spare.lent() as (rule, stack):
            only_one = part.size > whole_size
            n_left = call(build_subtree, rule, tree, splits, *part, stack, only_one)
        if not n_left:
            return []
        left, below = int(tree.first[part.node]), part.depth + 1
        return [
            Subtree(left, part.first, n_left, below),
            Subtree(left + 1, part.first + n_left, part.size - n_left, below),
        ]

    work_off(Subtree(0, 0, count, 0), work, lambda part: part.size, progress, TEXT)
    out = compact(tree)
    return out, functools.partial(log_of_splits, out, splits, by_level=False) if log else None
