"""Classes of rays: those that begin in one cell of a grid and go through one square of a cube.

The grid divides the scene's box; a ray that begins outside is of the cell in which it enters. The
cube has six faces, one for each main direction, of n x n squares each: of slopes u and v, as in
:mod:`..ray_classification.ray_space`. So a class is a cell of 5D ray space, but of a regular grid
there: its number is computed, nothing is searched.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inlined, whole
from ..ray_classification.ray_space import ROOTS, U, V, component

BOUNDS = 6
"""Intervals of a beam; the last is the time, which classes do not divide."""


class Classes(NamedTuple):
    """How ray space is divided.

    Attributes
    ----------
    box : (1, 6) float64
        Around the scene.
    grid : (3,) int64
        Cells along each axis.
    squares : int
        Along the edge of a face of the cube.
    """

    box: np.ndarray
    grid: np.ndarray
    squares: int


def classes_of(box: np.ndarray, cells: int, squares: int) -> Classes:
    """Return classes of a box, (6,): cubic cells, so many along its longest side."""
    size = box[3:] - box[:3]
    longest = float(size.max()) or 1.0
    grid = np.maximum(np.ceil(cells * size / longest), 1.0).astype(np.int64)
    return Classes(box[None].copy(), grid, squares)


def count_of(classes: Classes) -> int:
    """Return how many classes there are."""
    return ROOTS * classes.squares**2 * int(np.prod(classes.grid))


@inlined
def cell_along(classes, axis, x):
    """Return the cell of the grid along an axis in which a coordinate lies, or the nearest one."""
    low, high, cells = classes.box[0, axis], classes.box[0, 3 + axis], classes.grid[axis]
    share = (x - low) / (high - low) if high > low else 0.0
    cell = whole(share * cells)
    return whole(0) if cell < 0 else (cells - 1 if cell >= cells else cell)


@inlined
def square_along(classes, slope):
    """Return the square along an edge of a face in which a slope lies."""
    square = whole(0.5 * (slope + 1.0) * classes.squares)
    last = whole(classes.squares - 1)
    return last if square > last else square


@inlined
def class_of(classes, ray, start):
    """Return the class of a ray that begins, or enters the box, at a t."""
    a = whole(ray.kz)
    along = component(a, ray.dx, ray.dy, ray.dz)
    u = component((a + 1) % 3, ray.dx, ray.dy, ray.dz) / abs(along)
    v = component((a + 2) % 3, ray.dx, ray.dy, ray.dz) / abs(along)
    root = 2 * a + (1 if along < 0.0 else 0)
    x = cell_along(classes, 0, ray.ox + start * ray.dx)
    y = cell_along(classes, 1, ray.oy + start * ray.dy)
    z = cell_along(classes, 2, ray.oz + start * ray.dz)
    n, grid = classes.squares, classes.grid
    square = (root * n + square_along(classes, u)) * n + square_along(classes, v)
    return ((square * grid[0] + x) * grid[1] + y) * grid[2] + z


def bounds_of(classes: Classes, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the intervals of classes, (n, 2, BOUNDS) as those of cells of ray space, and the
    root of each, (n,) int64.
    """
    low, high, n = classes.box[0, :3], classes.box[0, 3:], classes.squares
    roots, *squares, x, y, z = np.unravel_index(numbers, (ROOTS, n, n, *classes.grid.tolist()))
    bounds = np.zeros((len(numbers), 2, BOUNDS))
    for side in range(2):
        shares = (np.stack([x, y, z], axis=1) + side) / classes.grid
        bounds[:, side, :3] = low + (high - low) * shares
        bounds[:, side, U : V + 1] = 2.0 * (np.stack(squares, axis=1) + side) / n - 1.0
    return bounds, roots
