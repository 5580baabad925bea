"""Where an octree's cells are cut: in the middle, or where it costs least.

For the latter, along each axis ten positions between the object median (as many triangles on
either side) and the spatial median (the middle) are tried, and that of the least cost

    SA(low part) N_low + SA(high part) N_high

is taken (Octree-A of V. Havran: A Summary of Octree Ray Traversal Algorithms, RTNews 12(2), 1999).
"""

from __future__ import annotations

from typing import NamedTuple

from ...kernels import dispatched, implements
from ..subdivision.selection import select


class Middle(NamedTuple):
    """Planes in the middle; half the sum of a cell's ends."""

    half: float = 0.5


class Adaptive(NamedTuple):
    """Planes at the cheapest of so many candidates."""

    candidates: int = 10


PLACEMENTS = {"middle": Middle(), "adaptive": Adaptive()}


@dispatched
def choose_plane(placement, cell, axis, references, begin, count, assignment, values):
    """Return the plane that cuts a cell along an axis.

    Parameters
    ----------
    placement : Middle or Adaptive
    cell : (6,) float64
    references, begin, count
        The triangles of the cell are ``references[begin:begin + count]``.
    assignment : ByBox or Exact
        Has their boxes.
    values : (count,) float64
        Scratch.
    """
    raise TypeError(f"no placement by {type(placement).__name__}")


@implements(choose_plane, Middle)
def plane_in_the_middle(placement, cell, axis, references, begin, count, assignment, values):
    """Return the middle of the cell."""
    return placement.half * (cell[axis] + cell[3 + axis])


@implements(choose_plane, Adaptive)
def cheapest_plane(placement, cell, axis, references, begin, count, assignment, values):
    """Return the cheapest candidate between the middle and the object median."""
    boxes, closed = assignment.boxes, assignment.closed
    low, high = cell[axis], cell[3 + axis]
    middle = 0.5 * (low + high)
    for i in range(count):
        n = references[begin + i]
        # The part of the box inside the cell, so that the median is inside too.
        values[i] = 0.5 * (max(boxes[n, axis], low) + min(boxes[n, 3 + axis], high))
    median = select(values, 0, count - 1, count // 2)
    u = cell[(axis + 1) % 3 + 3] - cell[(axis + 1) % 3]
    v = cell[(axis + 2) % 3 + 3] - cell[(axis + 2) % 3]
    best, best_cost = middle, -1.0
    # From the middle outwards: of equal cost the one nearest to the middle.
    for k in range(placement.candidates):
        plane = middle + (median - middle) * k / (placement.candidates - 1)
        if not low < plane < high:
            continue
        n_low, n_high = 0, 0
        for i in range(count):
            n = references[begin + i]
            if boxes[n, axis] < plane or (closed and boxes[n, axis] == plane):
                n_low += 1
            if (
                boxes[n, 3 + axis] > plane
                or boxes[n, axis] == plane
                or (closed and boxes[n, 3 + axis] == plane)
            ):
                n_high += 1
        cost = n_low * (u * v + (u + v) * (plane - low)) + n_high * (
            u * v + (u + v) * (high - plane)
        )
        if best_cost < 0.0 or cost < best_cost:
            best, best_cost = plane, cost
    return best
