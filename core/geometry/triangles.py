"""Triangles as a geometry; how a ray meets one is told in :mod:`.triangle`.

What is compiled is imported where it is used: a scene has triangles, and whoever only has a scene
does not wait for Numba.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..kernels import call
from ..parallel import Team
from ..progress import SILENT
from .geometry import boxes_around, hulls_of, in_order, joined, lines_of, normals_at

THIN = 2.0**-7
"""Share of a scene's largest coordinate below which those along another axis count for more."""


class Triangles(NamedTuple):
    """Triangles as the kernels see them, in any order.

    Attributes
    ----------
    corners : (n, 3, 3) float64
    ids : (n,) int32
        Index of each in the scene; decides ties.
    reach : (3,) float64
        Largest absolute coordinate of the whole scene per axis, for the slack of rays. Along an
        axis that is thin, but not flat, half of the largest of all: the test shears corners along
        the ray, and so rounds there by what they measure along others.
    """

    corners: np.ndarray
    ids: np.ndarray
    reach: np.ndarray


def extent(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper corner, (3,) each, of the box around triangles, (n, 3, 3).

    NaN along an axis where a corner is that.
    """
    # Axis by axis: over all three at once NumPy takes eight times as long.
    axes = [corners[:, :, axis] for axis in range(3)]
    return np.array([each.min() for each in axes]), np.array([each.max() for each in axes])


def all_triangles(corners: np.ndarray) -> Triangles:
    """Return triangles, (n, 3, 3), as a geometry, in the order in which they are."""
    lower, upper = extent(corners)
    ids = np.arange(len(corners), dtype=np.int32)
    return Triangles(corners, ids, reach_of(lower, upper))


def reach_of(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the reach, (3,), of what lies in a box."""
    reach = np.maximum(np.abs(lower), np.abs(upper))
    reach[(upper > lower) & (reach < THIN * reach.max())] = 0.5 * reach.max()
    return reach


@in_order.register
def _(geometry: Triangles, order: np.ndarray) -> Triangles:
    from .collinear import copy_triangles

    order = order.astype(np.int32, copy=False)
    corners = np.empty((len(order), 3, 3))
    with Team(SILENT, "Copying triangles") as team:
        team.run(
            lambda first, last: call(copy_triangles, geometry.corners, order, corners, first, last),
            len(order),
        )
    return Triangles(corners, order, geometry.reach)


@joined.register
def _(first: Triangles, others: Sequence[Triangles]) -> Triangles:
    parts = [first, *others]
    return Triangles(
        np.concatenate([part.corners for part in parts]),
        np.concatenate([part.ids for part in parts]), np.maximum.reduce([p.reach for p in parts]),
    )  # fmt: skip


@boxes_around.register
def _(geometry: Triangles) -> np.ndarray:
    from .box import boxes_of

    return boxes_of(geometry.corners)


@hulls_of.register
def _(geometry: Triangles) -> tuple[np.ndarray, np.ndarray]:
    return geometry.corners, np.arange(len(geometry.corners) + 1)


@normals_at.register
def _(
    geometry: Triangles, primitives: np.ndarray, points: np.ndarray, times: np.ndarray
) -> np.ndarray:
    # A power of two changes no bit of the result; without it, areas of very large and very small
    # scenes leave the range of float64.
    _, exponent = np.frexp(geometry.reach.max())
    corners = geometry.corners[primitives]
    edges = np.ldexp(corners[:, 1:] - corners[:, :1], -exponent)
    normals = np.cross(edges[:, 0], edges[:, 1])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@lines_of.register
def _(
    geometry: Triangles, primitives: np.ndarray, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    sides = geometry.corners[primitives][:, [(0, 1), (1, 2), (2, 0)]]
    return sides.reshape(-1, 2, 3), np.repeat(np.arange(len(primitives)), 3)
