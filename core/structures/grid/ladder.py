"""The ladder of one ray in a grid: what the 3D DDA knows in each cell (lecture, "Grid traversal").

The walk itself keeps the t of the next wall of each system, see :mod:`.dda`. From the same kernels
come, to the bit, the t of all walls ahead; the lecture's Lx, Ly, Lz are what is left up to there,
and Dx, Dy, Dz what lies between two walls of a system.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...geometry.rays import Rays, make_probe
from ...kernels import call, kernel
from .broad import is_broad
from .dda import X, Y, Z, axis_walk, wall_t


class Ladder(NamedTuple):
    """What the walk knows in each of n cells.

    Attributes
    ----------
    cell : (n, 3) int64
        [i, j, k] of each.
    walls : (n, 3) float64
        The t at which the next wall across x, y and z is crossed; inf if it never is.
    spacing : (3,) float64
        Dx, Dy, Dz: the t between two walls of a system; inf if none is crossed.
    """

    cell: np.ndarray
    walls: np.ndarray
    spacing: np.ndarray


@kernel
def find_walls_ahead(grid, geometry, rays, index, out):
    """Write the t of the next walls of cells; return whether this ray is not walked in cells."""
    ray = make_probe(rays, 0, geometry.reach)
    x = axis_walk(grid, X, ray.low_x, ray.high_x, ray.dx, ray.ix)
    y = axis_walk(grid, Y, ray.low_y, ray.high_y, ray.dy, ray.iy)
    z = axis_walk(grid, Z, ray.low_z, ray.high_z, ray.dz, ray.iz)
    for n in range(index.shape[0]):
        out[n, 0] = wall_t(x, index[n, 0])
        out[n, 1] = wall_t(y, index[n, 1])
        out[n, 2] = wall_t(z, index[n, 2])
    return is_broad(grid, ray)


def ladder_of(grid: Any, geometry: Any, rays: Rays, cells: np.ndarray) -> Ladder:
    """Return the ladder of the first ray of a batch.

    Parameters
    ----------
    grid : GridArrays or LazyGridArrays
    cells : (n,) int
        Numbers of cells that it enters.

    Raises
    ------
    InputError
        For a ray from so far away that it is not walked from wall to wall (:mod:`.broad`).
    """
    index = np.stack(np.unravel_index(cells, tuple(grid.resolution)), axis=1).astype(np.int64)
    walls = np.empty((len(cells), 3))
    arrays = rays.select(np.array([0])).arrays()
    if call(find_walls_ahead, grid, geometry, arrays, np.ascontiguousarray(index), walls):
        raise InputError(
            "this ray comes from too far away to be followed from wall to wall; choose one that "
            "starts nearer to the scene"
        )
    with np.errstate(divide="ignore", over="ignore"):
        return Ladder(index, walls, grid.cell_size / np.abs(rays.directions[0]))
