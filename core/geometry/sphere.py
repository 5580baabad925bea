"""Bounding sphere: the simplest test, and nothing to do when the object turns.

Two ways to fit one:

- Ritter's, in three passes: two vertices far from each other span a first sphere, then every vertex
  outside makes it grow. Mostly some percent too large.
- The smallest: it is spanned by two to four vertices. From a sphere around a few vertices we go to
  the vertex farthest outside, and to the smallest sphere around that one and the few. Its radius
  grows with every step, so no few come twice; there are rarely more than ten steps. That is the
  pivot rule of Gärtner for Welzl's move-to-front algorithm.

The radius is that of the farthest vertex from the centre, rounded up: whatever the centre, no
triangle sticks out.

J. Ritter: An Efficient Bounding Sphere, in Graphics Gems, 1990. E. Welzl: Smallest Enclosing Disks
(Balls and Ellipsoids), 1991. B. Gärtner: Fast and Robust Smallest Enclosing Balls, ESA 1999.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..kernels import implements, inner, whole
from ..progress import SILENT, Progress
from .polygons import Polygons, of_equal_size
from .volume import EPS, MISS, fit, outside, prepare, slack_of, span

NOBODY = whole(-1)

MOST_STEPS = 100
"""Of the search for the smallest sphere; ten are many."""

TOLERANCE = 1e-12
"""How far outside of a sphere, relative to its squared radius, a vertex counts as on it."""

GREAT_CIRCLE = 32
"""Corners of the circles that are drawn."""


class Spheres(NamedTuple):
    """Spheres as bounding volumes.

    Attributes
    ----------
    rows : (n, 4) float64
        Centre and radius.
    """

    rows: np.ndarray

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas, (n,)."""
        return 4.0 * np.pi * self.rows[:, 3] ** 2

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,)."""
        return 4.0 / 3.0 * np.pi * self.rows[:, 3] ** 3

    def boxes(self) -> np.ndarray:
        """Return the axis-aligned boxes around them, (n, 6)."""
        centre, radius = self.rows[:, :3], self.rows[:, 3:]
        return np.hstack([centre - radius, centre + radius])

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the three great circles across the axes of some spheres.

        The owner of a circle is its place in `numbers`.
        """
        angle = 2.0 * np.pi * np.arange(GREAT_CIRCLE) / GREAT_CIRCLE
        unit = np.zeros((3, GREAT_CIRCLE, 3))
        for axis in range(3):
            unit[axis, :, (axis + 1) % 3] = np.cos(angle)
            unit[axis, :, (axis + 2) % 3] = np.sin(angle)
        rows = self.rows[numbers]
        circles = rows[:, None, None, :3] + rows[:, None, None, 3:] * unit
        owners = np.repeat(np.arange(len(rows)), 3)
        return of_equal_size(circles.reshape(-1, GREAT_CIRCLE, 3), owners)


class SmallestSpheres(Spheres):
    """Spheres that are fitted as the smallest ones."""


# ----------------------------------------------------------------------------------------- fitting


@inner
def distance2(corners, vertex, x, y, z):
    """Return the squared distance of a vertex from a point; triangle i has 3 i ... 3 i + 2."""
    i, k = vertex // 3, vertex % 3
    dx, dy, dz = corners[i, k, 0] - x, corners[i, k, 1] - y, corners[i, k, 2] - z
    return dx * dx + dy * dy + dz * dz


@inner
def farthest(corners, first, last, x, y, z):
    """Return the vertex farthest from a point."""
    best, vertex = -1.0, 3 * first
    for i in range(first, last):
        for k in range(3):
            dx, dy, dz = corners[i, k, 0] - x, corners[i, k, 1] - y, corners[i, k, 2] - z
            d = dx * dx + dy * dy + dz * dz
            if d > best:
                best, vertex = d, 3 * i + k
    return vertex


@inner
def fit_fast(corners, first, last, row):
    """Write the centre of Ritter's sphere."""
    a = farthest(corners, first, last, corners[first, 0, 0], corners[first, 0, 1],
                 corners[first, 0, 2])  # fmt: skip
    ax, ay, az = corners[a // 3, a % 3, 0], corners[a // 3, a % 3, 1], corners[a // 3, a % 3, 2]
    b = farthest(corners, first, last, ax, ay, az)
    radius = 0.5 * distance2(corners, b, ax, ay, az) ** 0.5
    x, y, z = (
        0.5 * (ax + corners[b // 3, b % 3, 0]),
        0.5 * (ay + corners[b // 3, b % 3, 1]),
        0.5 * (az + corners[b // 3, b % 3, 2]),
    )
    for i in range(first, last):
        for k in range(3):
            dx, dy, dz = corners[i, k, 0] - x, corners[i, k, 1] - y, corners[i, k, 2] - z
            d = dx * dx + dy * dy + dz * dz
            if d > radius * radius:
                # The new sphere reaches from the far side of the old one to this vertex.
                d = d**0.5
                step = 0.5 * (d - radius) / d
                x, y, z, radius = x + step * dx, y + step * dy, z + step * dz, 0.5 * (radius + d)
    row[0], row[1], row[2] = x, y, z


@inner
def edge_from(corners, base, vertex, scale):
    """Return the vector between two vertices, scaled, and its square; zero for NOBODY."""
    if vertex < 0:
        return 0.0, 0.0, 0.0, 0.0
    i, k, j, m = vertex // 3, vertex % 3, base // 3, base % 3
    x, y, z = (
        scale * (corners[i, k, 0] - corners[j, m, 0]),
        scale * (corners[i, k, 1] - corners[j, m, 1]),
        scale * (corners[i, k, 2] - corners[j, m, 2]),
    )
    return x, y, z, x * x + y * y + z * z


@inner
def circumscribe(corners, base, a, b, c, row, scale):
    """Write the centre of the smallest sphere with two to four vertices on it.

    With u, v, w from `base` to the others, it is from there at
    (u² v x w + v² w x u + w² u x v) / (2 u · v x w). Without c, any w across the triangle's plane
    will do if its square is taken to be zero. Lengths are multiplied by `scale`, so that their
    fifth powers stay in range.
    """
    ux, uy, uz, uu = edge_from(corners, base, a, scale)
    vx, vy, vz, vv = edge_from(corners, base, b, scale)
    wx, wy, wz, ww = edge_from(corners, base, c, scale)
    x, y, z = 0.5 * ux, 0.5 * uy, 0.5 * uz
    if b >= 0:
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        if c < 0:
            wx, wy, wz = nx, ny, nz
        twice = 2.0 * (wx * nx + wy * ny + wz * nz)
        if twice == 0.0:
            return np.inf  # all in a line or in a plane
        x = (uu * (vy * wz - vz * wy) + vv * (wy * uz - wz * uy) + ww * nx) / twice
        y = (uu * (vz * wx - vx * wz) + vv * (wz * ux - wx * uz) + ww * ny) / twice
        z = (uu * (vx * wy - vy * wx) + vv * (wx * uy - wy * ux) + ww * nz) / twice
    x, y, z = x / scale, y / scale, z / scale
    row[0] = corners[base // 3, base % 3, 0] + x
    row[1] = corners[base // 3, base % 3, 1] + y
    row[2] = corners[base // 3, base % 3, 2] + z
    return x * x + y * y + z * z


@inner
def smallest_of_five(corners, new, old, row, scale):
    """Return which of the vertices `old` span the smallest sphere together with `new`, as bits.

    0 if rounding leaves none; and the squared radius.
    """
    best, best_mask = np.inf, 0
    for mask in range(1, 15):
        a, b, c = chosen(old, mask)
        if a < 0:
            continue
        radius2 = circumscribe(corners, new, a, b, c, row, scale)
        contains_all = radius2 < best
        for vertex in old:
            if contains_all and vertex >= 0:
                d = distance2(corners, vertex, row[0], row[1], row[2])
                contains_all = d <= radius2 * (1.0 + TOLERANCE)
        if contains_all:
            best, best_mask = radius2, mask
    return best_mask, best


@inner
def chosen(old, mask):
    """Return the vertices of the bits of a mask, at most three; NOBODY first if one is missing."""
    a, b, c = NOBODY, NOBODY, NOBODY
    for bit in range(4):
        if mask >> bit & 1:
            if old[bit] < 0:
                return NOBODY, NOBODY, NOBODY
            a, b, c = old[bit], a, b
    return a, b, c


@inner
def fit_smallest(corners, first, last, row):
    """Write the centre of the smallest sphere."""
    start = whole(3 * first)
    row[0], row[1], row[2] = corners[first, 0, 0], corners[first, 0, 1], corners[first, 0, 2]
    support, radius2 = (start, NOBODY, NOBODY, NOBODY), 0.0
    longest = distance2(corners, farthest(corners, first, last, row[0], row[1], row[2]),
                        row[0], row[1], row[2]) ** 0.5  # fmt: skip
    scale = math.ldexp(1.0, -math.frexp(longest)[1])  # a power of two: nothing is rounded by it
    for _ in range(MOST_STEPS):
        x, y, z = row[0], row[1], row[2]
        new = whole(farthest(corners, first, last, x, y, z))
        if distance2(corners, new, x, y, z) <= radius2 * (1.0 + TOLERANCE):
            break
        mask, grown = smallest_of_five(corners, new, support, row, scale)
        if mask == 0 or grown <= radius2:
            # Rounding has the last word: the sphere so far, a little larger, will do.
            row[0], row[1], row[2] = x, y, z
            break
        a, b, c = chosen(support, mask)
        circumscribe(corners, new, a, b, c, row, scale)
        support, radius2 = (new, a, b, c), grown


@inner
def reach_farthest(corners, first, last, row):
    """Write the distance of the farthest vertex; five roundings of its square are 4 eps."""
    x, y, z = row[0], row[1], row[2]
    d = distance2(corners, farthest(corners, first, last, x, y, z), x, y, z)
    row[3] = d**0.5 * (1.0 + 4.0 * EPS)


@implements(fit, Spheres)
def fit_sphere(volumes, index, corners, first, last):
    """Find Ritter's centre, then the farthest vertex."""
    row = volumes.rows[index]
    fit_fast(corners, first, last, row)
    reach_farthest(corners, first, last, row)


@implements(fit, SmallestSpheres)
def fit_smallest_sphere(volumes, index, corners, first, last):
    """Find the best centre, then the farthest vertex."""
    row = volumes.rows[index]
    fit_smallest(corners, first, last, row)
    reach_farthest(corners, first, last, row)


# ---------------------------------------------------------------------------------------- the test


@implements(outside, SmallestSpheres)
@implements(outside, Spheres)
def outside_sphere(volumes, index, x, y, z):
    """Compare the distance from the centre with the radius."""
    row = volumes.rows[index]
    dx, dy, dz = x - row[0], y - row[1], z - row[2]
    return (dx * dx + dy * dy + dz * dz) ** 0.5 - row[3]


@implements(prepare, SmallestSpheres)
@implements(prepare, Spheres)
def prepare_sphere(volumes, ray, strips):
    """Write the unit direction; then 1 / |d|, which makes lengths to t, and the slack."""
    along = 1.0 / (1.0 + ray.shear_x * ray.shear_x + ray.shear_y * ray.shear_y) ** 0.5
    strips[1, 0], strips[1, 1] = abs(ray.shear_z) * along, slack_of(ray)
    along = along if ray.shear_z > 0.0 else -along
    strips[0, ray.kz] = along
    strips[0, ray.kx], strips[0, ray.ky] = ray.shear_x * along, ray.shear_y * along


@implements(span, SmallestSpheres, inline=True)
@implements(span, Spheres, inline=True)
def span_sphere(volumes, index, ray, strips, limit):
    """Go to the point of the ray closest to the centre, and from there both ways.

    With p the vector from that point to the centre, the ray is inside for ``sqrt(r² - p²)`` before
    and behind it. That form does not cancel for far origins, as that with ``|o - c|² - r²`` does.
    """
    rows = volumes.rows
    cx, cy, cz = rows[index, 0] - ray.ox, rows[index, 1] - ray.oy, rows[index, 2] - ray.oz
    closest = cx * strips[0, 0] + cy * strips[0, 1] + cz * strips[0, 2]
    px = cx - closest * strips[0, 0]
    py = cy - closest * strips[0, 1]
    pz = cz - closest * strips[0, 2]
    r = rows[index, 3] + strips[1, 1]
    rest = r * r - (px * px + py * py + pz * pz)
    if not (rest >= 0.0):
        return MISS, 0.0
    half = math.sqrt(rest)
    t_enter, t_leave = (closest - half) * strips[1, 0], (closest + half) * strips[1, 0]
    t_enter = t_enter if t_enter > ray.t_min else ray.t_min
    return t_enter, t_leave if t_leave < limit else limit
