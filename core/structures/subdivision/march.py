"""Marching: from a leaf through the face by which the ray leaves it into the next one.

The three walks of this file differ in how they get to the next leaf: from the root
(:class:`.walks.March`), up to the nearest common ancestor and down again
(:class:`.walks.Neighbours`), or by a link to the neighbour (:class:`.walks.Ropes`).

The place on the ray is never a point o + t d that would have to be moved a little into the next
cell, but a *gate*: the very plane that is crossed. Each plane on the way down is compared with it
by the t at which the ray meets it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.events import NONE, VISIT_INNER, VOLUME_TEST, note
from ...contract.walk import walk
from ...kernels import dispatched, implements, inlined, inner, whole
from .tree import NODE, ROOT, TOP, child, enter_root, leaf_index, near_side, plane_times, planes
from .walks import (
    LOST,
    NOWHERE_YET,
    March,
    Neighbours,
    Recursive,
    Ropes,
    found,
    limit_of,
    visit_leaf,
)


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
def find_gate(cells, row, frame, entry):
    """Return the gate through which a ray leaves a cell that it has entered through `entry`."""
    leave, leave_late, leave_axis, leave_plane = np.inf, np.inf, -1, 0.0
    second = np.inf
    clear = entry.clear
    for axis in range(3):
        near = near_side(frame, axis)
        # Behind: the ray must have come clearly before, unless this is the entry itself.
        plane = cells[row, 3 * near + axis]
        early, late = plane_times(frame, axis, plane)
        if not (late < entry.t) and not (axis == entry.axis and plane == entry.plane):
            clear = False
        # Ahead: clearly after the entry, and clearly one before the others.
        plane = cells[row, 3 * (1 - near) + axis]
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

    The nodes on the way and their cells are kept in the workspace: `node` at `depth`, its child
    below.
    """
    frame, rows = workspace.frame, workspace.rows
    split = planes(tree, node)
    side = 0
    rows[depth, NODE] = node
    for i in range(6):
        rows[depth + 1, i] = rows[depth, i]
    for axis in range(3):
        plane = split[axis]
        early, _ = plane_times(frame, axis, plane)
        upper = near_side(frame, axis)
        if early <= t:
            upper = 1 - upper
        side += upper << axis
        if plane == plane:
            rows[depth + 1, axis if upper == 1 else 3 + axis] = plane
    return child(tree, node, side)


# -------------------------------------------------------------- how to get to the next leaf


@dispatched
def leave_leaf(structure, workspace, index, depth, gate):
    """Return the gate out of the leaf to which the walk has come down through `gate`."""
    raise TypeError(f"{type(structure).__name__} is not marched through")


@dispatched
def next_node(structure, workspace, index, depth, gate, log):
    """Return where to go down to the next leaf: a node, its depth in the rows, steps up to it."""
    raise TypeError(f"{type(structure).__name__} is not marched through")


def leave_cell_in_rows(structure, workspace, index, depth, gate):
    """Take the leaf's cell as it was put together on the way down from the root."""
    return find_gate(workspace.rows, depth, workspace.frame, gate)


implements(leave_leaf, March)(leave_cell_in_rows)
implements(leave_leaf, Neighbours)(leave_cell_in_rows)


@implements(leave_leaf, Ropes)
def leave_stored_cell(structure, workspace, index, depth, gate):
    """Take the leaf's cell from where it is stored, since links lead to it from anywhere."""
    return find_gate(structure.boxes, index, workspace.frame, gate)


@implements(next_node, March)
def back_to_the_root(structure, workspace, index, depth, gate, log):
    """Start again from the root."""
    return ROOT, TOP, 0


@implements(next_node, Neighbours)
def up_to_common_ancestor(structure, workspace, index, depth, gate, log):
    """Go up to the node that is split by the plane of the gate."""
    steps = 0
    while depth > TOP:
        depth -= 1
        node = whole(workspace.rows[depth, NODE])
        if planes(structure.tree, node)[gate.axis] == gate.plane:
            return node, depth, steps
        steps += 1
        note(log, VISIT_INNER, node, NONE, gate.t, gate.t)
    return whole(NONE), TOP, steps


@implements(next_node, Ropes)
def along_the_rope(structure, workspace, index, depth, gate, log):
    """Follow the link behind the gate's face."""
    far = 1 - near_side(workspace.frame, gate.axis)
    return whole(structure.ropes[index, 3 * far + gate.axis]), TOP, 0


# ---------------------------------------------------------------------------------- the walk


@inlined
def first_gate(box, workspace, ray):
    """Return the ray's gate into the root, t = inf for a miss, and the t at which it leaves."""
    span, late, axis = enter_root(box, ray, workspace.frame)
    plane = 0.0
    if axis >= 0:
        plane = box[3 * near_side(workspace.frame, axis) + axis]
    for i in range(6):
        workspace.rows[0, i] = box[i]
    return Gate(span.enter, late, axis, plane, True), span.exit


@inlined
def leaves_root_too(tree, workspace, leave, leave_root):
    """Say whether a ray leaves a leaf by a plane within the root as late as it leaves the root.

    From 10^16 times their distance away, no numbers tell the two planes apart.
    """
    if leave.t < leave_root or leave.axis < 0:
        return False
    far = 1 - near_side(workspace.frame, leave.axis)
    return leave.plane != tree.box[3 * far + leave.axis]


def march(structure, geometry, ray, number, workspace, log):
    """Go from leaf to leaf."""
    tree = structure.tree
    written = log.written[0]
    gate, leave_root = first_gate(tree.box, workspace, ray)
    note(log, VOLUME_TEST, NONE, NONE, gate.t, gate.t)
    visited, inner = NOWHERE_YET, 0
    node, depth = ROOT, TOP
    searching = gate.t < np.inf
    n_leaves = len(tree.offsets) - 1
    while searching:
        # A ray enters every leaf once, and the last one leads out of the root.
        if node < 0 or visited.leaves == n_leaves:
            return LOST
        index = leaf_index(tree, node)
        while index < 0:
            inner += 1
            note(log, VISIT_INNER, node, NONE, gate.t, leave_root)
            node = step_down(tree, node, workspace, depth, gate.t)
            depth += 1
            index = leaf_index(tree, node)
        leave = leave_leaf(structure, workspace, index, depth, gate)
        if not leave.clear or leaves_root_too(tree, workspace, leave, leave_root):
            # The mailbox must not know what this walk has tested.
            log.written[0] = written
            again = Recursive(tree, structure.mailbox)
            return walk(again, geometry, ray, -2 - number, workspace, log)
        visited = visit_leaf(
            tree, structure.mailbox, geometry, ray, number, workspace, log,
            node, index, gate.t, leave.t, visited,
        )  # fmt: skip
        gate = leave
        searching = gate.t < leave_root and gate.t <= limit_of(tree, ray, visited)
        if searching:
            node, depth, steps = next_node(structure, workspace, index, depth, gate, log)
            inner += steps
    return found(visited, inner)


for record in (March, Neighbours, Ropes):
    implements(walk, record, inline=True)(march)
