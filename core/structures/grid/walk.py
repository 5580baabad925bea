"""The walk of a uniform grid: cell by cell (:mod:`.dda`), or layer by layer (:mod:`.broad`)."""

from __future__ import annotations

from ...contract.events import VISIT_EMPTY, VISIT_LEAF, VOLUME_TEST, note
from ...contract.leaf import NOTHING
from ...contract.missing import most_missing, note_if_missing
from ...contract.walk import lost, missing, walk
from ...geometry.box import Boxes
from ...geometry.volume import MISS, enter
from ...kernels import implements
from .broad import is_broad, walk_broad
from .cells import GridArrays, list_of
from .dda import (
    COUNTERS,
    X,
    Y,
    Z,
    axis_walk,
    end_of_walk,
    first_cell,
    found,
    is_outside,
    next_place,
    place_in,
    test_cell,
)
from .lazy import LazyGridArrays

LOST, MISSED = lost(COUNTERS), missing(COUNTERS)


@implements(walk, LazyGridArrays, inline=True)
@implements(walk, GridArrays, inline=True)
def walk_grid(structure, geometry, ray, number, workspace, log):
    """Step from cell to cell until the nearest hit lies before the next wall."""
    best, visited, empty, lacking = NOTHING, 0, 0, 0

    t = enter(Boxes(structure.box), 0, ray, workspace.frame, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, t, t)
    if t == MISS:
        return found(best, visited, empty)
    if is_broad(structure, ray):
        best, visited, empty, lacking = walk_broad(
            structure, geometry, ray, number, workspace, log, t
        )
        return found(best, visited, empty) if lacking == 0 else MISSED

    ny, nz = structure.resolution[1], structure.resolution[2]
    x = axis_walk(structure, X, ray.low_x, ray.high_x, ray.dx, ray.ix)
    y = axis_walk(structure, Y, ray.low_y, ray.high_y, ray.dy, ray.iy)
    z = axis_walk(structure, Z, ray.low_z, ray.high_z, ray.dz, ray.iz)
    place = place_in(x, y, z, first_cell(x, t), first_cell(y, t), first_cell(z, t))
    t_last = end_of_walk(ray, best)
    # A ray crosses each layer of cells once.
    most = structure.resolution.sum()
    while visited < most:
        cell = (place.i * ny + place.j) * nz + place.k
        t_exit = min(place.wall_x, place.wall_y, place.wall_z)
        visited += 1
        begin, end = list_of(structure, cell)
        if note_if_missing(structure, cell):
            lacking += 1
            if lacking >= most_missing(structure):
                break
        elif begin == end:
            empty += 1
            note(log, VISIT_EMPTY, cell, -1, t, t_exit)
        else:
            note(log, VISIT_LEAF, cell, -1, t, t_exit)
            best = test_cell(
                structure, geometry, ray, number, workspace, log, cell, begin, end, t, t_exit, best
            )  # fmt: skip
            t_last = end_of_walk(ray, best)
        if t_exit > t_last:
            break
        t = t_exit
        place = next_place(x, y, z, place, t_exit)
        if is_outside(x, y, z, place):
            break
    else:
        return LOST

    return found(best, visited, empty) if lacking == 0 else MISSED
