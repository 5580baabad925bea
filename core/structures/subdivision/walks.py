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

from ...geometry.rays import ALL, ANY
from ...geometry.triangle import intersect
from ...kernels import implements, inlined, inner
from ..contract import Found, walk
from ..steps import (
    HIT,
    MAILBOX,
    POSTPONE,
    SKIP,
    TEST,
    VISIT_EMPTY,
    VISIT_INNER,
    VISIT_LEAF,
    VOLUME_TEST,
    note,
)
from .tree import (
    ROOT,
    SEGMENTS,
    Span,
    child,
    enter_root,
    expand,
    leaf_index,
    near_side,
    plane_times,
    planes,
    pop,
    push,
    set_frame,
)

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


# ----------------------------------------------------------------------------------- in a leaf


class Best(NamedTuple):
    """The nearest hit so far, and what it took: tests and mailbox hits."""

    t: float
    primitive: int
    tests: int
    saved: int
    empty: int


@inner
def visit_leaf(structure, triangles, ray, number, workspace, log, node, index, enter, leave, best):
    """Test the triangles of a leaf; return the new :class:`Best`."""
    tree = structure.tree
    begin, end = tree.offsets[index], tree.offsets[index + 1]
    best_t, primitive, tests, saved, empty = (
        best.t,
        best.primitive,
        best.tests,
        best.saved,
        best.empty,
    )
    if begin == end:
        empty += 1
        note(log, VISIT_EMPTY, node, -1, enter, leave)
    else:
        note(log, VISIT_LEAF, node, -1, enter, leave)
    for slot in range(begin, end):
        n = tree.references[slot]
        if structure.mailbox:
            if workspace.mailbox[n] == number:
                saved += 1
                note(log, MAILBOX, node, n, enter, leave)
                continue
            workspace.mailbox[n] = number
        t = intersect(triangles, n, ray)
        tests += 1
        note(log, TEST, node, n, t, t)
        if t <= ray.t_max and (t < best_t or (t == best_t and n < primitive)):
            best_t, primitive = t, n
            note(log, HIT if t < leave else POSTPONE, node, n, t, t)
    return Best(best_t, primitive, tests, saved, empty)


@inlined
def limit_of(ray, best):
    """Return the t up to which cells are visited: later ones cannot change the answer."""
    if ray.query == ANY and best.primitive >= 0:
        return -1.0
    return best.t if ray.query != ALL and best.t < ray.t_max else ray.t_max


# -------------------------------------------------------------------------------- depth-first


@inner
def depth_first(structure, triangles, ray, number, workspace, log):
    """Go on with the first child, put the others on a stack."""
    tree = structure.tree
    set_frame(workspace, ray)
    span, _, _ = enter_root(tree.box, workspace.frame, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, span.enter, span.enter)
    best = Best(np.inf, -1, 0, 0, 0)
    inner, leaves = 0, 0
    limit = ray.t_max
    node, height = ROOT, ROOT
    searching = span.enter < np.inf
    while searching:
        index = leaf_index(tree, node)
        if index < 0:
            inner += 1
            note(log, VISIT_INNER, node, -1, span.enter, span.exit)
            node, span, height = expand(tree, node, workspace, span, height)
            continue
        leaves += 1
        best = visit_leaf(
            structure, triangles, ray, number, workspace, log,
            node, index, span.enter, max(span.enter, span.exit), best,
        )  # fmt: skip
        limit = limit_of(ray, best)
        # Back to the first node put aside that is not behind the nearest hit.
        searching = False
        while height > 0 and not searching:
            height -= 1
            node, span = pop(workspace, height)
            searching = span.enter <= limit
            if not searching:
                note(log, SKIP, node, -1, span.enter, span.exit)
    return Found(
        best.t, best.primitive, inner + leaves, leaves, best.empty, best.tests, 1, best.saved, 0
    )


@implements(walk, Recursive)
def walk_recursive(structure, triangles, ray, number, workspace, log):
    """Walk depth-first."""
    return depth_first(structure, triangles, ray, number, workspace, log)


@implements(walk, Segments)
def walk_segments(structure, triangles, ray, number, workspace, log):
    """Cut the ray into segments, then process these one by one.

    A ray with more than SEGMENTS segments is cut piece by piece.
    """
    tree = structure.tree
    set_frame(workspace, ray)
    span, _, _ = enter_root(tree.box, workspace.frame, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, span.enter, span.enter)
    best = Best(np.inf, -1, 0, 0, 0)
    inner, leaves = 0, 0
    limit = ray.t_max
    node, height = ROOT, ROOT
    searching = span.enter < np.inf
    while searching:
        # Preprocessing: the tree is left with a list of segments.
        count = 0
        while searching and count < SEGMENTS:
            if leaf_index(tree, node) < 0:
                inner += 1
                note(log, VISIT_INNER, node, -1, span.enter, span.exit)
                node, span, height = expand(tree, node, workspace, span, height)
                continue
            workspace.segment_nodes[count] = node
            workspace.segment_enters[count] = span.enter
            workspace.segment_exits[count] = max(span.enter, span.exit)
            count += 1
            searching = False
            while height > 0 and not searching:
                height -= 1
                node, span = pop(workspace, height)
                searching = span.enter <= limit
                if not searching:
                    note(log, SKIP, node, -1, span.enter, span.exit)
        # Processing: the list is all that is needed now.
        for i in range(count):
            enter = workspace.segment_enters[i]
            leaf = np.int64(workspace.segment_nodes[i])
            if enter > limit:
                note(log, SKIP, leaf, -1, enter, workspace.segment_exits[i])
                continue
            leaves += 1
            best = visit_leaf(
                structure, triangles, ray, number, workspace, log,
                leaf, leaf_index(tree, leaf), enter, workspace.segment_exits[i], best,
            )  # fmt: skip
            limit = limit_of(ray, best)
        searching = searching and span.enter <= limit
    return Found(
        best.t, best.primitive, inner + leaves, leaves, best.empty, best.tests, 1, best.saved, 0
    )


# ---------------------------------------------------------------------------- priority queue


@inlined
def before(workspace, a, b):
    """Say whether the heap's entry a comes before entry b: by key, the younger one of equals."""
    key_a, key_b = workspace.keys[a], workspace.keys[b]
    return key_a < key_b or (key_a == key_b and workspace.ages[a] > workspace.ages[b])


@inner
def heap_put(workspace, size, place):
    """Add a place of the stack to the heap of `size` entries."""
    heap = workspace.heap
    i = size
    while i > 0 and before(workspace, place, heap[(i - 1) // 2]):
        heap[i] = heap[(i - 1) // 2]
        i = (i - 1) // 2
    heap[i] = place


@inner
def heap_take(workspace, size):
    """Remove and return the first entry of a heap of `size` entries."""
    heap = workspace.heap
    first, last = heap[0], heap[size - 1]
    i = 0
    while True:
        c = 2 * i + 1
        if c >= size - 1:
            break
        if c + 1 < size - 1 and before(workspace, heap[c + 1], heap[c]):
            c += 1
        if not before(workspace, heap[c], last):
            break
        heap[i] = heap[c]
        i = c
    heap[i] = last
    return first


@implements(walk, Heap)
def walk_heap(structure, triangles, ray, number, workspace, log):
    """Visit the most promising cell next: the one entered first.

    Where planes are met at nearly the same t, the early t of entries do not tell the order of
    cells. So an entry is queued by its t limited to that of its next sibling along the ray, its
    `ceiling`, which holds for all its descendants too; of equals the younger one comes first.
    """
    tree = structure.tree
    set_frame(workspace, ray)
    span, _, _ = enter_root(tree.box, workspace.frame, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, span.enter, span.enter)
    best = Best(np.inf, -1, 0, 0, 0)
    inner, leaves, size, used, unused, age = 0, 0, 0, 0, 0, 0
    limit = ray.t_max
    if span.enter < np.inf:
        workspace.heap_nodes[0] = 0
        workspace.spans[0, 0], workspace.spans[0, 1] = span.enter, span.exit
        workspace.spans[0, 2] = span.late
        workspace.keys[0], workspace.ceilings[0], workspace.ages[0] = span.enter, np.inf, 0
        heap_put(workspace, 0, 0)
        size, used = 1, 1
    while size > 0:
        place = heap_take(workspace, size)
        size -= 1
        workspace.free[unused] = place
        unused += 1
        node = np.int64(workspace.heap_nodes[place])
        span = Span(workspace.spans[place, 0], workspace.spans[place, 1], workspace.spans[place, 2])
        if span.enter > limit:
            note(log, SKIP, node, -1, span.enter, span.exit)
            continue
        index = leaf_index(tree, node)
        if index >= 0:
            leaves += 1
            best = visit_leaf(
                structure, triangles, ray, number, workspace, log,
                node, index, span.enter, max(span.enter, span.exit), best,
            )  # fmt: skip
            limit = limit_of(ray, best)
            continue
        inner += 1
        note(log, VISIT_INNER, node, -1, span.enter, span.exit)
        floor, ceiling = workspace.keys[place], workspace.ceilings[place]
        node, span, height = expand(tree, node, workspace, span, 0)
        push(workspace, height, node, span)
        # From the last child along the ray to the first.
        for i in range(height + 1):
            if unused > 0:
                unused -= 1
                place = workspace.free[unused]
            else:
                place = used
                used += 1
            age += 1
            workspace.heap_nodes[place] = workspace.nodes[i]
            workspace.spans[place, 0] = workspace.enters[i]
            workspace.spans[place, 1] = workspace.exits[i]
            workspace.spans[place, 2] = workspace.lates[i]
            workspace.ages[place] = age
            workspace.ceilings[place] = ceiling
            key = min(max(workspace.enters[i], floor), ceiling)
            workspace.keys[place] = key
            heap_put(workspace, size, place)
            size += 1
            ceiling = key
    return Found(
        best.t, best.primitive, inner + leaves, leaves, best.empty, best.tests, 1, best.saved, 0
    )


# ------------------------------------------------------------------------------------ marching


class Gate(NamedTuple):
    """A plane through which a ray goes on: its early and late t, its axis (-1: there is none).

    `clear` is False if the ray meets other planes of the cell at nearly the same t.
    """

    t: float
    late: float
    axis: int
    plane: float
    clear: bool


@inner
def find_gate(boxes, row, frame, entry):
    """Return the gate through which a ray leaves a cell that it has entered through `entry`."""
    leave, leave_late, leave_axis, leave_plane = np.inf, np.inf, -1, 0.0
    second = np.inf
    clear = entry.clear
    for axis in range(3):
        near = near_side(frame, axis)
        # Behind: the ray must have come clearly before, unless this is the entry itself.
        plane = boxes[row, 3 * near + axis]
        early, late = plane_times(frame, axis, plane)
        if not (late < entry.t) and not (axis == entry.axis and plane == entry.plane):
            clear = False
        # Ahead: clearly after the entry, and clearly one before the others.
        plane = boxes[row, 3 * (1 - near) + axis]
        early, late = plane_times(frame, axis, plane)
        if not (early > entry.late):
            clear = False
        if early < leave:
            second = leave
            leave, leave_late, leave_axis, leave_plane = early, late, axis, plane
        elif early < second:
            second = early
    if not (second > leave_late):
        clear = False
    return Gate(leave, leave_late, leave_axis, leave_plane, clear)


@inner
def step_down(tree, node, workspace, depth, t):
    """Return the child of an inner node in which the ray is right after t.

    The path and the boxes along it are kept in the workspace: `node` at `depth`, its child below.
    """
    frame, boxes = workspace.frame, workspace.boxes
    split = planes(tree, node)
    side = 0
    for i in range(6):
        boxes[depth + 1, i] = boxes[depth, i]
    for axis in range(3):
        plane = split[axis]
        early, _ = plane_times(frame, axis, plane)
        upper = near_side(frame, axis)
        if early <= t:
            upper = 1 - upper
        side += upper << axis
        if plane == plane:
            boxes[depth + 1, axis if upper == 1 else 3 + axis] = plane
    workspace.path[depth] = node
    return child(tree, node, side)


@inlined
def begin_march(tree, workspace, ray):
    """Prepare the workspace; return the ray's gate into the root, t = inf for a miss."""
    set_frame(workspace, ray)
    span, late, axis = enter_root(tree.box, workspace.frame, ray.t_max)
    for i in range(6):
        workspace.boxes[0, i] = tree.box[i]
    plane = 0.0
    if axis >= 0:
        plane = tree.box[3 * near_side(workspace.frame, axis) + axis]
    return Gate(span.enter, late, axis, plane, True), span.exit


@implements(walk, March)
def walk_march(structure, triangles, ray, number, workspace, log):
    """Find every leaf from the root."""
    tree = structure.tree
    written = log.written[0]
    gate, leave_root = begin_march(tree, workspace, ray)
    note(log, VOLUME_TEST, -1, -1, gate.t, gate.t)
    best = Best(np.inf, -1, 0, 0, 0)
    inner, leaves = 0, 0
    searching = gate.t < np.inf
    while searching:
        node, depth = ROOT, ROOT
        index = leaf_index(tree, node)
        while index < 0:
            inner += 1
            note(log, VISIT_INNER, node, -1, gate.t, leave_root)
            node = step_down(tree, node, workspace, depth, gate.t)
            depth += 1
            index = leaf_index(tree, node)
        exit_gate = find_gate(workspace.boxes, depth, workspace.frame, gate)
        if not exit_gate.clear:
            log.written[0] = written
            return depth_first(structure, triangles, ray, -2 - number, workspace, log)
        leaves += 1
        best = visit_leaf(
            structure, triangles, ray, number, workspace, log,
            node, index, gate.t, exit_gate.t, best,
        )  # fmt: skip
        gate = exit_gate
        searching = gate.t < leave_root and gate.t <= limit_of(ray, best)
    return Found(
        best.t, best.primitive, inner + leaves, leaves, best.empty, best.tests, 1, best.saved, 0
    )


@implements(walk, Neighbours)
def walk_neighbours(structure, triangles, ray, number, workspace, log):
    """From a leaf go up until the exit is a plane inside the node, then down on its other side."""
    tree = structure.tree
    written = log.written[0]
    gate, leave_root = begin_march(tree, workspace, ray)
    note(log, VOLUME_TEST, -1, -1, gate.t, gate.t)
    best = Best(np.inf, -1, 0, 0, 0)
    inner, leaves = 0, 0
    node, depth = ROOT, ROOT
    searching = gate.t < np.inf
    while searching:
        index = leaf_index(tree, node)
        while index < 0:
            inner += 1
            note(log, VISIT_INNER, node, -1, gate.t, leave_root)
            node = step_down(tree, node, workspace, depth, gate.t)
            depth += 1
            index = leaf_index(tree, node)
        exit_gate = find_gate(workspace.boxes, depth, workspace.frame, gate)
        if not exit_gate.clear:
            log.written[0] = written
            return depth_first(structure, triangles, ray, -2 - number, workspace, log)
        leaves += 1
        best = visit_leaf(
            structure, triangles, ray, number, workspace, log,
            node, index, gate.t, exit_gate.t, best,
        )  # fmt: skip
        gate = exit_gate
        searching = gate.t < leave_root and gate.t <= limit_of(ray, best)
        # Up to the nearest common ancestor: the node that this face's plane splits.
        common = False
        while searching and not common:
            depth -= 1
            node = np.int64(workspace.path[depth])
            common = planes(tree, node)[gate.axis] == gate.plane
            if not common:
                inner += 1
                note(log, VISIT_INNER, node, -1, gate.t, gate.t)
    return Found(
        best.t, best.primitive, inner + leaves, leaves, best.empty, best.tests, 1, best.saved, 0
    )


@implements(walk, Ropes)
def walk_ropes(structure, triangles, ray, number, workspace, log):
    """From a leaf follow the link of the exit's face, then down to the leaf at that place."""
    tree = structure.tree
    written = log.written[0]
    gate, leave_root = begin_march(tree, workspace, ray)
    note(log, VOLUME_TEST, -1, -1, gate.t, gate.t)
    best = Best(np.inf, -1, 0, 0, 0)
    inner, leaves = 0, 0
    node = ROOT
    searching = gate.t < np.inf
    while searching:
        index = leaf_index(tree, node)
        while index < 0:
            inner += 1
            note(log, VISIT_INNER, node, -1, gate.t, leave_root)
            node = step_down(tree, node, workspace, ROOT, gate.t)
            index = leaf_index(tree, node)
        exit_gate = find_gate(structure.boxes, index, workspace.frame, gate)
        if not exit_gate.clear:
            log.written[0] = written
            return depth_first(structure, triangles, ray, -2 - number, workspace, log)
        leaves += 1
        best = visit_leaf(
            structure, triangles, ray, number, workspace, log,
            node, index, gate.t, exit_gate.t, best,
        )  # fmt: skip
        gate = exit_gate
        far = 1 - near_side(workspace.frame, gate.axis)
        node = np.int64(structure.ropes[index, 3 * far + gate.axis])
        searching = node >= 0 and gate.t <= limit_of(ray, best)
    return Found(
        best.t, best.primitive, inner + leaves, leaves, best.empty, best.tests, 1, best.saved, 0
    )


WALKS = {"march": March, "segments": Segments, "recursive": Recursive, "heap": Heap}
"""Records by the walk's name, all but the neighbours, of which there are two kinds."""
