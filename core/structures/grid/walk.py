"""The walk of a uniform grid: cell by cell (:mod:`.dda`), or layer by layer (:mod:`.broad`)."""

from __future__ import annotations

import numpy as np

from ...contract.steps import VISIT_EMPTY, VISIT_LEAF, VOLUME_TEST, note
from ...contract.structure import LOST, Found, walk
from ...geometry.box import MISS, enter_box
from ...kernels import implements
from .broad import is_broad, walk_broad
from .cells import GridArrays
from .dda import (
    X,
    Y,
    Z,
    end_of_walk,
    first_cell,
    is_outside,
    next_place,
    place_in,
    test_cell,
    way_along,
)


@implements(walk, GridArrays)
def walk_grid(structure, triangles, ray, number, workspace, log):
    """Step from cell to cell until the nearest hit lies before the next wall."""
    best_t, best = np.inf, np.int64(-1)  # of one type from the start: test_cell is compiled once
    cells_visited, empty_visited, tests, mailbox_hits, postponed = 0, 0, 0, 0, 0

    t = enter_box(structure.box, 0, ray, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, t, t)
    if t == MISS:
        return Found(best_t, best, 0, 0, 0, 0, 1, 0, 0, 0)
    if is_broad(structure, ray):
        return walk_broad(structure, triangles, ray, number, workspace, log, t)

    ny, nz = structure.resolution[1], structure.resolution[2]
    x = way_along(structure, X, ray.low_x, ray.high_x, ray.dx, ray.ix)
    y = way_along(structure, Y, ray.low_y, ray.high_y, ray.dy, ray.iy)
    z = way_along(structure, Z, ray.low_z, ray.high_z, ray.dz, ray.iz)
    place = place_in(x, y, z, first_cell(x, t), first_cell(y, t), first_cell(z, t))
    t_last = end_of_walk(ray, best_t, best)
    # A way crosses each layer of cells once.
    most = structure.resolution.sum()
    while cells_visited < most:
        cell = (place.i * ny + place.j) * nz + place.k
        t_exit = min(place.wall_x, place.wall_y, place.wall_z)
        cells_visited += 1
        if structure.offsets[cell] == structure.offsets[cell + 1]:
            empty_visited += 1
            note(log, VISIT_EMPTY, cell, -1, t, t_exit)
        else:
            note(log, VISIT_LEAF, cell, -1, t, t_exit)
            best_t, best, tested, known, later = test_cell(
                structure, triangles, ray, number, workspace, log, cell, t, t_exit, best_t, best
            )
            tests += tested
            mailbox_hits += known
            postponed += later
            t_last = end_of_walk(ray, best_t, best)
        if t_exit > t_last:
            break
        t = t_exit
        place = next_place(x, y, z, place, t_exit)
        if is_outside(x, y, z, place):
            break
    else:
        return LOST

    return Found(
        best_t, best, cells_visited, cells_visited, empty_visited, tests, 1, mailbox_hits,
        postponed, 0,
    )  # fmt: skip
