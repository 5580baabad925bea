"""Grid traversal (3D DDA): from cell to cell through the nearest wall.

A ray meets three systems of parallel walls. In a cell [i, j, k] the walk knows the t at which the
next wall of each system is crossed, the lecture's Lx, Ly, Lz, and leaves through the nearest of the
three. The lecture subtracts the step from Lx, Ly, Lz each time; here the t of the next wall is
computed from its integer index, so no error builds up.

Walls are crossed in the order of their t; of several at the same t first that in x, then in y, then
in z. Rounding is monotonic, so from one cell to the next no t ever falls.

A triangle that spans several cells is met several times. The mailbox remembers the last ray that
tested it. A hit beyond the current cell is postponed: something nearer may wait in between, so it
is kept and only accepted once the walk has reached its cell.

J. Amanatides, A. Woo: A Fast Voxel Traversal Algorithm for Ray Tracing, Eurographics 1987.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.counters import (
    MAILBOX_HITS,
    N_EETS,
    N_ETS,
    N_IT,
    N_TS,
    POSTPONED_HITS,
    VOLUME_TESTS,
)
from ...contract.leaf import test_leaf
from ...contract.walk import Found
from ...geometry.rays import ALL, ANY
from ...kernels import inlined, inner, whole
from .cells import cell_at

X, Y, Z = whole(0), whole(1), whole(2)
"""The axes; of one type, so that what takes an axis is compiled once."""

NOT_YET, ALREADY = np.bool_(False), np.bool_(True)
"""Whether a wall that is crossed at this very t has been crossed: the axis's turn comes later."""

FOREVER = np.finfo(np.float64).max
"""The last t of all. A wall that is never crossed comes later, at infinity."""


class AxisWalk(NamedTuple):
    """One ray along one axis: what does not change from cell to cell.

    Attributes
    ----------
    walls : (m,) float64
        The walls of this axis.
    per_length : float
        Cells per unit of length.
    o, d, inverse : float
        Origin, direction, and 1 / direction. The origin is moved by the ray's slack, so that the t
        of a wall is the earliest it can have: what lies behind the wall is not hit before it.
    step : int
        To the next cell: 1 or -1.
    ahead : int
        Which wall of a cell the ray leaves through: 0 the lower, 1 the upper.
    begin, end : int
        The first cell that can be met, and the first one that is no longer in the grid.
    """

    walls: np.ndarray
    per_length: float
    o: float
    d: float
    inverse: float
    step: int
    ahead: int
    begin: int
    end: int


class Place(NamedTuple):
    """Where a walk is: its cell [i, j, k], and the t of the next wall of each system."""

    i: int
    j: int
    k: int
    wall_x: float
    wall_y: float
    wall_z: float


@inner
def axis_walk(grid, axis, low, high, d, inverse):
    """Return the walk along an axis; `low` and `high` are the ray's origins moved by slack."""
    count = grid.resolution[axis]
    walls, per_length = grid.walls[axis], 1.0 / grid.cell_size[axis]
    if d > 0.0:
        return AxisWalk(walls, per_length, low, d, inverse, 1, 1, 0, count)
    return AxisWalk(walls, per_length, high, d, inverse, -1, 0, count - 1, -1)


@inner
def wall_t(along, i):
    """Return the t at which the ray leaves cell i, inf if it never does.

    A direction whose inverse overflows crosses no wall.
    """
    if np.isinf(along.inverse):
        return np.inf
    return (along.walls[i + along.ahead] - along.o) * along.inverse


@inner
def cell_when(along, first, last, t, with_ties):
    """Return the cell that a walk is in at t, from `first` to `last` in its order.

    `with_ties` says whether a wall that is crossed at this very t has been crossed already.
    """
    position = (along.o + t * along.d - along.walls[0]) * along.per_length
    i, highest = min(first, last), max(first, last)
    # Compared so that what is no number leads to a cell, too.
    if position >= highest:
        i = highest
    elif position > i:
        i = int(position)
    # The position is rounded; the t of walls decide.
    while i != first:
        crossing = wall_t(along, i - along.step)
        if crossing < t or (crossing == t and with_ties):
            break
        i -= along.step
    while i != last:
        crossing = wall_t(along, i)
        if crossing > t or (crossing == t and not with_ties):
            break
        i += along.step
    return i


@inner
def first_cell(along, t):
    """Return the cell along one axis in which a ray enters the grid at t."""
    count = abs(along.end - along.begin)
    if np.isinf(along.inverse):
        return cell_at(along.walls, 1.0 / along.per_length, count, along.o)
    return cell_when(along, along.begin, along.end - along.step, t, NOT_YET)


@inlined
def place_in(x, y, z, i, j, k):
    """Return the place of a walk in cell [i, j, k]."""
    return Place(i, j, k, wall_t(x, i), wall_t(y, j), wall_t(z, k))


@inlined
def next_place(x, y, z, place, t_exit):
    """Return the place behind the wall that is crossed at `t_exit`, of several the first."""
    through_x = place.wall_x == t_exit
    through_y = place.wall_y == t_exit and not through_x
    # Without a branch: which wall comes next cannot be foreseen, a wrong guess costs more than
    # all three walls.
    i = place.i + (x.step if through_x else 0)
    j = place.j + (y.step if through_y else 0)
    k = place.k + (0 if through_x or through_y else z.step)
    return place_in(x, y, z, i, j, k)


@inlined
def is_outside(x, y, z, place):
    """Say whether a walk has left the grid."""
    return place.i == x.end or place.j == y.end or place.k == z.end


@inlined
def end_of_walk(ray, best):
    """Return the t up to which walls are crossed: a cell that the ray leaves later is the last."""
    if ray.query == ALL:
        return min(ray.t_max, FOREVER)
    if ray.query == ANY and best.primitive >= 0:
        return -np.inf
    # The hit must lie in the current cell. One exactly on the wall waits for the next cell,
    # which may hold a triangle of lower id at the same t.
    return min(best.t, ray.t_max, FOREVER)


COUNTERS = N_TS, N_ETS, N_EETS, N_IT, VOLUME_TESTS, MAILBOX_HITS, POSTPONED_HITS


@inlined
def test_cell(grid, geometry, ray, number, workspace, log, cell, begin, end, t, t_exit, best):
    """Test the triangles of a cell that the ray is in from t to `t_exit`.

    They are listed from `begin` to `end`. A hit on the wall where the ray leaves is in the cell.
    """
    return test_leaf(
        geometry, grid.references, grid.mailbox, begin, end, ray, number, workspace, log,
        cell, t, np.nextafter(t_exit, np.inf), False, best,
    )  # fmt: skip


@inlined
def found(best, visited, empty):
    """Return the answer of a walk that has visited so many cells."""
    counts = visited, visited, empty, best.tests, 1, best.mailbox_hits, best.postponed
    return Found(best.t, best.primitive, counts)
