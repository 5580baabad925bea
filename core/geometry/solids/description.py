"""Elementary solids as they are described; kernels see them as :class:`..mixed.Mixed`.

A solid keeps its place and size in its own words: a sphere has a centre and a radius. *Placed*, it
is seen through an affine matrix, so that a sphere may become an ellipsoid.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

Point = Sequence[float] | np.ndarray
"""(3,) float."""


class Sphere(NamedTuple):
    """All points at most `radius` from `centre`; its surface is hit, from inside too."""

    centre: Point
    radius: float


class Cone(NamedTuple):
    """A cone from the circle around `base` to that around `apex`, both at right angles to its axis.

    With equal radii it is a cylinder, with an apex_radius of 0 a whole cone, else a truncated one.

    Attributes
    ----------
    base, apex : (3,) float
        Ends of the axis.
    base_radius, apex_radius : float
    is_capped : bool
        Whether its two ends are closed by discs.
    """

    base: Point
    apex: Point
    base_radius: float
    apex_radius: float
    is_capped: bool = True


class Box(NamedTuple):
    """A box along the axes."""

    lower: Point
    upper: Point


class Disc(NamedTuple):
    """A flat round plate at right angles to `normal`, which need not have unit length."""

    centre: Point
    normal: Point
    radius: float


class Polygon(NamedTuple):
    """A planar polygon of three corners or more, in order; it may be concave."""

    corners: Sequence[Point] | np.ndarray


class Triangle(NamedTuple):
    """A triangle at rest, (3, 3)."""

    corners: Sequence[Point] | np.ndarray


class MovingTriangle(NamedTuple):
    """A triangle whose corners move along straight lines: at time 0 at `start`, at 1 at `end`."""

    start: Sequence[Point] | np.ndarray
    end: Sequence[Point] | np.ndarray


class Placed(NamedTuple):
    """A sphere, cone, box or disc seen through a matrix.

    Attributes
    ----------
    solid : Sphere, Cone, Box or Disc
    matrix : (3, 4) float
        From the solid's own space to the scene's: a linear part and a translation.
    """

    solid: Sphere | Cone | Box | Disc
    matrix: Sequence[Sequence[float]] | np.ndarray


Item = Sphere | Cone | Box | Disc | Polygon | Triangle | MovingTriangle | Placed
"""What a scene at object level is made of."""


def moved_item(item: Item, matrix: np.ndarray) -> Item:
    """Return an item seen through an affine matrix, (3, 4) or (4, 4) float64."""
    if np.array_equal(matrix[:3], np.eye(3, 4)):
        return item
    if isinstance(item, Placed):
        inner = np.vstack([np.asarray(item.matrix, dtype=np.float64), [0.0, 0.0, 0.0, 1.0]])
        return Placed(item.solid, matrix[:3] @ inner)
    if isinstance(item, (Sphere, Cone, Box, Disc)):
        return Placed(item, matrix[:3])
    # What has corners.
    return type(item)(
        *(np.asarray(each, np.float64) @ matrix[:3, :3].T + matrix[:3, 3] for each in item)
    )
