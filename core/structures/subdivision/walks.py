"""Five walks from leaf to leaf along a ray (lecture, "Traversing adaptive subdivision").

- :class:`March`: find the leaf from the root, leave it through a face, start again from the root
  (Glassner 1984).
- :class:`Neighbours`: the same, but from a leaf only up to the nearest common ancestor of it and
  its neighbour, and down again (Samet 1989). With stored links (:class:`Ropes`) directly to the
  neighbour: the lecture's "finger tree".
- :class:`Recursive`: depth-first, near children first, with a stack (Gargantini, Atkinson 1993).
- :class:`Heap`: the same with a priority queue of cells, ordered by the t of their entry.
- :class:`Segments`: one pass through the tree cuts the ray into segments by leaf, then these are
  processed.

The walks themselves are in :mod:`.march`, :mod:`.recursive`, :mod:`.segments` and :mod:`.heap`.

All visit the same leaves in the same order. The walks with a stack visit every cell whose widened
interval (see :mod:`.tree`) is not empty. The marching ones follow one cell after the other; that
is the same sequence, unless the ray meets two planes at nearly the same t or runs in one. They
notice, and leave such a ray to the recursive walk.

A leaf's triangles may reach beyond it. A hit behind the leaf's exit is postponed: kept, and
accepted when no cell in front of it is left. The mailbox saves testing a triangle again.

A. Glassner: Space Subdivision for Fast Ray Tracing, IEEE CG&A 4(10), 1984.
H. Samet: Implementing Ray Tracing with Octrees and Neighbor Finding, C&G 13(4), 1989.
I. Gargantini, H. H. Atkinson: Ray Tracing an Octree, Computer Graphics Forum 12(4), 1993.
V. Havran: A Summary of Octree Ray Traversal Algorithms, Ray Tracing News 12(2), 1999.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...contract.counters import (
    MAILBOX_HITS,
    N_EETS,
    N_ETS,
    N_IT,
    N_TS,
    POSTPONED_HITS,
    VOLUME_TESTS,
)
from ...contract.events import NONE, VISIT_EMPTY, VISIT_LEAF, note
from ...contract.leaf import NOTHING, Best, test_leaf
from ...contract.missing import most_missing, note_if_missing
from ...contract.walk import Found, lost, missing
from ...geometry.rays import ALL, ANY
from ...kernels import inlined

# ----------------------------------------------------------------------- records: tree and walk


class Recursive(NamedTuple):
    """A tree to be walked depth-first; `mailbox` says whether to test a triangle only once."""

    tree: Any
    mailbox: bool


class March(NamedTuple):
    """A tree to be walked from the root for every leaf."""

    tree: Any
    mailbox: bool


class Segments(NamedTuple):
    """A tree that first cuts the ray into segments."""

    tree: Any
    mailbox: bool


class Heap(NamedTuple):
    """A tree to be walked with a priority queue."""

    tree: Any
    mailbox: bool


class Neighbours(NamedTuple):
    """A tree to be walked from a leaf to its neighbour through their common ancestor."""

    tree: Any
    mailbox: bool


class Ropes(NamedTuple):
    """A tree whose leaves have links to their neighbours.

    Attributes
    ----------
    ropes : (n_leaves, 6) int32
        Node behind each face -x, -y, -z, +x, +y, +z; -1 outside the root.
    boxes : (n_leaves, 6) float64
        Cells of the leaves.
    """

    tree: Any
    mailbox: bool
    ropes: np.ndarray
    boxes: np.ndarray


WALKS = {
    "march": March,
    "segments": Segments,
    "neighbours": Neighbours,
    "recursive": Recursive,
    "heap": Heap,
}
"""Records by the walk's name; :class:`Ropes` takes the place of neighbours with stored links."""


# ----------------------------------------------------------------------------------- in a leaf


class Visited(NamedTuple):
    """How far a walk has come.

    Attributes
    ----------
    best : Best
    leaves, empty, lacking : int
        Leaves entered, empty ones among them, and those that are still to be split.
    """

    best: Best
    leaves: int
    empty: int
    lacking: int


COUNTERS = N_TS, N_ETS, N_EETS, N_IT, VOLUME_TESTS, MAILBOX_HITS, POSTPONED_HITS
"""What all walks count."""

LOST, MISSED = lost(COUNTERS), missing(COUNTERS)

NOWHERE_YET = Visited(NOTHING, 0, 0, 0)
"""Before the first leaf."""


@inlined
def one_missing(visited):
    """Return what is known after a leaf that is still to be split."""
    return Visited(visited.best, visited.leaves + 1, visited.empty, visited.lacking + 1)


@inlined
def visit_leaf(
    tree, mailbox, geometry, ray, number, workspace, log, node, index, enter, leave, visited
):
    """Test the triangles of a leaf; return the new :class:`Visited`."""
    if note_if_missing(tree, node):
        return one_missing(visited)
    # Where a ray runs in a plane, or through an edge, the early exit may come before the entry.
    leave = leave if leave > enter else enter
    begin, end = tree.offsets[index], tree.offsets[index + 1]
    empty = visited.empty
    if begin == end:
        empty += 1
        note(log, VISIT_EMPTY, node, NONE, enter, leave)
    else:
        note(log, VISIT_LEAF, node, NONE, enter, leave)
    best = test_leaf(
        geometry, tree.references, mailbox, begin, end, ray, number, workspace, log,
        node, enter, leave, False, visited.best,
    )  # fmt: skip
    return Visited(best, visited.leaves + 1, empty, visited.lacking)


@inlined
def limit_of(tree, ray, visited):
    """Return the t up to which cells are visited: later ones cannot change the answer."""
    best = visited.best
    if visited.lacking > 0 and visited.lacking >= most_missing(tree):
        return -1.0
    if ray.query == ANY and best.primitive >= 0:
        return -1.0
    return best.t if ray.query != ALL and best.t < ray.t_max else ray.t_max


@inlined
def found(visited, inner):
    """Return the answer of a walk that has entered so many inner nodes."""
    if visited.lacking > 0:
        return MISSED
    best, leaves = visited.best, visited.leaves
    counts = (
        inner + leaves, leaves, visited.empty, best.tests, 1, best.mailbox_hits, best.postponed
    )  # fmt: skip
    return Found(best.t, best.primitive, counts)
