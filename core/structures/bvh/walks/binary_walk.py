"""The walk of a binary hierarchy, front to back with a stack.

Of two children the nearer is entered first, the other waits on a stack and is thrown away if a hit
nearer than its volume has been found meanwhile. What kind of volumes they are is not its affair.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ....contract.events import NONE, SKIP, VISIT_INNER, VISIT_LEAF, VOLUME_TEST, note
from ....contract.instances import rooted
from ....contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ....contract.walk import Found, walk
from ....geometry.rays import ALL, ANY
from ....geometry.volume import MISS, enter, prepare
from ....kernels import dispatched, implements, unsigned, whole


class Binary(NamedTuple):
    """A binary hierarchy as its walk sees it; siblings are neighbours.

    Attributes
    ----------
    volumes : NamedTuple of arrays
        The volume of every node; its type says of what kind.
    first : (n_nodes,) int32
        Left child of an inner node (the right one is the next), first triangle of a leaf.
    size : (n_nodes,) int32
        Items of a leaf; 0 marks an inner node.
    root : int
        Not 0 in a forest, where the trees of several meshes lie one after the other.
    """

    volumes: Any
    first: np.ndarray
    size: np.ndarray
    root: int = 0


ONE = unsigned(1)


@implements(rooted, Binary)
def tree_of_forest(forest, root):
    """Exchange the root."""
    return Binary(forest.volumes, forest.first, forest.size, root)


@dispatched
def walk_from(structure, geometry, ray, number, workspace, log, node, t, floor, best):
    """Walk through the subtree of a node that the ray enters, with what is found elsewhere.

    Parameters
    ----------
    node : int
    t : float
        Where the ray enters it.
    floor : int
        Height of the stack; what lies below is not touched.
    best : Best
        The nearest hit so far.

    Returns
    -------
    best : Best
    nodes_visited, leaves_visited, volume_tests : int
    """
    raise TypeError(f"no nodes in {type(structure).__name__}")


@implements(walk_from, Binary, inline=True)
def walk_subtree(structure, geometry, ray, number, workspace, log, node, t, floor, best):
    """Front-to-back traversal with a stack."""
    volumes, firsts, sizes = structure.volumes, structure.first, structure.size
    cells, enters, strips = workspace.cells, workspace.enters, workspace.frame
    limit = best.t if ray.query != ALL and best.primitive >= 0 else ray.t_max
    nodes_visited, leaves_visited, volume_tests = 0, 0, 0
    node, height, searching = unsigned(node), floor, True
    while searching:
        nodes_visited += 1
        first, size = whole(firsts[node]), whole(sizes[node])
        if size == 0:
            note(log, VISIT_INNER, node, NONE, t, limit)
            near = unsigned(first)
            far = near + ONE
            near_t = enter(volumes, near, ray, strips, limit)
            far_t = enter(volumes, far, ray, strips, limit)
            volume_tests += 2
            note(log, VOLUME_TEST, near, NONE, near_t, near_t)
            note(log, VOLUME_TEST, far, NONE, far_t, far_t)
            if far_t < near_t:
                near, far, near_t, far_t = far, near, far_t, near_t
            # Written in any case, and kept if it counts: whether it does cannot be guessed.
            cells[height], enters[height] = far, far_t
            height += far_t != MISS
            if near_t != MISS:
                node, t = near, near_t
                continue
        else:
            leaves_visited += 1
            note(log, VISIT_LEAF, node, NONE, t, limit)
            best = test_leaf(
                geometry, None, False, first, first + size, ray, number, workspace,
                log, node, t, EVERYWHERE, False, best,
            )  # fmt: skip
            if ray.query == ANY and best.primitive >= 0:
                break
            if ray.query != ALL and best.primitive >= 0:
                limit = best.t
        # Back to the last node put aside that a nearer hit has not made useless.
        searching = False
        while height > floor and not searching:
            height -= 1
            node, t = unsigned(cells[height]), enters[height]
            searching = t <= limit
            if not searching:
                note(log, SKIP, node, NONE, t, limit)

    return best, nodes_visited, leaves_visited, volume_tests


@implements(walk, Binary, inline=True)
def walk_binary(structure, geometry, ray, number, workspace, log):
    """Walk from the root, if the ray enters that."""
    root, volumes, strips = unsigned(structure.root), structure.volumes, workspace.frame
    best, nodes_visited, leaves_visited, volume_tests = NOTHING, 0, 0, 0
    prepare(volumes, ray, strips)
    t = enter(volumes, root, ray, strips, ray.t_max)
    note(log, VOLUME_TEST, root, NONE, t, t)
    if t != MISS:
        best, nodes_visited, leaves_visited, volume_tests = walk_from(
            structure, geometry, ray, number, workspace, log, root, t, 0, best
        )
    counts = nodes_visited, leaves_visited, best.tests, 1 + volume_tests
    return Found(best.t, best.primitive, counts)
