"""An octree whose cells are split when a ray first enters them.

The build makes the root, which lists everything. A leaf that the rule of the tree would go on
splitting is *open*. A ray that enters one notes it, and it is split once, into eight leaves that
may be open in turn (:mod:`...contract.lazy`). How a cell is split depends on its ancestors alone,
so the tree is, where rays have been, the one that a build would have made; elsewhere it ends early.

Nodes have numbers in the order in which they are made, and keep them: whoever has noted one finds
it again. So the tree is kept with pointers, one to the first of eight children in a row.

A. Glassner: Space Subdivision for Fast Ray Tracing, IEEE CG&A 4(10), 1984: voxels are created on
demand.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...contract.missing import most_missing, note_if_missing
from ...kernels import call, implements, kernel, whole
from ...progress import Progress
from ..subdivision.tree import child, leaf_index
from .build import Cutter, Growing, Rule, may_be_split, move_lists, starts_of


class LazyPointers(NamedTuple):
    """The tree as its walks see it, as far as it is split.

    Attributes
    ----------
    box : (6,) float64
    planes : (n_nodes, 3) float64
        Of inner nodes.
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32
        Ascending within a leaf.
    first : (n_nodes,) int32
        The first of the eight children, negative for leaves.
    leaf : (n_nodes,) int32
        Index of each leaf, -1 for inner nodes.
    is_open : (n_nodes,) uint8
        1 for a leaf that is split, or found to be none that can be, when a ray enters it.
    wanted : (n_nodes,) uint8
    look_ahead : int
        See :class:`...contract.lazy.LazyStructure`.
    """

    box: np.ndarray
    planes: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    first: np.ndarray
    leaf: np.ndarray
    is_open: np.ndarray
    wanted: np.ndarray
    look_ahead: int


@implements(leaf_index, LazyPointers)
def stored_leaf_index(tree, node):
    """Look it up."""
    return whole(tree.leaf[node])


@implements(child, LazyPointers)
def child_in_a_row(tree, node, side):
    """Count from the first one."""
    return whole(tree.first[node]) + side


@implements(note_if_missing, LazyPointers, inline=True)
def note_if_open(tree, node):
    """Look whether the leaf is open."""
    if tree.is_open[node] == 0:
        return False
    tree.wanted[node] = 1
    return True


@implements(most_missing, LazyPointers, inline=True)
def look_ahead_of(tree):
    """As far as the driver says."""
    return tree.look_ahead


@kernel
def find_open(tree, rule, first, last, is_open):
    """Write which of the nodes ``first <= i < last`` the rule would split."""
    for node in range(first, last):
        is_open[node] = may_be_split(tree, node, rule)


def as_it_grows(tree: Growing, rule: Rule, before: LazyPointers | None) -> LazyPointers:
    """Return a tree as walks see it; what is open was so `before`, or is new."""
    n_nodes = int(tree.used[0])
    is_leaf = tree.first[:n_nodes] < 0
    is_open = np.zeros(n_nodes, np.uint8)
    known = 0 if before is None else len(before.first)
    if before is not None:
        is_open[:known] = before.is_open
    call(find_open, tree, rule, known, n_nodes, is_open)
    is_open[~is_leaf] = 0
    leaves = np.flatnonzero(is_leaf)
    leaf = np.full(n_nodes, -1, np.int32)
    leaf[leaves] = np.arange(len(leaves))
    offsets = starts_of(tree.count[leaves])
    references = np.empty(int(offsets[-1]), np.int32)
    call(move_lists, tree.arena, tree.begin[leaves], offsets, references)
    return LazyPointers(
        tree.boxes[0].copy(), tree.planes[:n_nodes].copy(), offsets, references,
        tree.first[:n_nodes].copy(), leaf, is_open, np.zeros(0, np.uint8), 0,
    )  # fmt: skip


def split_open(
    cutter: Cutter, before: LazyPointers, wanted: np.ndarray, progress: Progress
) -> tuple[LazyPointers, int]:
    """Split open leaves, each once; return the tree with them split, and how many there were.

    Parameters
    ----------
    wanted : (n,) uint8
        Of the nodes there were when rays noted them.

    Raises
    ------
    InputError
        When the tree gets too large.
    Cancelled
        From `progress`.
    """
    nodes = np.flatnonzero((wanted != 0) & (before.is_open[: len(wanted)] != 0))
    nodes = nodes[cutter.tree.first[nodes] < 0]  # a cut that was stopped may have come to some
    frontier: Any = cutter.tree.frontier
    frontier.nodes[: len(nodes)], frontier.state[:] = nodes, (0, len(nodes))
    cutter.cut(progress)
    done = before.is_open.copy()
    done[nodes] = 0
    return as_it_grows(cutter.tree, cutter.rule, before._replace(is_open=done)), len(nodes)
