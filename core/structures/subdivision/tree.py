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

A cone comes to a plane with its end ahead, and is past it when the end behind is: that is all that
it needs to be walked like a ray, see :func:`side_of_cone`.

With d = 0 the inverse is infinite and so are both t, of equal sign if the ray runs clearly on one
side of the plane, of different sign (or NaN) if it runs in it. Comparisons are written such that
NaN means "both sides".
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...geometry.cones import Cone
from ...geometry.rays import Ray
from ...kernels import dispatched, implements, inlined, inner, whole

STACK = 512
"""Nodes a walk can put aside: seven per level of an octree, and no tree is deeper than 60."""

ROWS = 1024
"""What a walk can keep beside the stack; as many segments of a ray are collected at a time."""

ROOT = whole(0)
"""Number of the root."""

TOP = whole(0)
"""Depth of the root."""

EMPTY: Any = whole(0)
"""Height of the stack with nothing on it."""

WIDER = 1.0 + 1e-12
"""What the width of a cone is multiplied by: rounding must not make it thinner."""

NODE = 6
"""Column of a row, behind the six of a cell."""


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
    """Return the index of a leaf, 0 <= index < n_leaves; it is negative for an inner node."""
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
    workspace : Workspace
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
def plane_times(frame, axis, plane):
    """Return the early and the late t at which the ray meets a plane."""
    return (
        (plane - frame[axis, 0]) * frame[axis, 2],
        (plane - frame[axis, 1]) * frame[axis, 5],
    )


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
    stack = workspace.stack
    stack[height, 0], stack[height, 1] = node, span.enter
    stack[height, 2], stack[height, 3] = span.exit, span.late


@inlined
def pop(workspace, height):
    """Return the node at a place of the stack, and its span."""
    stack = workspace.stack
    span = Span(stack[height, 1], stack[height, 2], stack[height, 3])
    return whole(stack[height, 0]), span


@dispatched
def write_frame(probe, frame):
    """Write what of a probe is the same for all planes.

    Of each axis: the origins for early and late t where d > 0 (the other way round where d < 0),
    the inverse for early t; origin and direction; the inverse for late t.
    """
    raise TypeError(f"no frame of {type(probe).__name__}")


@implements(write_frame, Ray, inline=True)
def frame_of_ray(probe, frame):
    """Write the origins moved by the slack; both inverses are the same."""
    ray = probe
    frame[0, 0], frame[0, 1], frame[0, 2] = ray.low_x, ray.high_x, ray.ix
    frame[1, 0], frame[1, 1], frame[1, 2] = ray.low_y, ray.high_y, ray.iy
    frame[2, 0], frame[2, 1], frame[2, 2] = ray.low_z, ray.high_z, ray.iz
    frame[0, 3], frame[1, 3], frame[2, 3] = ray.ox, ray.oy, ray.oz
    frame[0, 4], frame[1, 4], frame[2, 4] = ray.dx, ray.dy, ray.dz
    frame[0, 5], frame[1, 5], frame[2, 5] = ray.ix, ray.iy, ray.iz


@inner
def side_of_cone(frame, axis, origin, d, u, slack, cone):
    """Write the frame of a cone along one axis.

    Seen along it, the cone at t is the interval from o + t (d - w) to o + t (d + w). It comes to a
    plane when its end ahead does, and is past it when the end behind is: that one is slower, or
    goes the other way, and then the cone is before the plane for ever.
    """
    sine = 1.0 - u * u
    w = cone.length * cone.slope * (sine if sine > 0.0 else 0.0) ** 0.5 * WIDER
    ahead, behind = abs(d) + w, abs(d) - w
    sign = 1.0 if d >= 0.0 else -1.0
    early, late = origin + sign * slack, origin - sign * slack
    frame[axis, 2] = sign / ahead
    frame[axis, 5] = sign / behind if behind > 0.0 else sign
    if behind <= 0.0:
        late = -sign * np.inf
    frame[axis, 0], frame[axis, 1] = (early, late) if d >= 0.0 else (late, early)
    frame[axis, 3], frame[axis, 4] = origin, d


@implements(write_frame, Cone)
def frame_of_cone(probe, frame):
    """Let early t be those of the end ahead, and late t those of the end behind."""
    c = probe
    side_of_cone(frame, 0, c.ox, c.dx, c.ux, c.low_x - c.ox, c)
    side_of_cone(frame, 1, c.oy, c.dy, c.uy, c.low_y - c.oy, c)
    side_of_cone(frame, 2, c.oz, c.dz, c.uz, c.low_z - c.oz, c)


@inner
def enter_root(box, ray, frame):
    """Write the frame of a ray, and return where the ray enters the root's cell.

    Returns
    -------
    span : Span
        Its interval; `enter` is inf for a miss.
    late : float
        The late t of entering.
    axis : int
        Axis of the plane through which it enters; -1 if it starts inside.
    """
    write_frame(ray, frame)
    enter, enter_late, axis = ray.t_min, ray.t_min, -1
    leave, leave_late = np.inf, np.inf
    for a in range(3):
        near = near_side(frame, a)
        if near == 1:
            frame[a, 0], frame[a, 1] = frame[a, 1], frame[a, 0]
        early, late = plane_times(frame, a, box[3 * near + a])
        if early > enter:
            enter, axis = early, a
        enter_late = late if late > enter_late else enter_late
        early, late = plane_times(frame, a, box[3 * (1 - near) + a])
        leave = early if early < leave else leave
        leave_late = late if late < leave_late else leave_late
    if enter > leave_late or enter > ray.t_max:
        enter = np.inf
    return Span(enter, leave, leave_late), enter_late, axis
