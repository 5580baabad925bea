"""Which octants a triangle belongs to: those its box overlaps, or those it overlaps itself."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...geometry.geometry import overlaps
from ...geometry.rays import ULPS
from ...kernels import dispatched, implements, inlined, inner


class ByBox(NamedTuple):
    """Triangles are compared by their boxes, (n, 6); `closed` says whether touching counts."""

    boxes: np.ndarray
    closed: bool


class Exact(NamedTuple):
    """Items are compared themselves, as far as their kind can be.

    Attributes
    ----------
    slack : (3,) float64
        Rounding of a walk's coordinates, by which a cell is widened.
    part : (6,) float64
        Scratch.
    """

    boxes: np.ndarray
    closed: bool
    geometry: Any
    slack: np.ndarray
    part: np.ndarray


def assignment_named(name: str, geometry: Any, boxes: np.ndarray, closed: bool) -> Any:
    """Return the record for a setting."""
    if name == "box":
        return ByBox(boxes, closed)
    return Exact(boxes, closed, geometry, 4 * ULPS * geometry.reach, np.empty(6))


@inner
def octant_box(cell, planes, octant, out):
    """Write the box of one octant of a cell, (6,), cut by planes, (3,), into `out`, (6,)."""
    for axis in range(3):
        upper = octant >> axis & 1
        out[axis] = planes[axis] if upper == 1 else cell[axis]
        out[3 + axis] = cell[3 + axis] if upper == 1 else planes[axis]


@inlined
def octants_of_box(boxes, closed, planes, n):
    """Compare box n with the three planes of a cell; that it overlaps the cell is known."""
    below, above = 0, 0  # bits of the axes
    for axis in range(3):
        low, high, plane = boxes[n, axis], boxes[n, 3 + axis], planes[axis]
        if low < plane or (closed and low == plane):
            below |= 1 << axis
        # A flat triangle in an open plane overlaps neither side: it goes above.
        if high > plane or low == plane or (closed and high == plane):
            above |= 1 << axis
    mask = 0
    for octant in range(8):
        if (octant & above) | (~octant & below) == 7:
            mask |= 1 << octant
    return mask


@dispatched
def octants_of(assignment, cell, planes, n):
    """Return the octants of a cell to which triangle n belongs, as bits 0 ... 7; at least one."""
    raise TypeError(f"no assignment by {type(assignment).__name__}")


@implements(octants_of, ByBox)
def octants_by_box(assignment, cell, planes, n):
    """Return the octants that the triangle's box overlaps."""
    return octants_of_box(assignment.boxes, assignment.closed, planes, n)


@implements(octants_of, Exact)
def octants_exactly(assignment, cell, planes, n):
    """Of the octants that the box overlaps, keep those that the triangle overlaps."""
    by_box = octants_of_box(assignment.boxes, assignment.closed, planes, n)
    part, slack = assignment.part, assignment.slack
    mask = 0
    for octant in range(8):
        if not by_box >> octant & 1:
            continue
        octant_box(cell, planes, octant, part)
        for axis in range(3):
            part[axis] -= slack[axis]
            part[3 + axis] += slack[axis]
        if overlaps(assignment.geometry, n, part):
            mask |= 1 << octant
    # Rounding must not lose a triangle.
    return mask if mask != 0 else by_box
