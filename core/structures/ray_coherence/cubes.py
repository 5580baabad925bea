"""Cubes of directions in the spheres of items and lights, and the one that a ray belongs to.

A ray that leaves an item belongs to the cube of that, and to the cell through which its direction
goes. A shadow ray may as well be seen from its other end: backwards it leaves the sphere of its
light. That is the better end, for most lights are points, and see less of everything.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inlined, whole
from ..directional.faces import face_towards
from ..directional.lists import step_along

NONE = -1

NO_LIST = -1
"""As begin of a list that was thrown away."""


class Cubes(NamedTuple):
    """The cubes that rays have come to, as walks see them.

    Attributes
    ----------
    balls : (m, 4) float64
        Centre and radius: of all items, then of all lights.
    n_items : int
    starts : (k,) int64
        Over instances, the number of the first primitive of each; empty where primitives are items.
    slack : float
        How far outside of its sphere a ray may start, or hit.
    size : (m,) int32
        Cells along an edge of a face, of each sphere.
    stride : int
        More cells than any cube has.
    cube : (m,) int64
        Where the cells of each sphere's cube begin; NONE if no ray has come to it.
    number : (k,) int32
        The list of each cell; NONE if there is none.
    first, last : (n_lists,) int64
        List k has the references ``first[k] <= slot < last[k]``.
    references : (n,) int32
        Places of items in the geometry.
    nearest : (n,) float64
        How far from any point of the cube's sphere each is at least.
    """

    balls: np.ndarray
    n_items: int
    starts: np.ndarray
    slack: float
    size: np.ndarray
    stride: int
    cube: np.ndarray
    number: np.ndarray
    first: np.ndarray
    last: np.ndarray
    references: np.ndarray
    nearest: np.ndarray


class Belongs(NamedTuple):
    """Where a ray belongs.

    Attributes
    ----------
    sphere : int
        NONE if it is known neither from where it comes nor where it goes.
    cell : int
        Of the sphere's cube.
    is_backward : bool
        Whether it is seen from its end.
    """

    sphere: int | np.integer
    cell: int | np.integer
    is_backward: bool


@inlined
def is_in(cubes, sphere, x, y, z):
    """Say whether a point is in a sphere."""
    ball = cubes.balls[sphere]
    x, y, z, radius = x - ball[0], y - ball[1], z - ball[2], ball[3] + cubes.slack
    return x * x + y * y + z * z <= radius * radius


@inlined
def item_of(cubes, primitive):
    """Return the item that a primitive is of."""
    if len(cubes.starts) == 0 or primitive < 0:
        return whole(primitive)
    low, high = whole(0), whole(len(cubes.starts))
    while high - low > 1:
        middle = (low + high) // 2
        if cubes.starts[middle] <= primitive:
            low = middle
        else:
            high = middle
    return low


@inlined
def cell_towards(size, x, y, z):
    """Return the cell of a cube that a direction goes through."""
    face = whole(face_towards(0, x, y, z))
    a, b, c = x, y, z
    if face >= 4:
        a, b, c = z, x, y
    elif face >= 2:
        a, b, c = y, z, x
    i, _ = step_along(b / abs(a), size)
    j, _ = step_along(c / abs(a), size)
    return (face * size + j) * size + i


@inlined
def belongs_to(cubes, ray):
    """Return the cube and the cell of a ray.

    It has to start in the sphere that it says it leaves, or to end in that of its light.
    """
    light = whole(ray.target)
    if 0 <= light < len(cubes.balls) - cubes.n_items and ray.t_max < np.inf:
        end, sphere = ray.t_max, cubes.n_items + light
        if is_in(
            cubes, sphere, ray.ox + end * ray.dx, ray.oy + end * ray.dy, ray.oz + end * ray.dz
        ):
            size = whole(cubes.size[sphere])
            return Belongs(sphere, cell_towards(size, -ray.dx, -ray.dy, -ray.dz), True)
    item = item_of(cubes, ray.source)
    if 0 <= item < cubes.n_items and is_in(cubes, item, ray.ox, ray.oy, ray.oz):
        size = whole(cubes.size[item])
        return Belongs(item, cell_towards(size, ray.dx, ray.dy, ray.dz), False)
    return Belongs(whole(NONE), whole(NONE), False)


@inlined
def list_at(cubes, sphere, cell):
    """Return the number of a cell's list, NONE if there is none now."""
    begin = whole(cubes.cube[sphere])
    if begin < 0:
        return whole(NONE)
    number = whole(cubes.number[begin + cell])
    if number >= 0 and cubes.first[number] < 0:
        return whole(NONE)
    return number


def squares_of(
    size: np.ndarray, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return u and v of the lower corners of cells, their widths, and the face of each, (n,).

    Parameters
    ----------
    size : (n,) int
        Cells along an edge of a face of the cube that each is of.
    """
    size, cells = np.asarray(size, np.int64), np.asarray(cells, np.int64)
    width = 2.0 / size
    u, v = -1.0 + width * (cells % size), -1.0 + width * (cells // size % size)
    return u, v, width, cells // size**2
