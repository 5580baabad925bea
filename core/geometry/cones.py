"""Cones and pyramids: probes that ask which items lie in a direction, give or take an angle.

A cone goes through the same walks as a ray: it has all that a ray has, its axis, and an angle
beside. Only two questions are answered otherwise: whether it reaches into a volume, and whether it
meets an item. The answer is not the nearest hit but everything that it meets.

Seen along its axis, one unit before the apex, a round cone is a circle. It may be an ellipse, too,
or a rectangle, and then is a pyramid. Scaled by its two half-widths each of them is a unit circle
or a square of side 2, and that is how items are asked. Volumes, and cells, are asked by the round
cone around it.

A volume is asked by the ball around it: a ball at some distance from the axis is out of reach when
it is farther from the cone's side than its radius. Items are asked exactly: a triangle meets a cone
if a part of an edge does, or if the axis pierces it.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..kernels import dispatched, implements, inner, whole
from .box import Boxes
from .combined import Intersection, Union
from .geometry import intersect
from .kdop import KDOPs
from .obb import OBBs
from .rays import ALL, Ray, RayArrays, Rays, make_probe, make_ray
from .sphere import SmallestSpheres, Spheres
from .triangle import NO_HIT
from .triangles import Triangles
from .volume import MISS, slack_of, span


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
    """One cone inside kernels: first what a :class:`.rays.Ray` has, of its axis.

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


# ------------------------------------------------------------------------------------- volumes


@dispatched
def ball_around(volumes, index):
    """Return the centre and the radius of a ball that contains a volume: x, y, z, r."""
    raise TypeError(f"no ball around {type(volumes).__name__}")


@inner
def ball_around_box(x0, y0, z0, x1, y1, z1):
    """Return the ball through the corners of a box."""
    x, y, z = 0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.5 * (z1 - z0)
    return x0 + x, y0 + y, z0 + z, (x * x + y * y + z * z) ** 0.5


@implements(ball_around, Boxes)
def ball_around_boxes(volumes, index):
    """Take that through the corners."""
    row = volumes.rows[index]
    return ball_around_box(row[0], row[1], row[2], row[3], row[4], row[5])


@implements(ball_around, KDOPs)
def ball_around_kdop(volumes, index):
    """Take that of the first three strips, which are a box."""
    row = volumes.rows[index]
    return ball_around_box(row[0], row[2], row[4], row[1], row[3], row[5])


@implements(ball_around, SmallestSpheres)
@implements(ball_around, Spheres)
def ball_around_sphere(volumes, index):
    """Take it as it is."""
    row = volumes.rows[index]
    return row[0], row[1], row[2], row[3]


@implements(ball_around, OBBs)
def ball_around_obb(volumes, index):
    """Take the middle along each of the three axes; they are of unit length."""
    row = volumes.rows[index]
    x, y, z, squared = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        half = 0.5 * (row[12 + i] - row[9 + i])
        middle = row[9 + i] + half
        x, y, z = x + middle * row[3 * i], y + middle * row[3 * i + 1], z + middle * row[3 * i + 2]
        squared += half * half
    return x, y, z, squared**0.5


@implements(ball_around, Intersection)
def ball_around_intersection(volumes, index):
    """Take the smaller of two."""
    a, b = ball_around(volumes.first, index), ball_around(volumes.second, index)
    return a if a[3] < b[3] else b


@implements(ball_around, Union)
def ball_around_union(volumes, index):
    """Enlarge the first until it contains the second."""
    x, y, z, r = ball_around(volumes.first, index)
    bx, by, bz, br = ball_around(volumes.second, index)
    apart = ((bx - x) ** 2 + (by - y) ** 2 + (bz - z) ** 2) ** 0.5
    return x, y, z, max(r, apart + br)


@inner
def reach_ball(cone, x, y, z, r, limit):
    """Return the t from and up to which a cone may be in a ball; a miss enters after it leaves."""
    r += slack_of(cone)
    x, y, z = x - cone.ox, y - cone.oy, z - cone.oz
    along = x * cone.ux + y * cone.uy + z * cone.uz
    px, py, pz = x - along * cone.ux, y - along * cone.uy, z - along * cone.uz
    across = (px * px + py * py + pz * pz) ** 0.5
    # With slope = sin / cos, both sides times the cosine's inverse.
    secant = (1.0 + cone.slope * cone.slope) ** 0.5
    if across - along * cone.slope > r * secant:
        return MISS, 0.0
    # Behind the apex the side is not the nearest.
    if along + across * cone.slope < 0.0 and along * along + across * across > r * r:
        return MISS, 0.0
    enter, leave = (along - r) / cone.length, (along + r) / cone.length
    enter = enter if enter > cone.t_min else cone.t_min
    return enter, leave if leave < limit else limit


def span_by_ball(volumes, index, probe, strips, limit):
    """Ask for the ball around the volume."""
    x, y, z, r = ball_around(volumes, index)
    return reach_ball(probe, x, y, z, r, limit)


for kind in (Boxes, KDOPs, OBBs, SmallestSpheres, Spheres, Intersection, Union):
    implements(span, kind, beside=Cone)(span_by_ball)


# --------------------------------------------------------------------------------------- items


@inner
def meets_segment(cone, ax, ay, az, bx, by, bz):
    """Say whether a segment, from a to b as seen from the apex and not behind it, meets a cone.

    With coordinates x and y in half-widths, a cone is where ``along^2 - x^2 - y^2 >= 0``: on the
    segment a parabola; a pyramid where neither of |x| and |y| is more than `along`.
    """
    along = ax * cone.ux + ay * cone.uy + az * cone.uz
    x = ax * cone.ax + ay * cone.ay + az * cone.az
    y = ax * cone.bx + ay * cone.by + az * cone.bz
    to_along = bx * cone.ux + by * cone.uy + bz * cone.uz
    to_x = bx * cone.ax + by * cone.ay + bz * cone.az
    to_y = bx * cone.bx + by * cone.by + bz * cone.bz
    if cone.is_square:
        begin, end = 0.0, 1.0
        for side in range(4):
            sign = 1.0 if side < 2 else -1.0
            h = along + sign * (x if side % 2 == 0 else y)
            to_h = to_along + sign * (to_x if side % 2 == 0 else to_y)
            if h < 0.0 and to_h < 0.0:
                return False
            if h < 0.0:
                begin = max(begin, h / (h - to_h))
            elif to_h < 0.0:
                end = min(end, h / (h - to_h))
        return begin <= end
    at_a = along * along - x * x - y * y
    at_b = to_along * to_along - to_x * to_x - to_y * to_y
    if at_a >= 0.0 or at_b >= 0.0:
        return True
    e, ex, ey = to_along - along, to_x - x, to_y - y
    curvature = e * e - ex * ex - ey * ey
    rise = along * e - x * ex - y * ey
    if curvature >= 0.0 or rise <= 0.0 or rise >= -curvature:
        return False
    return at_a - rise * rise / curvature >= 0.0


@inner
def axis_hit(geometry, index, c):
    """Return t of the axis and a triangle, NO_HIT beyond the cone's end."""
    axis = Ray(
        c.ox, c.oy, c.oz, c.dx, c.dy, c.dz, c.ix, c.iy, c.iz, c.low_x, c.low_y, c.low_z,
        c.high_x, c.high_y, c.high_z, c.kx, c.ky, c.kz, c.okx, c.oky, c.okz,
        c.shear_x, c.shear_y, c.shear_z, c.t_min, c.t_max, c.query, c.time, c.mask, c.source,
        c.target,
    )  # fmt: skip
    t, _ = intersect(geometry, index, axis, c.t_max, 0, 0, 0)
    return t if t <= c.t_max else NO_HIT


@implements(intersect, Triangles, beside=Cone)
def intersect_with_cone(geometry, index, cone, limit, number, workspace, log):
    """Return the least t at which a triangle may meet a cone, NO_HIT if it does not, and its id.

    Ask the parts of its edges that lie between the cone's ends, its parts there, and the axis.

    A plane cuts a cone in a curve. Where that does not meet the border of the triangle, the whole
    of it lies inside, and the axis with it, or outside.
    """
    corners, primitive = geometry.corners, whole(geometry.ids[index])
    low, high = cone.t_min * cone.length, cone.t_max * cone.length
    nearest, is_met, n_low, n_high = np.inf, False, 0, 0
    # Where the border crosses the two ends.
    lx, ly, lz, hx, hy, hz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for corner in range(3):
        following = corner + 1 if corner < 2 else 0
        ax = corners[index, corner, 0] - cone.ox
        ay = corners[index, corner, 1] - cone.oy
        az = corners[index, corner, 2] - cone.oz
        bx = corners[index, following, 0] - cone.ox
        by = corners[index, following, 1] - cone.oy
        bz = corners[index, following, 2] - cone.oz
        a = ax * cone.ux + ay * cone.uy + az * cone.uz
        b = bx * cone.ux + by * cone.uy + bz * cone.uz
        nearest = a if a < nearest else nearest
        if (a < low and b < low) or (a > high and b > high):
            continue
        begin, end = 0.0, 1.0
        if (a < low) != (b < low):
            share = (low - a) / (b - a)
            x, y, z = ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az)
            if n_low == 1:
                is_met = is_met or meets_segment(cone, lx, ly, lz, x, y, z)
            lx, ly, lz, n_low = x, y, z, n_low + 1
            begin, end = (share, end) if a < low else (begin, share)
        if (a > high) != (b > high):
            share = (high - a) / (b - a)
            x, y, z = ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az)
            if n_high == 1:
                is_met = is_met or meets_segment(cone, hx, hy, hz, x, y, z)
            hx, hy, hz, n_high = x, y, z, n_high + 1
            begin, end = (max(begin, share), end) if a > high else (begin, min(end, share))
        ex, ey, ez = bx - ax, by - ay, bz - az
        is_met = is_met or meets_segment(
            cone, ax + begin * ex, ay + begin * ey, az + begin * ez,
            ax + end * ex, ay + end * ey, az + end * ez,
        )  # fmt: skip
    t = nearest / cone.length
    t = t if t > cone.t_min else cone.t_min
    if is_met:
        return t, primitive
    return axis_hit(geometry, index, cone), primitive
