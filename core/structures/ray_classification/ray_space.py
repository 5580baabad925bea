"""Ray space: where a ray is, as a point of five or six dimensions, and the cells there.

A ray is classified by the face of a cube that its direction goes through, one of six *roots*: its
largest component has the axis a, and its sign. Let b and c be the two axes that follow. Then five
numbers say the rest: the point x, y, z at which it begins, or enters the scene's box, and slopes

    u = d_b / |d_a|        v = d_c / |d_a|        both from -1 to 1.

The sixth is the time at which it is under way. A *cell* is a box of these: an interval of each. All
of its rays together are a pencil, or *beam* (:mod:`.beam`).

Roots are divided in two, again and again, across one of the dimensions, where many rays are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.events import NONE, VISIT_INNER, note
from ...geometry.rays import ULPS
from ...kernels import inlined, whole

X, Y, Z, U, V, TIME = range(6)
"""Dimensions of ray space."""

ROOTS = 6
"""Rays that run up the axes x, y, z are in the roots 0, 2, 4, those that run down in 1, 3, 5."""

LEAF, UNMADE = -1, -2
"""As first child: of a cell that is not divided, and of one that no ray has come to."""

NO_LIST = -1
"""As begin of the list of a cell that is not made, or whose list was thrown away."""

FARTHEST = 64.0
"""Rays may begin so many times farther away than the scene reaches; what lies farther is rounded
so much that its cell is not known for certain."""


class Cells(NamedTuple):
    """The cells of ray space that there are, as walks see them.

    Attributes
    ----------
    box : (1, 6) float64
        Around the scene.
    slack : float
        How far off a ray may be of its own line, as its cell knows it.
    children : (n,) int32
        First of the two children of a cell; LEAF, or UNMADE. Cell i < ROOTS is a root.
    dimension : (n,) int32
    plane : (n,) float64
        Across which dimension an inner cell is divided, and where.
    first, last : (n,) int64
        A cell lists the references ``first <= k < last``; NO_LIST if it has no list now.
    references : (m,) int32
        Places of items in the geometry, those first that begin first along the axis of the root.
    nearest : (ROOTS, n_items) float64
        Where each item begins along the axis of each root, counted the way its rays run.
    used : (n,) int32
        The last pass in which a ray came to the cell.
    now : int
        The pass of now.
    is_open : (n,) uint8
        1 for a cell of which it is still to be decided whether the rays of this batch divide it.
    normals : (n_items, 3) float64
        See :func:`.back_faces.normals_of`; none if backs are hit, too.
    """

    box: np.ndarray
    slack: float
    children: np.ndarray
    dimension: np.ndarray
    plane: np.ndarray
    first: np.ndarray
    last: np.ndarray
    references: np.ndarray
    nearest: np.ndarray
    used: np.ndarray
    now: int
    is_open: np.ndarray
    normals: np.ndarray


def slack_of(reach: np.ndarray) -> float:
    """Return how far off its line a ray may be that begins up to FARTHEST times as far away."""
    return float(2.0 * FARTHEST * ULPS * reach.max())


@inlined
def is_known(cells, ray):
    """Say whether a ray begins near enough for its cell to be known."""
    slack = max(ray.low_x - ray.ox, max(ray.low_y - ray.oy, ray.low_z - ray.oz))
    return 2.0 * slack <= cells.slack


@inlined
def within(x, low, high):
    """Return the number of an interval that is nearest to x."""
    return low if x < low else (high if x > high else x)


@inlined
def component(axis, x, y, z):
    """Return one of three numbers."""
    return x if axis == 0 else (y if axis == 1 else z)


@inlined
def find_cell(cells, ray, start, log):
    """Return the cell of a ray that is not divided, or not made yet, and how many lie above.

    Parameters
    ----------
    start : float
        The t at which the ray begins, or enters the box.
    """
    box = cells.box
    a = whole(ray.kz)
    x = within(ray.ox + start * ray.dx, box[0, 0], box[0, 3])
    y = within(ray.oy + start * ray.dy, box[0, 1], box[0, 4])
    z = within(ray.oz + start * ray.dz, box[0, 2], box[0, 5])
    along = component(a, ray.dx, ray.dy, ray.dz)
    b, c = (a + 1) % 3, (a + 2) % 3
    u = component(b, ray.dx, ray.dy, ray.dz) / abs(along)
    v = component(c, ray.dx, ray.dy, ray.dz) / abs(along)
    cell, steps = whole(2 * a + (along < 0.0)), 0
    while cells.children[cell] >= 0:
        note(log, VISIT_INNER, cell, NONE, start, start)
        dimension = cells.dimension[cell]
        place = ray.time
        if dimension < U:
            place = component(dimension, x, y, z)
        elif dimension < TIME:
            place = u if dimension == U else v
        cell = whole(cells.children[cell]) + (place >= cells.plane[cell])
        steps += 1
    return cell, steps
