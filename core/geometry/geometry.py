"""Geometries: what structures are built over, and what their leaves ask.

A *geometry* is a NamedTuple of arrays that holds any number of items of one kind. Structures work
over the boxes of items; kernels that have to know more call one of the dispatched kernels here, of
which every kind has its own: :class:`.triangle.Triangles`, :class:`.solids.mixed.Mixed`. A new kind
implements them, and every structure holds it.

Every geometry has ``ids``, (n,) int32: the number of each item in the scene, by which ties are
decided; and ``reach``, (3,) float64: how far it extends, for the slack of rays.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..kernels import dispatched

EVERY_OBJECT = 0xFF
"""The mask of a ray that meets instances whatever their masks, and of such an instance."""


@dispatched
def intersect(geometry, index, ray, limit, number, workspace, log):
    """Return where a ray hits an item.

    Parameters
    ----------
    geometry : NamedTuple of arrays
        Decides the implementation.
    index : int
        Place of the item in the geometry.
    ray : Ray
    limit : float
        A hit beyond is of no use. Where it costs nothing to know one, it may be returned.
    number : int
        Of the ray, unique in this workspace.
    workspace : Workspace
    log : Log

    Returns
    -------
    t : float
        The lowest from t_min on, within the interval of the item's own box; NO_HIT for a miss.
    primitive : int
        The number by which a tie is decided, and which the hit is known by.
    """
    raise TypeError(f"no intersect for {type(geometry).__name__}")


@dispatched
def overlaps(geometry, index, box):
    """Say whether an item and a box, (6,), have a common point; more may be said to than do."""
    raise TypeError(f"no overlaps for {type(geometry).__name__}")


@dispatched
def support(geometry, index, x, y, z):
    """Return the point of an item, (x, y, z), that is farthest in a direction, as rounded."""
    raise TypeError(f"no support for {type(geometry).__name__}")


@dispatched
def interval(geometry, index, ray):
    """Return the t at which the line of a ray enters an item, and leaves it; all are convex.

    Both are of any sign. Of what is missed, or is a surface without an inside, the first is larger.
    """
    raise TypeError(f"no interval for {type(geometry).__name__}")


@dispatched
def clip_box(geometry, index, cell, box, polygon):
    """Shrink a box that holds the part of an item in a cell, (6,) each, as far as is known.

    Parameters
    ----------
    cell : (6,) float64
    box : (6,) float64
        In the cell; changed.
    polygon : (2 * POLYGON_SIZE, 3) float64
        Scratch.
    """
    raise TypeError(f"no clip_box for {type(geometry).__name__}")


@functools.singledispatch
def in_order(geometry: Any, order: np.ndarray) -> Any:
    """Return a geometry's items in an order, as the leaves of a structure want them.

    Parameters
    ----------
    order : (m,) int
        Places of items; with spatial splits some come twice.
    """
    raise TypeError(f"no order for {type(geometry).__name__}")


@functools.singledispatch
def boxes_around(geometry: Any) -> np.ndarray:
    """Return the box of every item, (n, 6) float64."""
    raise TypeError(f"no boxes around {type(geometry).__name__}")


@functools.singledispatch
def hulls_of(geometry: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles whose corners have every item in their hull, to fit volumes around it.

    Returns
    -------
    corners : (m, 3, 3) float64
    offsets : (n + 1,) int64
        Item i has ``corners[offsets[i]:offsets[i + 1]]``.
    """
    raise TypeError(f"no hulls of {type(geometry).__name__}")


@functools.singledispatch
def joined(first: Any, others: Sequence[Any]) -> Any:
    """Return the items of several geometries of one kind, one geometry after the other."""
    raise TypeError(f"no joining of {type(first).__name__}")


@functools.singledispatch
def normals_at(
    geometry: Any, primitives: np.ndarray, points: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return unit normals where rays have hit, (n, 3).

    Those of a solid point outward. Those of a triangle or polygon point to where its corners run
    counter-clockwise, of a disc along the normal that it was given; of an instance, as they do in
    its mesh. Only sums, products, quotients and square roots go into them, of numbers that are the
    same everywhere.

    Parameters
    ----------
    primitives : (n,) int
        What was hit.
    points : (n, 3) float64
        Where; rounded.
    times : (n,) float64
        When.
    """
    raise TypeError(f"no normals of {type(geometry).__name__}")


def moved_by(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors, (n, 3), each multiplied by a matrix of its own, (n, 3, 3).

    In the order of the sums as they are written: a product of matrices may round otherwise on
    another machine.
    """
    x, y, z = vectors.T
    columns = matrices[:, :, 0], matrices[:, :, 1], matrices[:, :, 2]
    return columns[0] * x[:, None] + columns[1] * y[:, None] + columns[2] * z[:, None]


@functools.singledispatch
def lines_of(
    geometry: Any, primitives: np.ndarray, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return lines that show where primitives are.

    Parameters
    ----------
    primitives : (n,) int
        As hits know them.
    time : float
        Of what moves.

    Returns
    -------
    segments : (m, 2, 3) float64
    owners : (m,) int64
        Place among `primitives` of what each belongs to, ascending.
    """
    raise TypeError(f"no outlines of {type(geometry).__name__}")
