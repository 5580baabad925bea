"""The watertight ray-triangle test of Woop, Benthin and Wald (2013).

The triangle is moved so that the ray starts at the origin, then sheared so that the ray runs along
the axis of its largest direction component. What is left is a question in the plane: does the
triangle contain the origin? Three edge functions U, V, W answer it. An edge shared by two triangles
gives both of them the same number with opposite signs, so no ray slips through between them.

Seen edge-on, U, V and W are mostly rounding error, and so would be t. That is noticed and mended
(:func:`intersect_edge_on`): the point of a hit lies on the ray and within a few units in the last
place of the triangle, from wherever it is seen. Cells of a subdivision rely on it.

S. Woop, C. Benthin, I. Wald: Watertight Ray/Triangle Intersection, JCGT 2(1), 2013.
"""

from __future__ import annotations

import numpy as np

from ..kernels import implements, inlined, inner, whole
from .clip import clip, fit
from .geometry import clip_box, intersect, interval, overlaps, support
from .triangles import Triangles

NO_HIT = np.inf

EDGE_ON = 4 * np.finfo(np.float64).eps
"""How far from the ray a hit may be found, relative to the largest coordinate; half the slack of
rays, which has to hold the roundings of the corners too."""

FAINT = 1e-207
"""Determinants below this may have lost digits to underflow: the smallest number, 5e-324, is eps
times the smallest scene, 1e-100, times this."""

VAST = 1e300
"""Products above this may have overflown."""

SMALL, LARGER = 1e-30, 2.0**330
"""Triangles that look smaller than SMALL are looked at LARGER times larger where it matters."""


@implements(intersect, Triangles, inline=True)
def intersect_triangle(geometry, index, ray, limit, number, workspace, log):
    """Return the t at which the ray hits a triangle, or NO_HIT, and its id.

    Edges and corners belong to the triangle; zero-area triangles are never hit.
    """
    corners, primitive = geometry.corners, whole(geometry.ids[index])
    # Corners relative to the origin, sheared onto the ray's axis.
    az = corners[index, 0, ray.kz] - ray.okz
    bz = corners[index, 1, ray.kz] - ray.okz
    cz = corners[index, 2, ray.kz] - ray.okz
    ax = corners[index, 0, ray.kx] - ray.okx - ray.shear_x * az
    ay = corners[index, 0, ray.ky] - ray.oky - ray.shear_y * az
    bx = corners[index, 1, ray.kx] - ray.okx - ray.shear_x * bz
    by = corners[index, 1, ray.ky] - ray.oky - ray.shear_y * bz
    cx = corners[index, 2, ray.kx] - ray.okx - ray.shear_x * cz
    cy = corners[index, 2, ray.ky] - ray.oky - ray.shear_y * cz
    t = intersect_sheared(ax, ay, az, bx, by, bz, cx, cy, cz, ray, geometry.reach)
    if t == NO_HIT:
        return NO_HIT, primitive
    return clamp_to_own_box(corners, index, ray, t), primitive


@inlined
def intersect_sheared(ax, ay, az, bx, by, bz, cx, cy, cz, ray, reach):
    """Return the t at which a ray hits a triangle, or NO_HIT; not yet clamped.

    Parameters
    ----------
    ax, ay, az, ..., cz : float
        Corners relative to the ray's origin, sheared onto its axis.
    """
    # Edge functions: of one sign (or zero) all three, or the ray passes outside.
    u = cx * by - cy * bx
    v = ax * cy - ay * cx
    w = bx * ay - by * ax
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return NO_HIT
    determinant = u + v + w
    if determinant == 0.0:
        return NO_HIT
    along = u * az + v * bz + w * cz
    t = ray.shear_z * along
    # Directions may be so long or short that only the quotient is in the range of numbers.
    t = t / determinant if FAINT < abs(t) < VAST else ray.shear_z * (along / determinant)
    # U, V, W are weights of the corners. Do they lead to the ray?
    slack_x = EDGE_ON * (abs(ray.okx) + reach[ray.kx])
    slack_y = EDGE_ON * (abs(ray.oky) + reach[ray.ky])
    off_x, off_y = abs(u * ax + v * bx + w * cx), abs(u * ay + v * by + w * cy)
    size = abs(determinant)
    if off_x > slack_x * size or off_y > slack_y * size or size < FAINT:
        sheared = EDGE_ON * (abs(ray.okz) + reach[ray.kz])
        sheared_x, sheared_y = sheared * abs(ray.shear_x), sheared * abs(ray.shear_y)
        start = ray.t_min / ray.shear_z
        z = intersect_edge_on(
            ax, ay, az, bx, by, bz, cx, cy, cz, slack_x, slack_y, sheared_x, sheared_y,
            ray.shear_z, start,
        )  # fmt: skip
        t = ray.t_min if z == start else ray.shear_z * z
    if not (t >= ray.t_min):
        return NO_HIT
    return t


@inner
def intersect_edge_on(
    ax, ay, az, bx, by, bz, cx, cy, cz, slack_x, slack_y, sheared_x, sheared_y, sign, start
):
    """Return the z at which the ray meets a triangle seen nearly edge-on; NaN if it does not.

    In the plane the triangle is a needle. Products of its coordinates cancel, unless the needle
    lies along an axis; so it is sheared to lie along x, which costs one rounding of y. If it is so
    thin, or so short, that even then U, V and W do not lead to the ray, the ray is as good as in
    the triangle's plane: it enters and leaves through edges, and z is that of the first of these.

    Parameters
    ----------
    ax, ay, az, ..., cz : float
        Corners relative to the ray, which runs along z.
    slack_x, slack_y : float
        How far beside the ray an edge may pass.
    sheared_x, sheared_y : float
        How much further off U, V and W may lead, since corners were sheared along z.
    sign : float
        Positive if the ray runs towards positive z.
    start : float
        The z at which the ray begins.
    """
    longest_x, longest_y, slope_x, slope_y = 0.0, 0.0, 0.0, 0.0
    for _ in range(3):
        x, y = bx - ax, by - ay
        if abs(x) > longest_x:
            longest_x, slope_x = abs(x), y / x
        if abs(y) > longest_y:
            longest_y, slope_y = abs(y), x / y
        ax, ay, az, bx, by, bz, cx, cy, cz = bx, by, bz, cx, cy, cz, ax, ay, az
    larger = LARGER if max(longest_x, longest_y) < SMALL else 1.0
    if larger > 1.0:
        ax, ay, az = larger * ax, larger * ay, larger * az
        bx, by, bz = larger * bx, larger * by, larger * bz
        cx, cy, cz = larger * cx, larger * cy, larger * cz
        slack_x, slack_y = larger * slack_x, larger * slack_y
        sheared_x, sheared_y = larger * sheared_x, larger * sheared_y
    if longest_y > longest_x:
        ax, ay, bx, by, cx, cy = ay, ax, by, bx, cy, cx
        slack_x, slack_y, slope_x = slack_y, slack_x, slope_y
        sheared_x, sheared_y = sheared_y, sheared_x
    # The longest edge becomes parallel to x.
    ay, by, cy = ay - slope_x * ax, by - slope_x * bx, cy - slope_x * cx
    u = cx * by - cy * bx
    v = ax * cy - ay * cx
    w = bx * ay - by * ax
    is_outside = (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0)
    size = abs(u + v + w)
    if not is_outside and size > FAINT:
        off_x, off_y = abs(u * ax + v * bx + w * cx), abs(u * ay + v * by + w * cy)
        if off_x <= (slack_x + sheared_x) * size and off_y <= (slack_y + sheared_y) * size:
            return (u * az + v * bz + w * cz) / (u + v + w) / larger
    low, high = np.inf, -np.inf
    for _ in range(3):
        # Corner a may be at the ray, or edge ab cross x = 0 there.
        share, y = 0.0, ay
        if (ax < 0.0) != (bx < 0.0):
            share = ax / (ax - bx)
            y = ay + share * (by - ay)
        if abs(y) <= slack_y and (share > 0.0 or abs(ax) <= slack_x):
            z = az + share * (bz - az)
            low = z if z < low else low
            high = z if z > high else high
        ax, ay, az, bx, by, bz, cx, cy, cz = bx, by, bz, cx, cy, cz, ax, ay, az
    if low > high:
        return np.nan
    # A ray that starts in between is there at once.
    if low <= larger * start <= high:
        return start
    return (low if sign > 0.0 else high) / larger


@inner
def clamp_to_own_box(corners, index, ray, t):
    """Move t into the slab interval of the triangle's box; NO_HIT if the ray misses that box.

    For a triangle seen edge-on, t is mostly rounding error. Clamped, it lies where the triangle
    is, and inside the interval of every box around the triangle: see "Slack" in :mod:`.rays`.
    """
    enter, leave = ray.t_min, np.inf
    for axis in range(3):
        p, q, r = corners[index, 0, axis], corners[index, 1, axis], corners[index, 2, axis]
        low, high = (q, p) if q < p else (p, q)
        low, high = r if r < low else low, r if r > high else high
        if axis == 0:
            low, high = (low - ray.low_x) * ray.ix, (high - ray.high_x) * ray.ix
        elif axis == 1:
            low, high = (low - ray.low_y) * ray.iy, (high - ray.high_y) * ray.iy
        else:
            low, high = (low - ray.low_z) * ray.iz, (high - ray.high_z) * ray.iz
        t_near = high if high < low else low
        t_far = low if high < low else high
        enter = t_near if t_near > enter else enter
        leave = t_far if t_far < leave else leave
    if enter > leave:
        return NO_HIT
    t = enter if enter > t else t
    return leave if leave < t else t


def areas_of(triangles: np.ndarray) -> np.ndarray:
    """Return the areas of triangles of any size, (n, 3, 3) to (n,)."""
    edges = triangles[:, 1:] - triangles[:, :1]
    units = np.ldexp(1.0, np.frexp(np.abs(edges).max(axis=(1, 2), initial=0.0))[1])
    edges /= units[:, None, None]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) * units * units


@inner
def separated(a, b, c, reach):
    """Say whether the interval of a, b, c and the interval [-reach, reach] have no common point."""
    return min(a, b, c) > reach or max(a, b, c) < -reach


@inner
def overlaps_box(corners, index, box):
    """Say whether triangle `index` and the closed box, (6,), share a point.

    Separating axis test: three face normals of the box, the triangle's normal, and the nine cross
    products of box and triangle edges (T. Akenine-Möller: Fast 3D Triangle-Box Overlap Testing,
    2001). Edges whose cross product vanishes separate nothing and are harmless.

    Conservative: whatever is rounded, what reaches into the box by some units in the last place of
    the coordinates is not taken to be outside. A direction separates only if all three corners lie
    on one side along it; so it need not be exactly that of the normal, which in a needle is
    rounding error alone.
    """
    for axis in range(3):
        p, q, r = corners[index, 0, axis], corners[index, 1, axis], corners[index, 2, axis]
        if min(p, q, r) > box[3 + axis] or max(p, q, r) < box[axis]:
            return False
    # Everything relative to the box's centre.
    hx, hy, hz = 0.5 * (box[3] - box[0]), 0.5 * (box[4] - box[1]), 0.5 * (box[5] - box[2])
    mx, my, mz = 0.5 * (box[3] + box[0]), 0.5 * (box[4] + box[1]), 0.5 * (box[5] + box[2])
    ax, ay, az = corners[index, 0, 0] - mx, corners[index, 0, 1] - my, corners[index, 0, 2] - mz
    bx, by, bz = corners[index, 1, 0] - mx, corners[index, 1, 1] - my, corners[index, 1, 2] - mz
    cx, cy, cz = corners[index, 2, 0] - mx, corners[index, 2, 1] - my, corners[index, 2, 2] - mz
    # The triangle's plane.
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    if separated(
        nx * ax + ny * ay + nz * az, nx * bx + ny * by + nz * bz, nx * cx + ny * cy + nz * cz,
        hx * abs(nx) + hy * abs(ny) + hz * abs(nz),
    ):  # fmt: skip
        return False
    # Cross products of the box's edges x, y, z with each edge e of the triangle.
    for n in range(3):
        if n == 0:
            ex, ey, ez = ux, uy, uz
        elif n == 1:
            ex, ey, ez = vx, vy, vz
        else:
            ex, ey, ez = cx - bx, cy - by, cz - bz
        if separated(
            az * ey - ay * ez, bz * ey - by * ez, cz * ey - cy * ez, hy * abs(ez) + hz * abs(ey)
        ):
            return False
        if separated(
            ax * ez - az * ex, bx * ez - bz * ex, cx * ez - cz * ex, hz * abs(ex) + hx * abs(ez)
        ):
            return False
        if separated(
            ay * ex - ax * ey, by * ex - bx * ey, cy * ex - cx * ey, hx * abs(ey) + hy * abs(ex)
        ):
            return False
    return True


@implements(overlaps, Triangles)
def overlaps_one(geometry, index, box):
    """Compare the triangle itself."""
    return overlaps_box(geometry.corners, index, box)


@implements(support, Triangles)
def support_one(geometry, index, x, y, z):
    """Take the farthest corner."""
    corners, best, far = geometry.corners, 0, -np.inf
    for k in range(3):
        along = x * corners[index, k, 0] + y * corners[index, k, 1] + z * corners[index, k, 2]
        best, far = (k, along) if along > far else (best, far)
    return corners[index, best, 0], corners[index, best, 1], corners[index, best, 2]


@implements(interval, Triangles)
def interval_of_one(geometry, index, ray):
    """Return none: a triangle has no inside."""
    return np.inf, -np.inf


@implements(clip_box, Triangles)
def clip_one(geometry, index, cell, box, polygon):
    """Fit the box to the polygon that is left of the triangle."""
    first, end = clip(geometry.corners, index, cell, polygon)
    fit(box, polygon, first, end)
