"""How a BSP tree is stored, seen by walks, and marched through.

A node has the four numbers of its plane and a link to its children. Any plane is met by the same
arithmetic, axis-parallel or not: with f(t) = n (o + t d) - c, the height of the ray above a plane,

    early = (-|f(0)| - band) / |n d|        late = (-|f(0)| + band) / |n d|

if the ray comes nearer, the ray is within `band` of the plane between the two. The band is the
shell in which the builder took triangles to be on the plane (:mod:`.references`), and what rounding
may add: of the hit, which is off its triangle by some units in the last place of the coordinates
(:mod:`...geometry.triangle`), and of f. So at its hit a ray is, for every plane, on a side that got
the triangle there, or in the band, where both sides are visited: no hit is lost.

A ray parallel to a plane has infinite early and late t: of equal sign, and it is on one side; of
different sign (or NaN) in the band, and it is on both. See :mod:`..subdivision.tree`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...contract.events import NONE, VISIT_INNER, VOLUME_TEST, note
from ...contract.missing import all_made
from ...contract.walk import walk
from ...kernels import implements, inner, whole
from ..subdivision.tree import (
    ROOT,
    enter_root,
    expand,
    far_part,
    leaf_index,
    meets_far,
    meets_near,
    near_part,
    push,
)
from ..subdivision.walks import LOST, NOWHERE_YET, Recursive, found, limit_of, visit_leaf

SLACKS = 2.0
"""Rounding that the band holds, in differences of a ray's two slacked origins: 32 ulps."""


class BspArrays(NamedTuple):
    """The tree as its walks see it; node 0 is the root.

    Attributes
    ----------
    box : (6,) float64
        The root's cell.
    planes : (n_nodes, 4) float64
        Unit normal and position along it; zeros for leaves.
    link : (n_nodes,) int32
        Left child, below the plane (the right one is next), or ``-1 - leaf``.
    shell : float
        Distance from a plane within which a point counts as on it.
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32
        Triangles, ascending within a leaf.
    """

    box: np.ndarray
    planes: np.ndarray
    link: np.ndarray
    shell: float
    offsets: np.ndarray
    references: np.ndarray


all_made(BspArrays)


@implements(leaf_index, BspArrays)
def bsp_leaf_index(tree, node):
    """Look at the sign."""
    return -1 - tree.link[node]


@inner
def meet_plane(tree, node, frame):
    """Return early and late t of a ray at a node's plane, and the side it comes from (0 below)."""
    plane = tree.planes[node]
    rate, height, band = 0.0, -plane[3], tree.shell
    for axis in range(3):
        rate += plane[axis] * frame[axis, 4]
        height += plane[axis] * frame[axis, 3]
        band += SLACKS * abs(plane[axis] * (frame[axis, 0] - frame[axis, 1]))
    side = 0
    if rate < 0.0:
        rate, height, side = -rate, -height, 1
    # Of +0.0 and -0.0 alike the inverse is +inf.
    inverse = 1.0 / rate if rate > 0.0 else np.inf
    return (-height - band) * inverse, (-height + band) * inverse, side


@implements(expand, BspArrays)
def bsp_expand(tree, node, workspace, span, height):
    """Near child only, far child only, or the near one now and the far one later."""
    early, late, side = meet_plane(tree, node, workspace.frame)
    left = whole(tree.link[node])
    near, far = left + side, left + 1 - side
    if not meets_far(span, early):
        return near, near_part(span, early, late), height
    if not meets_near(span, late):
        return far, far_part(span, early), height
    push(workspace, height, far, far_part(span, early))
    return near, near_part(span, early, late), height + 1


# ------------------------------------------------------------------------------------ marching


class BspMarch(NamedTuple):
    """A BSP tree to be walked from the root for every leaf."""

    tree: Any
    mailbox: bool


class Passage(NamedTuple):
    """A plane through which a ray goes on into the next cell.

    Attributes
    ----------
    t, late : float
        Its early and late t.
    node : int
        Whose plane it is; -1 for the root's faces.
    is_clear : bool
        False if the ray meets other planes of the path at nearly the same t.
    """

    t: float
    late: float
    node: np.int64
    is_clear: bool


@inner
def find_leaf(tree, frame, log, entry, leave):
    """Return the leaf in which a ray is right after `entry`, its passage out, and its depth.

    On the way down from the root the planes still ahead are remembered: the ray leaves by the first
    of these. They need not be faces of the leaf, as long as they are met later than its faces.

    Parameters
    ----------
    entry : Passage
    leave : Span
        With the early and late t of leaving the root.
    """
    node, depth = ROOT, 0
    exit_t, exit_late, exit_node, second = leave.exit, leave.late, whole(-1), np.inf
    is_clear = entry.is_clear
    while leaf_index(tree, node) < 0:
        note(log, VISIT_INNER, node, NONE, entry.t, leave.exit)
        early, late, side = meet_plane(tree, node, frame)
        if early <= entry.t:
            # Behind: the ray must have come clearly before, unless this is the entry itself.
            is_clear = is_clear and (late < entry.t or node == entry.node)
            side = 1 - side
        else:
            # Ahead: clearly after the entry, and clearly one before the others.
            is_clear = is_clear and early > entry.late
            if early < exit_t:
                exit_t, exit_late, exit_node, second = early, late, node, exit_t
            elif early < second:
                second = early
        node = whole(tree.link[node]) + side
        depth += 1
    is_clear = is_clear and second > exit_late and exit_t > entry.late
    return node, Passage(exit_t, exit_late, exit_node, is_clear), depth


@implements(walk, BspMarch, inline=True)
def walk_march(structure, geometry, ray, number, workspace, log):
    """Find every leaf from the root."""
    tree = structure.tree
    written = log.written[0]
    root, enter_late, _ = enter_root(tree.box, ray, workspace.frame)
    note(log, VOLUME_TEST, NONE, NONE, root.enter, root.enter)
    visited, inner_nodes = NOWHERE_YET, 0
    entry = Passage(root.enter, enter_late, whole(-1), True)
    searching = root.enter < np.inf
    n_leaves = len(tree.offsets) - 1
    while searching:
        # A ray enters every leaf once.
        if visited.leaves == n_leaves:
            return LOST
        node, passage, depth = find_leaf(tree, workspace.frame, log, entry, root)
        if not passage.is_clear:
            # The mailbox must not know what this walk has tested.
            log.written[0] = written
            again = Recursive(tree, structure.mailbox)
            return walk(again, geometry, ray, -2 - number, workspace, log)
        inner_nodes += depth
        visited = visit_leaf(
            tree, structure.mailbox, geometry, ray, number, workspace, log,
            node, leaf_index(tree, node), entry.t, passage.t, visited,
        )  # fmt: skip
        entry = passage
        searching = entry.node >= 0 and entry.t <= limit_of(tree, ray, visited)
    return found(visited, inner_nodes)
