"""The walk of a wide hierarchy, front to back with a stack.

As :mod:`.binary_walk`, with more children: the volumes of all are tested, and those that the ray
hits go onto the stack, the nearest on top.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ....contract.events import NONE, SKIP, VISIT_INNER, VISIT_LEAF, VOLUME_TEST, note
from ....contract.instances import rooted
from ....contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ....contract.walk import Found, walk
from ....contract.workspace import MAXIMUM_DEPTH
from ....geometry.rays import ALL, ANY
from ....geometry.volume import MISS, enter, prepare
from ....kernels import implements, unsigned, whole
from ..topology.wide import WIDEST
from .binary_walk import ONE

WIDE_STACK_SIZE = (WIDEST - 1) * MAXIMUM_DEPTH + WIDEST
"""Nodes that wait: at every level all children but the one that is visited."""


class Wide(NamedTuple):
    """A wide hierarchy as its walk sees it; node 0 is the root, siblings are neighbours.

    Attributes
    ----------
    volumes : NamedTuple of arrays
        The volume of every node; its type says of what kind.
    first : (n_nodes,) int32
        First child of an inner node, first triangle of a leaf.
    size : (n_nodes,) int32
        Triangles of a leaf; 0 marks an inner node.
    width : (n_nodes,) int32
        Children of an inner node; 0 for leaves.
    root : int
        Not 0 in a forest, where the trees of several meshes lie one after the other.
    """

    volumes: Any
    first: np.ndarray
    size: np.ndarray
    width: np.ndarray
    root: int = 0


@implements(rooted, Wide)
def wide_tree_of_forest(forest, root):
    """Exchange the root."""
    return Wide(forest.volumes, forest.first, forest.size, forest.width, root)


@implements(walk, Wide, inline=True)
def walk_wide(structure, geometry, ray, number, workspace, log):
    """Front-to-back traversal with a stack, sorted as far as one node's children go.

    Of children that are entered at the same t, the first comes first.
    """
    volumes, firsts, sizes = structure.volumes, structure.first, structure.size
    cells, enters, strips = workspace.cells, workspace.enters, workspace.frame
    best = NOTHING
    limit = ray.t_max
    nodes_visited, leaves_visited, volume_tests = 0, 0, 1

    prepare(volumes, ray, strips)
    node, height = unsigned(structure.root), 0
    t = enter(volumes, node, ray, strips, limit)
    note(log, VOLUME_TEST, node, NONE, t, t)
    searching = t != MISS
    while searching:
        nodes_visited += 1
        first, size = whole(firsts[node]), whole(sizes[node])
        if size == 0:
            note(log, VISIT_INNER, node, NONE, t, limit)
            volume_tests += structure.width[node]
            child, end = unsigned(first), unsigned(first + structure.width[node])
            near, near_t, bottom = child, MISS, height
            while child < end:
                t = enter(volumes, child, ray, strips, limit)
                note(log, VOLUME_TEST, child, NONE, t, t)
                if t < near_t:
                    # The nearest so far waits now, if there is one, on top of the others.
                    cells[height], enters[height] = near, near_t
                    height += near_t != MISS
                    near, near_t = child, t
                elif t != MISS:
                    place = height
                    while place > bottom and enters[place - 1] <= t:
                        cells[place], enters[place] = cells[place - 1], enters[place - 1]
                        place -= 1
                    cells[place], enters[place] = child, t
                    height += 1
                child += ONE
            if near_t != MISS:
                node, t = near, near_t
                continue
        else:
            leaves_visited += 1
            note(log, VISIT_LEAF, node, NONE, t, limit)
            best = test_leaf(
                geometry, None, False, first, first + size, ray, number, workspace, log, node, t,
                EVERYWHERE, False, best,
            )  # fmt: skip
            if ray.query == ANY and best.primitive >= 0:
                break
            if ray.query != ALL and best.primitive >= 0:
                limit = best.t
        # Back to the nearest node put aside, unless a nearer hit has made it useless.
        searching = False
        while height > 0 and not searching:
            height -= 1
            node, t = unsigned(cells[height]), enters[height]
            searching = t <= limit
            if not searching:
                note(log, SKIP, node, NONE, t, limit)

    counts = nodes_visited, leaves_visited, best.tests, volume_tests
    return Found(best.t, best.primitive, counts)
