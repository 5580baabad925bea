"""The walk of a ray: look up its class, and walk through the subtrees of its starts.

The starts are in the order in which they begin along the main axis of the class. Those that may be
entered next are tested, and those that the ray does enter wait on the stack, the nearest on top. So
subtrees are entered in the same order as from the root, front to back, and no start is tested that
begins behind the hit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.events import NONE, SKIP, VOLUME_TEST, note
from ...contract.leaf import NOTHING
from ...contract.walk import Found, missing, walk
from ...geometry.box import span_box
from ...geometry.rays import ALL, ANY, make_probe
from ...geometry.volume import MISS, enter, prepare
from ...kernels import implements, inlined, kernel, whole
from ..bvh import BVH
from ..bvh.walks.binary_walk import Binary, walk_from
from ..ray_classification.ray_space import component, is_known
from .classes import Classes, class_of

UNMADE, FROM_ROOT = -1, 0
"""As row of a class: its array is not made; and the row of rays that begin at the root."""

MISSED = missing(BVH.COUNTERS)


class ShaftArrays(NamedTuple):
    """Shafts as the walk sees them.

    Attributes
    ----------
    tree : Binary
    boxes : (n_nodes, 6) float64
        Around the volumes of the tree.
    classes : Classes
    slack : float
        How far off a ray may be of its own line, as its class knows it.
    rows : (n_classes,) int32
        The row of each class in `starts`; UNMADE before a ray has come.
    starts : (n_rows, max_starts) int32
        Nodes, those first that begin first along the axis of the class; NONE behind the last. Row
        FROM_ROOT has the root alone.
    wanted : (n_classes,) uint8
    look_ahead : int
        See :class:`...contract.lazy.LazyStructure`.
    """

    tree: Binary
    boxes: np.ndarray
    classes: Classes
    slack: float
    rows: np.ndarray
    starts: np.ndarray
    wanted: np.ndarray
    look_ahead: int


@inlined
def begins_inside(box, ray):
    """Say whether a ray is in a box, (1, 6), where it begins."""
    x, y, z = ray.ox + ray.t_min * ray.dx, ray.oy + ray.t_min * ray.dy, ray.oz + ray.t_min * ray.dz
    return (
        box[0, 0] <= x <= box[0, 3] and box[0, 1] <= y <= box[0, 4] and box[0, 2] <= z <= box[0, 5]
    )


@implements(walk, ShaftArrays, inline=True)
def walk_shafts(structure, geometry, ray, number, workspace, log):
    """Walk the subtrees of the starts of a ray's class, until the next begins behind its hit."""
    classes, tree, starts = structure.classes, structure.tree, structure.starts
    best = NOTHING
    nodes_visited, leaves_visited, volume_tests = 0, 0, 0
    # Of a ray from far away it is not certain either where it is along an axis.
    row, slack = whole(FROM_ROOT), np.inf
    if is_known(structure, ray):
        begin, leave = ray.t_min, ray.t_max
        is_outside = not begins_inside(classes.box, ray)
        if is_outside:
            begin, leave = span_box(classes.box, 0, ray, ray.t_max)
            if begin > leave:
                note(log, VOLUME_TEST, NONE, NONE, np.inf, np.inf)
                return Found(best.t, best.primitive, (0, 0, 0, 1))
        own = class_of(classes, ray, begin)
        row, slack = whole(structure.rows[own]), structure.slack
        if row == UNMADE:
            structure.wanted[own] = 1
            return Found(MISSED.t, MISSED.primitive, MISSED.counts)
        # The root's own test, which follows, is the same one.
        if is_outside and starts[row, 0] != tree.root:
            note(log, VOLUME_TEST, NONE, NONE, begin, begin)
            volume_tests = 1
    a = whole(ray.kz)
    along, origin = component(a, ray.dx, ray.dy, ray.dz), component(a, ray.ox, ray.oy, ray.oz)
    side, sign = (a, 1.0) if along >= 0.0 else (a + 3, -1.0)
    along, origin = sign * along, sign * origin
    volumes, strips = tree.volumes, workspace.frame
    prepare(volumes, ray, strips)
    # On the stack, the nearest on top: starts that the ray enters.
    cells, enters = workspace.cells, workspace.enters
    slot, height, searching = 0, 0, True
    while searching:
        limit = best.t if best.primitive >= 0 and ray.query != ALL else ray.t_max
        while slot < starts.shape[1] and starts[row, slot] != NONE:
            node = whole(starts[row, slot])
            # None that follows is entered before this t.
            end = enters[height - 1] if height > 0 else limit
            nearest = structure.boxes[node, side] * sign
            if nearest > origin + end * along + slack:
                break
            t = enter(volumes, node, ray, strips, limit)
            note(log, VOLUME_TEST, node, NONE, t, t)
            volume_tests += 1
            slot += 1
            if t != MISS:
                place = height
                while place > 0 and enters[place - 1] <= t:
                    cells[place], enters[place] = cells[place - 1], enters[place - 1]
                    place -= 1
                cells[place], enters[place] = node, t
                height += 1
        if height == 0:
            break
        height -= 1
        node, t = whole(cells[height]), enters[height]
        if t > limit:
            note(log, SKIP, node, NONE, t, limit)
            break
        best, nodes, leaves, tests = walk_from(
            tree, geometry, ray, number, workspace, log, node, t, height, best
        )
        nodes_visited += nodes
        leaves_visited += leaves
        volume_tests += tests
        searching = ray.query != ANY or best.primitive < 0
    counts = nodes_visited, leaves_visited, best.tests, volume_tests
    return Found(best.t, best.primitive, counts)


@kernel
def find_classes(structure, reach, rays, numbers):
    """Write the class of every ray; NONE for those that miss the box, or begin at the root."""
    box = structure.classes.box
    for i in range(len(numbers)):
        ray = make_probe(rays, i, reach)
        begin, leave = ray.t_min, ray.t_max
        if not begins_inside(box, ray):
            begin, leave = span_box(box, 0, ray, ray.t_max)
        is_there = is_known(structure, ray) and begin <= leave
        numbers[i] = class_of(structure.classes, ray, begin) if is_there else NONE
