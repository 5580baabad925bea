"""What a cone or a pyramid is: an axis, which has all that a ray has, and what is around it.

Seen along its axis, one unit before the apex, a round cone is a circle. It may be an ellipse, too,
or a rectangle, and then is a pyramid. Scaled by its two half-widths each of them is a unit circle
or a square of side 2, and that is how items are asked. Volumes, and cells, are asked by the round
cone around it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...kernels import implements
from ..rays import ALL, RayArrays, Rays, make_probe, make_ray


class ConeArrays(NamedTuple):
    """A batch of cones inside kernels.

    Attributes
    ----------
    rays : RayArrays
        The axes.
    slopes : (n,) float64
        Tangents of the angles between the axis and the side of the round cone around each.
    across, above : (n, 3) float64
        At right angles to the axis and to each other, each divided by the half-width along it.
    is_square : (n,) bool
        Whether it is a pyramid.
    """

    rays: RayArrays
    slopes: np.ndarray
    across: np.ndarray
    above: np.ndarray
    is_square: np.ndarray


class Cone(NamedTuple):
    """One cone inside kernels: first what a :class:`..rays.Ray` has, of its axis.

    Named one by one, since Numba does not put one record into another; a test compares them.

    Attributes
    ----------
    ux, uy, uz : float
        Unit vector along the axis.
    length : float
        Of the direction: a point at t is t * length away from the apex along the axis.
    slope : float
        Tangent of the angle between the axis and the side of the round cone around it.
    ax, ay, az, bx, by, bz : float
        See `across` and `above` of :class:`ConeArrays`.
    is_square : bool
    """

    ox: float
    oy: float
    oz: float
    dx: float
    dy: float
    dz: float
    ix: float
    iy: float
    iz: float
    low_x: float
    low_y: float
    low_z: float
    high_x: float
    high_y: float
    high_z: float
    kx: np.uint64
    ky: np.uint64
    kz: np.uint64
    okx: float
    oky: float
    okz: float
    shear_x: float
    shear_y: float
    shear_z: float
    t_min: float
    t_max: float
    query: int
    time: float
    mask: int
    source: int
    target: int
    ux: float
    uy: float
    uz: float
    length: float
    slope: float
    ax: float
    ay: float
    az: float
    bx: float
    by: float
    bz: float
    is_square: bool


ROUND, SQUARE = "cone", "pyramid"


@dataclass(frozen=True)
class Spread:
    """What is around an axis.

    Attributes
    ----------
    half_angle : float
        Between the axis and the side, in radians.
    other : float or None
        The same at right angles to that; None for as much.
    shape : {"cone", "pyramid"}
    across : (3,) float64 or None
        Where `half_angle` is seen, as far as that is at right angles to the axis; None for any.
    """

    half_angle: float
    other: float | None = None
    shape: str = ROUND
    across: np.ndarray | None = None

    @property
    def is_circular(self) -> bool:
        """Whether it is a round cone, alike all around its axis."""
        return self.shape == ROUND and self.other in (None, self.half_angle)

    def half_widths(self) -> tuple[float, float]:
        """Return the half-widths one unit before the apex.

        Raises
        ------
        InputError
            If an angle is none.
        """
        angles = self.half_angle, self.half_angle if self.other is None else self.other
        if not all(0.0 < angle < 0.5 * np.pi for angle in angles):
            raise InputError(f"the angle of a {self.shape} must be above 0 and below 90 degrees")
        return float(np.tan(angles[0])), float(np.tan(angles[1]))

    def axes(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unit vectors across each axis, (n, 3), and at right angles to both."""
        units = directions / np.abs(directions).max(axis=1, keepdims=True)
        units /= np.linalg.norm(units, axis=1, keepdims=True)
        if self.across is None:
            beside = np.eye(3)[np.abs(units).argmin(axis=1)]
        else:
            beside = np.broadcast_to(self.across, units.shape)
        across = beside - (beside * units).sum(axis=1)[:, None] * units
        lengths = np.linalg.norm(across, axis=1, keepdims=True)
        if not (lengths > 1e-9 * np.linalg.norm(beside, axis=1, keepdims=True)).all():
            raise InputError("a cone is not spread along its own axis; choose another 'across'")
        across /= lengths
        return across, np.cross(units, across)


def cones_around(rays: Rays, spread: Spread) -> ConeArrays:
    """Return cones, or pyramids, whose axes are rays.

    Raises
    ------
    InputError
        If an angle is none, or the spread is along an axis.
    """
    arrays = rays.arrays()._replace(queries=np.full(len(rays), ALL, dtype=np.uint8))
    wide, high = spread.half_widths()
    across, above = spread.axes(rays.directions)
    is_square = spread.shape == SQUARE
    slope = float(np.hypot(wide, high)) if is_square else max(wide, high)
    return ConeArrays(
        arrays, np.full(len(rays), slope), np.ascontiguousarray(across / wide),
        np.ascontiguousarray(above / high), np.full(len(rays), is_square),
    )  # fmt: skip


@implements(make_probe, ConeArrays)
def make_cone(cones, index, reach):
    """Make the axis, then what a cone has beside it."""
    r = make_ray(cones.rays, index, reach)
    largest = max(abs(r.dx), abs(r.dy), abs(r.dz))
    x, y, z = r.dx / largest, r.dy / largest, r.dz / largest
    length = (x * x + y * y + z * z) ** 0.5
    return Cone(
        r.ox, r.oy, r.oz, r.dx, r.dy, r.dz, r.ix, r.iy, r.iz, r.low_x, r.low_y, r.low_z,
        r.high_x, r.high_y, r.high_z, r.kx, r.ky, r.kz, r.okx, r.oky, r.okz,
        r.shear_x, r.shear_y, r.shear_z, r.t_min, r.t_max, r.query, r.time, r.mask,
        r.source, r.target, x / length, y / length, z / length, largest * length,
        cones.slopes[index],
        cones.across[index, 0], cones.across[index, 1], cones.across[index, 2],
        cones.above[index, 0], cones.above[index, 1], cones.above[index, 2],
        cones.is_square[index],
    )  # fmt: skip
