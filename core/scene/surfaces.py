"""Surfaces that rays have hit, as the rays that go on from there see them."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from ..geometry.geometry import normals_at
from ..geometry.rays import Rays
from . import Scene

OFF_THE_FACE = 1e-9
"""How far off the face a new ray starts, relative to the scene's diagonal."""

ULPS_OFF_THE_FACE = 32 * np.finfo(np.float64).eps
"""The same relative to the largest coordinate of the hit and of the ray's origin.

Far from the origin of the coordinates this is more. The point ``o + t d`` lies off its triangle by
the roundings of t, of the product and of the sum, four units in the last place of those
coordinates, and by as much more for a face that is seen edge-on; the new ray's own test has a
slack of 8 units at the origin and 8 at the triangle. 32 is more than all of that together.
"""

CHUNK = 1 << 15
"""New rays that are made together: some ten milliseconds between two looks whether to stop."""


class Found(Protocol):
    """What rays have hit, as :class:`..contract.structure.Hits` has it."""

    @property
    def t(self) -> np.ndarray:
        """Where, (n,) float64; inf for a miss."""

    @property
    def primitive(self) -> np.ndarray:
        """What, (n,) int; -1 for a miss."""


class Surfaces(NamedTuple):
    """Where some rays of a batch have hit: a row for each.

    A face seen exactly edge-on shows neither of its sides, and has the normal zero.

    Attributes
    ----------
    rays : (n,) int64
        Numbers of the rays in their batch.
    points : (n, 3) float64
        Where they have hit, rounded.
    normals : (n, 3) float64
        Unit normals on the side that the ray comes from.
    offsets : (n,) float64
        How far along the normal a new ray starts on this side, so as not to hit the face again; or
        against the normal, on the other side.
    is_inside : (n,) bool
        Whether the ray comes from the inside. A sphere, a box and a capped cone have one; the
        inside of what is made of faces is behind them, where their corners run clockwise. So an
        open face that is hit from its front is entered, and never left.
    """

    rays: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    is_inside: np.ndarray


def surfaces_hit(scene: Scene, rays: Rays, hits: Found, numbers: np.ndarray) -> Surfaces:
    """Return the surfaces that the rays of some numbers, (n,), have hit; all of them have.

    Only sums, products, quotients and square roots go into it: the result is the same everywhere.
    """
    directions, origins = rays.directions[numbers], rays.origins[numbers]
    primitives = hits.primitive[numbers]
    points = origins + hits.t[numbers, None] * directions
    with np.errstate(invalid="ignore", divide="ignore"):
        normals = normals_at(scene.geometry, primitives, points, rays.times[numbers])
    normals[~np.isfinite(normals).all(axis=1)] = 0.0  # of a face too small to have one
    along = (normals * directions).sum(1)
    normals *= -np.sign(along)[:, None]
    reach = np.maximum(np.abs(points), np.abs(origins)).max(axis=1, initial=0.0)
    offsets = np.maximum(OFF_THE_FACE * scene.diagonal, ULPS_OFF_THE_FACE * reach)
    is_inside = (along > 0.0) ^ (scene.is_turned(primitives) & (along != 0.0))
    return Surfaces(numbers, points, normals, offsets, is_inside)
