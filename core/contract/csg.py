"""A tree of solids is an item like a triangle: its test finds where the ray is inside.

A *leaf* gives the intervals of the line that the ray lies on; a node merges those of its operands
(:mod:`..geometry.csg.intervals`); of what the root has, the first boundary from t_min on is the
hit: from inside, the exit. Operands whose bound the line misses are not asked, nor is what would be
taken away from nothing, or shared with nothing.

The crossings of a closed mesh are found by a walk through a hierarchy of its triangles, the one
walk that there is: what it asks in its leaves notes each crossing and calls it no hit, so that
nothing ends it. Whether a triangle is crossed is decided by its edges, seen along the line, each of
them by the same numbers for both triangles that share it. So between two of them the line passes
through one, and never through both or none: the number of crossings is even.

As with instances, every kernel between the two walks is dispatched on the geometry.

Scratch memory lies behind that of the walk outside: nodes to be looked at and lengths of lists
among its cells, crossings among its enters, behind both the stacks of the walk inside.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..geometry.box import boxes_overlap, span_box
from ..geometry.box_shape import hulls_of_boxes
from ..geometry.csg.intervals import first_crossing, merge, put_in_order
from ..geometry.csg.trees import (
    DIFFERENCE,
    HALF_SPACE,
    INTERSECTION,
    MESH,
    NOTHING,
    SOLID,
    UNION,
    Csg,
    depths_of,
)
from ..geometry.geometry import (
    boxes_around,
    clip_box,
    hulls_of,
    in_order,
    intersect,
    interval,
    overlaps,
)
from ..geometry.rays import line_of
from ..geometry.solids.mixed import Mixed
from ..geometry.triangle import NO_HIT
from ..geometry.volume import prepare, slack_of, span
from ..kernels import dispatched, implements, inlined, inner, whole
from .counters import Counter
from .events import (
    COUNTS,
    LEVEL_NOW,
    NONE,
    SKIP,
    TEST,
    VISIT_INNER,
    VISIT_LEAF,
    VOLUME_TEST,
    WITHIN,
    note,
)
from .instances import rooted
from .walk import walk
from .workspace import STACK_WITHIN, Workspace, part_below

OF_TREE, OF_MESH = 1, 2
"""Levels of the log: of the nodes of a tree, and of the hierarchy of a closed mesh."""

CSG_COUNTERS = (
    Counter(
        "csg_nodes", "CSG nodes", "nodes of CSG trees whose intervals are found",
        (VISIT_INNER, VISIT_LEAF), level=OF_TREE,
    ),
    Counter(
        "csg_tests", "CSG leaf tests", "leaves of CSG trees that are tested", (VISIT_LEAF,),
        column="CSG tests", level=OF_TREE,
    ),
    Counter(
        "csg_volume_tests", "CSG volume tests", "bounds of nodes of CSG trees that are tested",
        (VOLUME_TEST,), level=OF_TREE,
    ),
    Counter(
        "csg_triangle_tests", "CSG triangle tests", "triangles of closed meshes that are tested",
        (TEST,), level=OF_MESH,
    ),
)  # fmt: skip
"""What is counted within trees."""


class Crossings(NamedTuple):
    """Triangles of closed meshes that note where a line crosses them, and are never hit.

    Attributes
    ----------
    corners, ids, reach
        As of triangles.
    found : (2 n,) float64
        t and primitive of each crossing.
    n_found : (1,) int32
        How many crossings `found` holds.
    first : int
        Number of the first primitive of the mesh.
    """

    corners: np.ndarray
    ids: np.ndarray
    reach: np.ndarray
    found: np.ndarray
    n_found: np.ndarray
    first: int


class Leaves(NamedTuple):
    """The leaves of trees as the kernels see them.

    Attributes
    ----------
    solids : Mixed
    half_spaces : (k, 4) float64
    corners : (m, 3, 3) float64
        Triangles of closed meshes, in the order of the references.
    corner_ids : (m,) int32
        The number of each in its mesh.
    forest : NamedTuple of arrays
        The hierarchies of all meshes.
    mesh_roots : (k,) int32
        Of each mesh, in the forest.
    reach : (3,) float64
    """

    solids: Mixed
    half_spaces: np.ndarray
    corners: np.ndarray
    corner_ids: np.ndarray
    forest: Any
    mesh_roots: np.ndarray
    reach: np.ndarray


class CsgTrees(NamedTuple):
    """Trees as the kernels see them, in any order.

    Attributes
    ----------
    ids, reach, boxes
        As of every geometry.
    starts : (n, 2) int32
        START: the node to begin with; IS_TREE: whether the item is more than a plain one.
    nodes : (n_nodes, 6) int32
        KIND, LEFT_NODE, RIGHT_NODE, LEAF, FIRST as of :class:`..geometry.csg.trees.Nodes`, without
        what is pruned; IS_BOUNDED. In one array, for each one makes all kernels slower to compile.
    bounds : NamedTuple of arrays
    leaves : Leaves
    depth, room : int
        Of the deepest tree; and how many crossings one may have, its operands' as well.
    """

    ids: np.ndarray
    reach: np.ndarray
    boxes: np.ndarray
    starts: np.ndarray
    nodes: np.ndarray
    bounds: Any
    leaves: Leaves
    depth: int
    room: int


START, IS_TREE = 0, 1

KIND, LEFT_NODE, RIGHT_NODE, LEAF, FIRST, IS_BOUNDED = range(6)


def trees_of(
    geometry: Csg, forest: Any, mesh_roots: np.ndarray, corners: np.ndarray, ids: np.ndarray
) -> CsgTrees:
    """Return trees as kernels see them, with the hierarchies of their closed meshes."""
    nodes = geometry.pruned
    crossings = np.where(nodes.kind < UNION, 2, 0)
    meshes = np.flatnonzero(nodes.kind == MESH)
    crossings[meshes] = np.diff(geometry.mesh_first)[nodes.leaf[meshes]]
    # Of all leaves of a tree together: trees lie one after the other.
    ends = np.searchsorted(np.sort(geometry.roots), np.arange(len(nodes.kind)), side="right") - 1
    room = 2 * int(np.bincount(ends, weights=crossings).max(initial=0)) + 4
    return CsgTrees(
        geometry.ids, geometry.reach, geometry.boxes,
        np.column_stack([geometry.starts, geometry.is_tree]).astype(np.int32),
        np.column_stack([*nodes, geometry.is_bounded]).astype(np.int32), geometry.bounds,
        Leaves(
            geometry.solids, geometry.half_spaces, corners, ids, forest, mesh_roots, geometry.reach
        ),
        int(depths_of(geometry.nodes).max(initial=0)) + 4, room,
    )  # fmt: skip


def with_scratch(workspace: Workspace, geometry: Any) -> Workspace:
    """Return scratch memory with room for what trees of solids need, if a geometry has any."""
    if not isinstance(geometry, CsgTrees):
        return workspace
    cells = len(workspace.cells) + 2 * geometry.depth + STACK_WITHIN + 1
    return workspace._replace(
        cells=np.empty(cells, np.int32),
        enters=np.empty(len(workspace.enters) + 2 * geometry.room + STACK_WITHIN),
        frame=np.zeros((3 * len(workspace.frame), 6)),
    )


@inner
def is_right_of(ax, ay, bx, by):
    """Say whether an edge crosses the x axis right of the origin.

    One end is at most at the axis, the other above: whichever way the edge is given, the lower one
    is taken first, so that both triangles of an edge say the same.
    """
    if (ay > 0.0) == (by > 0.0):
        return False
    return ax * by - bx * ay > 0.0 if by > 0.0 else bx * ay - ax * by > 0.0


@implements(intersect, Crossings)
def cross_triangle(geometry, index, ray, limit, number, workspace, log):
    """Note where the line crosses a triangle, if it does."""
    corners = geometry.corners
    az = corners[index, 0, ray.kz] - ray.okz
    bz = corners[index, 1, ray.kz] - ray.okz
    cz = corners[index, 2, ray.kz] - ray.okz
    ax = corners[index, 0, ray.kx] - ray.okx - ray.shear_x * az
    ay = corners[index, 0, ray.ky] - ray.oky - ray.shear_y * az
    bx = corners[index, 1, ray.kx] - ray.okx - ray.shear_x * bz
    by = corners[index, 1, ray.ky] - ray.oky - ray.shear_y * bz
    cx = corners[index, 2, ray.kx] - ray.okx - ray.shear_x * cz
    cy = corners[index, 2, ray.ky] - ray.oky - ray.shear_y * cz
    is_inside = is_right_of(ax, ay, bx, by) != is_right_of(bx, by, cx, cy)
    if is_inside == is_right_of(cx, cy, ax, ay):
        return NO_HIT, whole(geometry.ids[index])
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    t = ray.shear_z * ((u * az + v * bz + w * cz) / (u + v + w))
    # Seen edge-on, t is rounding error, and may be no number: it is moved to where the corners are.
    low, high = min(az, min(bz, cz)), max(az, max(bz, cz))
    near, far = ray.shear_z * low, ray.shear_z * high
    near, far = (far, near) if far < near else (near, far)
    t = t if t > near else near
    t = far if far < t else t
    count = geometry.n_found[0]
    geometry.found[2 * count], geometry.found[2 * count + 1] = (
        t, geometry.first + whole(geometry.ids[index])
    )  # fmt: skip
    geometry.n_found[0] = count + 1
    return NO_HIT, whole(geometry.ids[index])


@dispatched
def crossings_of_leaf(leaves, kind, leaf, first, ray, number, workspace, log, stack, base):
    """Put the crossings of a line with a leaf on the stack, and return how many there are."""
    raise TypeError(f"no leaves are {type(leaves).__name__}")


@implements(crossings_of_leaf, Leaves)
def crossings_of_solid(leaves, kind, leaf, first, ray, number, workspace, log, stack, base):
    """Ask a solid, a half-space, or all triangles of a mesh that the line meets."""
    if kind == MESH:
        count = workspace.cells[len(workspace.cells) - STACK_WITHIN - 1 :]
        count[0] = base
        tree = rooted(leaves.forest, whole(leaves.mesh_roots[leaf]))
        triangles = Crossings(leaves.corners, leaves.corner_ids, leaves.reach, stack, count, first)
        log.written[LEVEL_NOW] = OF_MESH
        found = walk(tree, triangles, ray, number, part_below(workspace, 1), log)
        log.written[LEVEL_NOW] = OF_TREE
        log.written[COUNTS + 3] += found.counts[2]
        return put_in_order(stack, base, whole(count[0]) - base)
    if kind == HALF_SPACE:
        plane = leaves.half_spaces[leaf]
        along = plane[0] * ray.dx + plane[1] * ray.dy + plane[2] * ray.dz
        below = plane[3] - (plane[0] * ray.ox + plane[1] * ray.oy + plane[2] * ray.oz)
        if along == 0.0 and below < 0.0:
            return whole(0)
        near = below / along if along < 0.0 else -np.inf
        far = below / along if along > 0.0 else np.inf
    else:
        near, far = interval(leaves.solids, leaf, ray)
        enter, leave = span_box(leaves.solids.boxes, leaf, ray, np.inf)
        near, far = enter if enter > near else near, leave if leave < far else far
    if not near < far:
        return whole(0)
    stack[2 * base], stack[2 * base + 1] = near, first
    stack[2 * base + 2], stack[2 * base + 3] = far, first
    return whole(2)


@dispatched
def crossings_of_tree(geometry, start, ray, number, workspace, log, stack):
    """Put the crossings of a line with a tree on the stack, and return how many there are.

    Parameters
    ----------
    geometry : CsgTrees
    start : int
        The node to begin with.
    ray : Ray
        The whole line: its t_min is -inf.
    stack : (2 room,) float64
    """
    raise TypeError(f"no trees in {type(geometry).__name__}")


@inlined
def meets(nodes, bounds, node, ray, strips, log):
    """Say whether a line meets the bound of a node; what has none is met."""
    if nodes[node, IS_BOUNDED] == 0:
        return True
    enter, leave = span(bounds, node, ray, strips, np.inf)
    note(log, VOLUME_TEST, node, NONE, np.inf if enter > leave else enter, leave)
    return not enter > leave


@inlined
def note_within(log, node, stack, base, count):
    """Note where the line is inside of a node."""
    for i in range(base, base + count, 2):
        note(log, WITHIN, node, whole(stack[2 * i + 1]), stack[2 * i], stack[2 * i + 2])


@implements(crossings_of_tree, CsgTrees)
def merge_tree(geometry, start, ray, number, workspace, log, stack):
    """Go down where bounds are met, and merge on the way back what both operands have.

    There is nothing within a bound that is missed. So a node of which only one operand is met is
    that operand, or is nothing, and does not wait for anything.
    """
    nodes, bounds = geometry.nodes, geometry.bounds
    waiting = workspace.cells
    strips = workspace.frame[len(workspace.frame) // 3 :]
    bottom = len(waiting) - STACK_WITHIN - 1 - 2 * geometry.depth
    height, top = bottom, whole(0)
    visited, tested, volume_tests = 0, 0, whole(nodes[start, IS_BOUNDED])
    prepare(bounds, ray, strips)
    node, searching = whole(start), meets(nodes, bounds, start, ray, strips, log)
    count = whole(0)
    while searching:
        visited += 1
        kind = whole(nodes[node, KIND])
        if kind >= UNION:
            note(log, VISIT_INNER, node, NONE, -np.inf, np.inf)
            left, right = whole(nodes[node, LEFT_NODE]), whole(nodes[node, RIGHT_NODE])
            volume_tests += nodes[left, IS_BOUNDED] + nodes[right, IS_BOUNDED]
            meets_left = meets(nodes, bounds, left, ray, strips, log)
            meets_right = meets(nodes, bounds, right, ray, strips, log)
            if meets_left and meets_right:
                waiting[height], waiting[height + 1] = node, NOTHING
                height += 2
                node = left
                continue
            # Chosen, not branched to: which of two operands is met cannot be guessed.
            node, is_one = left if meets_left else right, meets_left or meets_right
            if (is_one and kind == UNION) or (meets_left and kind == DIFFERENCE):
                continue
            if is_one:
                note(log, SKIP, node, NONE, -np.inf, np.inf)
            count = whole(0)
        else:
            note(log, VISIT_LEAF, node, NONE, -np.inf, np.inf)
            tested += 1
            count = crossings_of_leaf(
                geometry.leaves, kind, whole(nodes[node, LEAF]), whole(nodes[node, FIRST]),
                ray, number, workspace, log, stack, top,
            )  # fmt: skip
            note_within(log, node, stack, top, count)
        # Back to the last node whose right operand is still to be asked.
        searching = False
        while height > bottom and not searching:
            above, n_left = whole(waiting[height - 2]), whole(waiting[height - 1])
            kind = whole(nodes[above, KIND])
            if n_left == NOTHING and (count > 0 or kind == UNION):
                waiting[height - 1] = count
                top += count
                node, searching = whole(nodes[above, RIGHT_NODE]), True
                continue
            height -= 2
            if n_left == NOTHING:
                # Nothing can be taken away from nothing, nor be shared with it.
                note(log, SKIP, nodes[above, RIGHT_NODE], NONE, -np.inf, np.inf)
                continue
            top -= n_left
            # With nothing on one side there is nothing to merge.
            if count == 0:
                count = whole(0) if kind == INTERSECTION else n_left
            elif n_left > 0:
                count = merge(kind, stack, top, n_left, count)
            note_within(log, above, stack, top, count)
    log.written[COUNTS] += visited
    log.written[COUNTS + 1] += tested
    log.written[COUNTS + 2] += volume_tests
    return count


@implements(intersect, CsgTrees)
def intersect_tree(geometry, index, ray, limit, number, workspace, log):
    """Find where the ray's line is inside of the tree, and take the first boundary from t_min on.

    It is moved into the interval of the item's own box, as that of a triangle is into its.
    """
    start = whole(geometry.starts[index, START])
    if start == NOTHING:
        return NO_HIT, whole(0)
    if geometry.starts[index, IS_TREE] == 0:
        leaf = whole(geometry.nodes[start, LEAF])
        t, _ = intersect(geometry.leaves.solids, leaf, ray, limit, number, workspace, log)
        return t, whole(geometry.nodes[start, FIRST])
    enter, leave = span_box(geometry.boxes, index, ray, np.inf)
    if enter > leave or enter > limit:
        return NO_HIT, whole(0)
    line = line_of(ray)
    last = len(workspace.enters) - STACK_WITHIN
    stack = workspace.enters[last - 2 * geometry.room : last]
    level = log.written[LEVEL_NOW]
    log.written[LEVEL_NOW] = OF_TREE
    count = crossings_of_tree(geometry, start, line, number, workspace, log, stack)
    log.written[LEVEL_NOW] = level
    thin = slack_of(ray) * abs(ray.shear_z)
    t, primitive = first_crossing(stack, 0, count, ray.t_min, thin)
    if t == NO_HIT:
        return NO_HIT, whole(0)
    t = enter if enter > t else t
    return leave if leave < t else t, primitive


@implements(overlaps, CsgTrees)
def overlaps_tree(geometry, index, box):
    """Compare boxes."""
    return boxes_overlap(geometry.boxes[index], box)


@implements(clip_box, CsgTrees)
def clip_tree(geometry, index, cell, box, polygon):
    """Leave the box as it is: nothing more is known of what is in it."""


@boxes_around.register
def _(geometry: CsgTrees) -> np.ndarray:
    return geometry.boxes.copy()


@hulls_of.register
def _(geometry: CsgTrees) -> tuple[np.ndarray, np.ndarray]:
    return hulls_of_boxes(geometry.boxes)


@in_order.register
def _(geometry: CsgTrees, order: np.ndarray) -> CsgTrees:
    return geometry._replace(
        ids=geometry.ids[order].astype(np.int32), boxes=geometry.boxes[order],
        starts=geometry.starts[order],
    )  # fmt: skip


__all__ = ["CSG_COUNTERS", "SOLID", "Crossings", "CsgTrees", "trees_of", "with_scratch"]
