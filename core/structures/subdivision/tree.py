"""How a walk sees a tree of axis-aligned planes, and the intervals of a ray in it.

A tree is a NamedTuple of arrays with at least the fields

    box : (6,) float64            the root's cell
    offsets : (n_leaves + 1,) int64
    references : (N_OIV,) int32   leaf number i lists references[offsets[i]:offsets[i + 1]]

Its nodes are the numbers 0, 1, ... n - 1, the same that the step log and the cells show; 0 is the
root. Everything else a walk asks through four kernels, implemented once per type of tree
(``@implements(planes, MyTree)``): :func:`leaf_index`, :func:`planes`, :func:`child` and
:func:`expand`. A node may be split by one plane (kd-tree) or by three at once (octree).

Intervals
---------
All decisions rest on the t at which the ray meets a plane, never on points o + t d, and that t
comes from one expression, so that all walks agree in every bit. Rounding makes it uncertain by the
slack of :mod:`...geometry.rays`, hence two of them: `early`, before which nothing that reaches up
to the plane from behind can be hit, and `late`, after which nothing in front of it can::

    early = (plane - (o + slack)) * inverse      late = (plane - (o - slack)) * inverse

(for d < 0 the other way round). A cell's interval runs from the early t of the plane through which
the ray enters to the early t of the plane through which it leaves: consecutive intervals touch
exactly. A cell is visited if its *widened* interval, from early entry to late exit, is not empty.
For almost every ray that makes no difference. Where a ray meets two planes at nearly the same t,
or runs within a plane, the cells on both sides are visited, and so a triangle that only touches a
plane may be stored on one side alone.

With d = 0 the inverse is infinite and so are both t, of equal sign if the ray runs clearly on one
side of the plane, of different sign (or NaN) if it runs in it. Comparisons are written such that
NaN means "both sides".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import dispatched, inlined, inner

STACK = 512
"""Nodes a walk can put aside: seven per level of an octree, and no tree is deeper than 60."""

ROOT = np.int64(0)
"""Number of the root. Not the plain 0, for which Numba would compile callees once more."""

SEGMENTS = 1024
"""Segments of a ray that are collected before they are processed."""


class TreeWorkspace(NamedTuple):
    """Scratch memory of one thread for the walks of trees.

    Attributes
    ----------
    frame : (3, 5) float64
        Per axis what :func:`plane_times` needs of the ray: o + slack, o - slack (exchanged for
        d < 0) and the inverse of d; and for oblique planes o and d.
    nodes : (STACK,) int32
    enters, exits, lates : (STACK,) float64
        The stack: nodes put aside, with their spans.
    boxes : (STACK, 6) float64
        Cells of the nodes on the path from the root, by depth.
    path : (STACK,) int32
        The nodes on that path.
    heap : (STACK,) int32
        Places 0, 1, ... of entries in the order of a heap.
    heap_nodes : (STACK,) int32
    spans : (STACK, 3) float64
        What the places hold: nodes and their spans.
    keys, ceilings : (STACK,) float64
    ages : (STACK,) int64
        What the heap is ordered by, see :func:`.walks.walk_heap`.
    free : (STACK,) int32
        Places that became free.
    segment_nodes : (SEGMENTS,) int32
    segment_enters, segment_exits : (SEGMENTS,) float64
        The ray cut into pieces by leaf.
    mailbox : (n_triangles,) int32, or (1,) if there is none
    """

    frame: np.ndarray
    nodes: np.ndarray
    enters: np.ndarray
    exits: np.ndarray
    lates: np.ndarray
    boxes: np.ndarray
    path: np.ndarray
    heap: np.ndarray
    heap_nodes: np.ndarray
    spans: np.ndarray
    keys: np.ndarray
    ceilings: np.ndarray
    ages: np.ndarray
    free: np.ndarray
    segment_nodes: np.ndarray
    segment_enters: np.ndarray
    segment_exits: np.ndarray
    mailbox: np.ndarray


def make_workspace(mailbox_size: int) -> TreeWorkspace:
    """Return scratch memory for one thread."""
    return TreeWorkspace(
        frame=np.zeros((3, 5)),
        nodes=np.zeros(STACK, np.int32),
        enters=np.zeros(STACK),
        exits=np.zeros(STACK),
        lates=np.zeros(STACK),
        boxes=np.zeros((STACK, 6)),
        path=np.zeros(STACK, np.int32),
        heap=np.zeros(STACK, np.int32),
        heap_nodes=np.zeros(STACK, np.int32),
        spans=np.zeros((STACK, 3)),
        keys=np.zeros(STACK),
        ceilings=np.zeros(STACK),
        ages=np.zeros(STACK, np.int64),
        free=np.zeros(STACK, np.int32),
        segment_nodes=np.zeros(SEGMENTS, np.int32),
        segment_enters=np.zeros(SEGMENTS),
        segment_exits=np.zeros(SEGMENTS),
        mailbox=np.full(mailbox_size, -1, np.int32),
    )


class Span(NamedTuple):
    """The interval of a ray in a cell.

    Attributes
    ----------
    enter, exit : float
        Early t of the planes through which the ray enters and leaves.
    late : float
        Late t of leaving: ``enter <= t <= late`` is the widened interval.
    """

    enter: float
    exit: float
    late: float


# ---------------------------------------------------------------- the four kernels of each tree


@dispatched
def leaf_index(tree, node):
    """Return the index of a leaf, 0 <= index < n_leaves, or -1 if the node is an inner one."""
    raise TypeError(f"no leaf_index for {type(tree).__name__}")


@dispatched
def planes(tree, node):
    """Return the planes x, y, z that split an inner node; NaN along an axis that is not split."""
    raise TypeError(f"no planes for {type(tree).__name__}")


@dispatched
def child(tree, node, side):
    """Return a child of an inner node.

    Bit 0, 1, 2 of `side` is set for the child above the plane of x, y, z; bits of axes that are
    not split are ignored.
    """
    raise TypeError(f"no child for {type(tree).__name__}")


@dispatched
def expand(tree, node, workspace, span, height):
    """Find the children of an inner node whose widened intervals are not empty.

    All but the first along the ray are pushed on the stack, the last one first (:func:`push`).

    Parameters
    ----------
    workspace : TreeWorkspace
    span : Span
        The ray's interval in `node`.
    height : int
        Of the stack.

    Returns
    -------
    first : int
        The first child along the ray.
    span : Span
        Its interval.
    height : int
        The new height of the stack.
    """
    raise TypeError(f"no expand for {type(tree).__name__}")


# --------------------------------------------------------------------------------- intervals


@inlined
def set_frame(workspace, ray):
    """Write what :func:`plane_times` needs of a ray."""
    frame = workspace.frame
    frame[0, 0], frame[0, 1], frame[0, 2] = ray.low_x, ray.high_x, ray.ix
    frame[1, 0], frame[1, 1], frame[1, 2] = ray.low_y, ray.high_y, ray.iy
    frame[2, 0], frame[2, 1], frame[2, 2] = ray.low_z, ray.high_z, ray.iz
    frame[0, 3], frame[1, 3], frame[2, 3] = ray.ox, ray.oy, ray.oz
    frame[0, 4], frame[1, 4], frame[2, 4] = ray.dx, ray.dy, ray.dz
    for axis in range(3):
        if not frame[axis, 2] > 0.0:
            frame[axis, 0], frame[axis, 1] = frame[axis, 1], frame[axis, 0]


@inlined
def plane_times(frame, axis, plane):
    """Return the early and the late t at which the ray meets a plane."""
    inverse = frame[axis, 2]
    return (plane - frame[axis, 0]) * inverse, (plane - frame[axis, 1]) * inverse


@inlined
def near_side(frame, axis):
    """Return 0 if the ray comes from below along an axis (also for d = 0), 1 if from above."""
    return 0 if frame[axis, 2] > 0.0 else 1


@inlined
def meets_near(span, late):
    """Say whether the ray is in the part in front of a plane."""
    return not (late < span.enter)


@inlined
def meets_far(span, early):
    """Say whether the ray is in the part behind a plane."""
    return not (early > span.late)


@inlined
def near_part(span, early, late):
    """Return the interval of a ray in the part of a cell in front of a plane."""
    return Span(
        span.enter,
        early if early < span.exit else span.exit,
        late if late < span.late else span.late,
    )


@inlined
def far_part(span, early):
    """Return the interval of a ray in the part of a cell behind a plane."""
    return Span(early if early > span.enter else span.enter, span.exit, span.late)


@inlined
def push(workspace, height, node, span):
    """Put a node aside."""
    workspace.nodes[height] = node
    workspace.enters[height] = span.enter
    workspace.exits[height] = span.exit
    workspace.lates[height] = span.late


@inlined
def pop(workspace, height):
    """Return the node at a place of the stack, and its span."""
    return np.int64(workspace.nodes[height]), Span(
        workspace.enters[height], workspace.exits[height], workspace.lates[height]
    )


@inner
def enter_root(box, frame, t_max):
    """Return where a ray enters the root's cell.

    Returns
    -------
    span : Span
        Its interval; `enter` is inf for a miss.
    late : float
        The late t of entering.
    axis : int
        Axis of the plane through which it enters; -1 if it starts inside.
    """
    enter, enter_late, axis = 0.0, 0.0, -1
    leave, leave_late = np.inf, np.inf
    for a in range(3):
        near = near_side(frame, a)
        early, late = plane_times(frame, a, box[3 * near + a])
        if early > enter:
            enter, axis = early, a
        enter_late = late if late > enter_late else enter_late
        early, late = plane_times(frame, a, box[3 * (1 - near) + a])
        leave = early if early < leave else leave
        leave_late = late if late < leave_late else leave_late
    if enter > leave_late or enter > t_max:
        enter = np.inf
    return Span(enter, leave, leave_late), enter_late, axis
