"""Rays from so far away that rounding reaches farther than a grid's cells overlap.

Going from wall to wall, a ray is in one cell at a time. Which one is certain but for rounding, and
triangles belong to all cells within :data:`.cells.TOUCH`; a million sides away, rounding gets to be
more than that. From there on a ray is taken to be as broad as its slack: the grid is passed layer
by layer along the axis in which the ray goes fastest, and in a layer all cells are visited that the
broad ray reaches into. From ten million sides away these are hardly more than of a thin one; from
10^15 on they are all there are, for no number tells them apart then.
"""

from __future__ import annotations

from ...contract.events import VISIT_EMPTY, VISIT_LEAF, note
from ...contract.leaf import EVERYWHERE, NOTHING
from ...contract.missing import most_missing, note_if_missing
from ...geometry.cones import Cone
from ...geometry.rays import Ray
from ...kernels import dispatched, implements, inner, whole
from .cells import cell_at, list_of
from .dda import FOREVER, end_of_walk, test_cell


@inner
def is_broad(grid, ray):
    """Say whether rounding may lead a ray past a cell that lists what it hits."""
    return (
        breadth(ray) > 0.0
        or ray.low_x - ray.ox > grid.tolerance[0]
        or ray.low_y - ray.oy > grid.tolerance[1]
        or ray.low_z - ray.oz > grid.tolerance[2]
    )


@dispatched
def breadth(probe):
    """Return by how much a probe gets broader on either side while t goes up by 1."""
    raise TypeError(f"no breadth of {type(probe).__name__}")


@implements(breadth, Ray, inline=True)
def breadth_of_ray(probe):
    """Return 0: however broad rounding makes a ray, it stays so."""
    return 0.0


@implements(breadth, Cone)
def breadth_of_cone(probe):
    """Return how far the side departs from the axis."""
    return probe.slope * probe.length


@inner
def along_axis(ray, axis):
    """Return origin, direction, slack and inverse of a ray along an axis."""
    if axis == 0:
        return ray.ox, ray.dx, ray.low_x - ray.ox, ray.ix
    if axis == 1:
        return ray.oy, ray.dy, ray.low_y - ray.oy, ray.iy
    return ray.oz, ray.dz, ray.low_z - ray.oz, ray.iz


@inner
def cells_between(grid, ray, axis, begin, end):
    """Return the first and the last cell of an axis that a broad ray reaches into."""
    o, d, slack, _ = along_axis(ray, axis)
    a, b = o + begin * d, o + end * d
    # A place is rounded by less than the slack once more.
    margin = 2.0 * slack + breadth(ray) * end
    low, high = (a if a < b else b) - margin, (b if a < b else a) + margin
    walls, size, count = grid.walls[axis], grid.cell_size[axis], grid.resolution[axis]
    return cell_at(walls, size, count, low), cell_at(walls, size, count, high)


@inner
def walk_broad(grid, geometry, ray, number, workspace, log, t_enter):
    """Visit all cells that a broad ray reaches into, layer by layer, from `t_enter` on.

    Returns
    -------
    best : Best
    visited, empty, lacking : int
        Cells; the last are not made yet.
    """
    best, visited, empty, lacking = NOTHING, 0, 0, 0
    ny, nz = grid.resolution[1], grid.resolution[2]
    axis = whole(ray.kz)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    stride, stride_u, stride_v = stride_of(axis, ny, nz), stride_of(u, ny, nz), stride_of(v, ny, nz)
    o, d, slack, inverse = along_axis(ray, axis)
    walls, count = grid.walls[axis], grid.resolution[axis]
    # Which of its walls a layer is entered through, and the origin that makes it the earliest.
    ascends = 1 if d > 0.0 else 0
    slack = slack if d > 0.0 else -slack
    for step in range(count):
        layer = step if ascends == 1 else count - 1 - step
        begin, end = times_in_layer(
            ray, walls[layer + 1 - ascends], walls[layer + ascends], o, d, slack, inverse
        )
        if end < t_enter:
            continue
        if begin > end_of_walk(ray, best):
            break
        # Where the inverse overflows, both may be anything.
        begin = begin if begin > t_enter else t_enter
        end = end if end < FOREVER else FOREVER
        first_u, last_u = cells_between(grid, ray, u, begin, end)
        first_v, last_v = cells_between(grid, ray, v, begin, end)
        for i in range(first_u, last_u + 1):
            for k in range(first_v, last_v + 1):
                cell = layer * stride + i * stride_u + k * stride_v
                visited += 1
                if note_if_missing(grid, cell):
                    lacking += 1
                    if lacking >= most_missing(grid):
                        return best, visited, empty, lacking
                    continue
                first_slot, end_slot = list_of(grid, cell)
                if first_slot == end_slot:
                    empty += 1
                    note(log, VISIT_EMPTY, cell, -1, begin, end)
                    continue
                note(log, VISIT_LEAF, cell, -1, begin, end)
                best = test_cell(
                    grid, geometry, ray, number, workspace, log, cell, first_slot, end_slot,
                    begin, EVERYWHERE, best,
                )  # fmt: skip
    return best, visited, empty, lacking


@dispatched
def times_in_layer(probe, near, far, o, d, slack, inverse):
    """Return the t from and up to which a probe is in a layer between two walls.

    Parameters
    ----------
    near, far : float
        The walls, in the order in which they are crossed.
    o, d, inverse : float
        Origin, direction and inverse along the axis.
    slack : float
        Of the direction's sign.
    """
    raise TypeError(f"no times of {type(probe).__name__}")


@implements(times_in_layer, Ray, inline=True)
def times_of_ray(probe, near, far, o, d, slack, inverse):
    """Move the origin so that it enters the earliest and leaves the latest."""
    return (near - (o + slack)) * inverse, (far - (o - slack)) * inverse


@implements(times_in_layer, Cone)
def times_of_cone(probe, near, far, o, d, slack, inverse):
    """Let one side run ahead of the axis and the other stay behind.

    A cone that is so wide that the one behind goes the other way is everywhere, sooner or later.
    """
    sign, spread = (1.0 if d > 0.0 else -1.0), breadth(probe)
    ahead, behind = abs(d) + spread, abs(d) - spread
    to_near, to_far = sign * (near - o) - abs(slack), sign * (far - o) + abs(slack)
    if behind <= 0.0:
        return (to_near / ahead if to_near > 0.0 else probe.t_min), FOREVER
    return (to_near / ahead if to_near > 0.0 else to_near / behind), to_far / behind


@inner
def stride_of(axis, ny, nz):
    """Return by how much the numbers of neighbouring cells differ along an axis."""
    if axis == 0:
        return ny * nz
    return nz if axis == 1 else whole(1)
