"""The walk of a binary hierarchy, front to back with a stack.

Of two children the nearer is entered first, the other waits on a stack and is thrown away if a hit
nearer than its volume has been found meanwhile. What kind of volumes they are is not its affair.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ....contract.steps import HIT, NONE, SKIP, TEST, VISIT_INNER, VISIT_LEAF, VOLUME_TEST, note
from ....contract.structure import Found, walk
from ....geometry.rays import ALL, ANY
from ....geometry.triangle import intersect
from ....geometry.volume import MISS, enter, prepare
from ....kernels import implements, inlined


class Binary(NamedTuple):
    """A binary hierarchy as its walk sees it; node 0 is the root, siblings are neighbours.

    Attributes
    ----------
    volumes : NamedTuple of arrays
        The volume of every node; its type says of what kind.
    first : (n_nodes,) int32
        Left child of an inner node (the right one is the next), first triangle of a leaf.
    size : (n_nodes,) int32
        Triangles of a leaf; 0 marks an inner node.
    """

    volumes: Any
    first: np.ndarray
    size: np.ndarray


class VolumeWorkspace(NamedTuple):
    """Scratch memory of one thread.

    Attributes
    ----------
    cells : (k,) int32
    enters : (k,) float64
        The stack: nodes still to visit and where the ray enters them.
    strips : (MOST_STRIPS, 3) float64
        What of the ray is the same for all volumes.
    """

    cells: np.ndarray
    enters: np.ndarray
    strips: np.ndarray


@inlined
def test_leaf(triangles, first, size, node, ray, log, best_t, best):
    """Test the triangles of a leaf; return the nearest hit so far."""
    for i in range(first, first + size):
        hit_t = intersect(triangles, i, ray)
        n = np.int64(triangles.ids[i])
        note(log, TEST, node, n, hit_t, hit_t)
        if hit_t <= ray.t_max and (hit_t < best_t or (hit_t == best_t and n < best)):
            best_t, best = hit_t, n
            note(log, HIT, node, n, hit_t, hit_t)
    return best_t, best


ROOT, ONE = np.uint64(0), np.uint64(1)


@implements(walk, Binary)
def walk_binary(structure, triangles, ray, number, workspace, log):
    """Front-to-back traversal with a stack.

    Node numbers are unsigned: Numba then leaves out the look at negative indices, 5% of the time.
    """
    volumes, firsts, sizes = structure.volumes, structure.first, structure.size
    cells, enters, strips = workspace.cells, workspace.enters, workspace.strips
    best_t, best = np.inf, NONE
    limit = ray.t_max
    nodes_visited, leaves_visited, tests, volume_tests = 0, 0, 0, 1

    prepare(volumes, ray, strips)
    node, height = ROOT, 0
    t = enter(volumes, node, ray, strips, limit)
    note(log, VOLUME_TEST, node, NONE, t, t)
    searching = t != MISS
    while searching:
        nodes_visited += 1
        size = sizes[node]
        if size == 0:
            note(log, VISIT_INNER, node, NONE, t, limit)
            near = np.uint64(firsts[node])
            far = near + ONE
            near_t = enter(volumes, near, ray, strips, limit)
            far_t = enter(volumes, far, ray, strips, limit)
            volume_tests += 2
            note(log, VOLUME_TEST, near, NONE, near_t, near_t)
            note(log, VOLUME_TEST, far, NONE, far_t, far_t)
            if far_t < near_t:
                near, far, near_t, far_t = far, near, far_t, near_t
            if far_t != MISS:
                cells[height], enters[height] = far, far_t
                height += 1
            if near_t != MISS:
                node, t = near, near_t
                continue
        else:
            leaves_visited += 1
            note(log, VISIT_LEAF, node, NONE, t, limit)
            tests += size
            best_t, best = test_leaf(triangles, firsts[node], size, node, ray, log, best_t, best)
            if ray.query == ANY and best >= 0:
                break
            if ray.query != ALL and best >= 0:
                limit = best_t
        # Back to the last node put aside that a nearer hit has not made useless.
        searching = False
        while height > 0 and not searching:
            height -= 1
            node, t = np.uint64(cells[height]), enters[height]
            searching = t <= limit
            if not searching:
                note(log, SKIP, node, NONE, t, limit)

    return Found(best_t, best, nodes_visited, leaves_visited, 0, tests, volume_tests, 0, 0, 0)
