"""Oriented bounding box (OBB): three perpendicular strips in any direction.

The axes are the eigenvectors of the covariance of the object's surface: the directions in which it
is spread out most and least. Every point of the surface counts, not only the vertices, so a part
with many small triangles does not pull the box along (Gottschalk's second form). That is no promise
to be small, so the axis-aligned box is kept where its surface is smaller.

Each strip is a bound on its own: even if the axes are not quite perpendicular after rounding,
nothing sticks out.

S. Gottschalk, M. Lin, D. Manocha: OBBTree: A Hierarchical Structure for Rapid Interference
Detection, SIGGRAPH 1996. C. Jacobi: Über ein leichtes Verfahren, die in der Theorie der
Säcularstörungen vorkommenden Gleichungen numerisch aufzulösen, 1846.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..kernels import implements, inner
from ..progress import SILENT, Progress
from .box_shape import UNIT_CORNERS
from .half_spaces import every_other
from .polygons import Polygons, sides_of
from .volume import EPS, MISS, fit, outside, prepare, slack_of, span

LOW, HIGH = 9, 12
"""Columns of the bounds, behind those of the axes."""

SWEEPS = 8
"""Of Jacobi's method; it doubles the digits with each, and stops by itself when it is done."""


class OBBs(NamedTuple):
    """Oriented boxes as bounding volumes.

    Attributes
    ----------
    rows : (n, 15) float64
        Three axes of unit length, one after the other; then the least coordinate along each, then
        the largest.
    """

    rows: np.ndarray

    def axes(self) -> np.ndarray:
        """Return the axes, (n, 3, 3), one per row."""
        return self.rows[:, :LOW].reshape(-1, 3, 3)

    def sizes(self) -> np.ndarray:
        """Return the extents along the axes, (n, 3)."""
        return self.rows[:, HIGH:] - self.rows[:, LOW:HIGH]

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas, (n,)."""
        x, y, z = self.sizes().T
        return 2.0 * (x * y + y * z + z * x)

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,)."""
        return self.sizes().prod(axis=1)

    def corners(self) -> np.ndarray:
        """Return the corners, (n, 8, 3), in the order of UNIT_CORNERS."""
        low, high = self.rows[:, None, LOW:HIGH], self.rows[:, None, HIGH:]
        return np.where(UNIT_CORNERS == 0.0, low, high) @ self.axes()

    def boxes(self) -> np.ndarray:
        """Return the axis-aligned boxes around them, (n, 6)."""
        corners = self.corners()
        return np.hstack([corners.min(axis=1), corners.max(axis=1)])

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the six sides of some boxes; the owner of a side is its place in `numbers`."""
        return sides_of(OBBs(self.rows[numbers]).corners())

    def half_spaces(self, numbers: np.ndarray) -> np.ndarray:
        """Return some boxes as half-spaces ``n . p <= h``: (k, 6, 4), each [nx, ny, nz, h]."""
        rows, axes = self.rows[numbers], self.axes()[numbers]
        low, high = rows[:, LOW:HIGH, None], rows[:, HIGH:, None]
        return np.concatenate(
            [np.concatenate([-axes, -low], axis=2), np.concatenate([axes, high], axis=2)], axis=1
        )

    def neighbours(self) -> np.ndarray:
        """Return the half-spaces that may cut each face, (6, 5) int64."""
        return every_other(6)


# ----------------------------------------------------------------------------------------- fitting


@inner
def add_covariance(corners, first, last, row, scale):
    """Write the covariance of a surface to row[9:15]: xx, yy, zz, xy, xz, yz.

    A triangle p, q, r of area A and centre c contributes A / 12 (9 c c' + p p' + q q' + r r'). All
    is relative to the first corner, so that it does not cancel far from the origin, and multiplied
    by `scale`, so that fourth powers stay in range. The place of the axes is scratch.
    """
    ox, oy, oz = corners[first, 0, 0], corners[first, 0, 1], corners[first, 0, 2]
    for i in range(15):
        row[i] = 0.0
    for i in range(first, last):
        ux, vx = corners[i, 1, 0] - corners[i, 0, 0], corners[i, 2, 0] - corners[i, 0, 0]
        uy, vy = corners[i, 1, 1] - corners[i, 0, 1], corners[i, 2, 1] - corners[i, 0, 1]
        uz, vz = corners[i, 1, 2] - corners[i, 0, 2], corners[i, 2, 2] - corners[i, 0, 2]
        ux, uy, uz, vx, vy, vz = (
            scale * ux, scale * uy, scale * uz, scale * vx, scale * vy, scale * vz
        )  # fmt: skip
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = math.sqrt(nx * nx + ny * ny + nz * nz) / 12.0
        sx, sy, sz = 0.0, 0.0, 0.0
        for k in range(4):
            # After the corners their sum: it is 3 c.
            x, y, z = sx, sy, sz
            if k < 3:
                x, y, z = corners[i, k, 0] - ox, corners[i, k, 1] - oy, corners[i, k, 2] - oz
                x, y, z = scale * x, scale * y, scale * z
                sx, sy, sz = sx + x, sy + y, sz + z
            row[9], row[10] = row[9] + area * x * x, row[10] + area * y * y
            row[11], row[12] = row[11] + area * z * z, row[12] + area * x * y
            row[13], row[14] = row[13] + area * x * z, row[14] + area * y * z
        row[0], row[1], row[2] = row[0] + area * sx, row[1] + area * sy, row[2] + area * sz
        row[3] += area
    # The areas are a twelfth of twice the triangles', the sums of corners three times the centres.
    for i in range(3):
        for j in range(i, 3):
            if row[3] > 0.0:
                row[9 + i if i == j else 11 + i + j] -= 4.0 / 3.0 * row[i] * row[j] / row[3]


@inner
def align(row):
    """Make x, y and z the axes."""
    for i in range(9):
        row[i] = 1.0 if i % 4 == 0 else 0.0


@inner
def diagonalise(row):
    """Turn the axes row[0:9] until the covariance row[9:15] is diagonal: Jacobi's rotations."""
    align(row)
    for _ in range(SWEEPS):
        for pair in range(3):
            # The entries that a rotation of axes i and j changes: 12 + pair is theirs.
            i, j = pair // 2, 1 + (pair + 1) // 2
            off, k = row[12 + pair], 3 - i - j
            if abs(off) <= 1e-15 * (row[9] + row[10] + row[11]):
                continue
            theta = 0.5 * (row[9 + j] - row[9 + i]) / off
            t = 1.0 / (abs(theta) + (theta * theta + 1.0) ** 0.5)
            t = t if theta >= 0.0 else -t
            c = 1.0 / (t * t + 1.0) ** 0.5
            s = t * c
            row[9 + i], row[9 + j], row[12 + pair] = row[9 + i] - t * off, row[9 + j] + t * off, 0.0
            ik, jk = 11 + i + k, 11 + j + k
            row[ik], row[jk] = c * row[ik] - s * row[jk], s * row[ik] + c * row[jk]
            for a in range(3):
                u, v = row[3 * i + a], row[3 * j + a]
                row[3 * i + a], row[3 * j + a] = c * u - s * v, s * u + c * v


@inner
def bound_along_axes(corners, first, last, row, rounding):
    """Write what the triangles take up along the axes; return the surface area of that box.

    Parameters
    ----------
    rounding : float
        How far the bounds are moved outwards, relative to the largest coordinates.
    """
    for axis in range(3):
        x, y, z = row[3 * axis], row[3 * axis + 1], row[3 * axis + 2]
        low, high, reach = np.inf, -np.inf, 0.0
        for i in range(first, last):
            for k in range(3):
                px, py, pz = corners[i, k, 0], corners[i, k, 1], corners[i, k, 2]
                along, size = x * px + y * py + z * pz, abs(px) + abs(py) + abs(pz)
                low = along if along < low else low
                high = along if along > high else high
                reach = size if size > reach else reach
        row[LOW + axis], row[HIGH + axis] = low - rounding * reach, high + rounding * reach
    x, y, z = row[12] - row[9], row[13] - row[10], row[14] - row[11]
    return 2.0 * (x * y + y * z + z * x)


@implements(fit, OBBs)
def fit_obb(volumes, index, corners, first, last):
    """Take the axes of the covariance, or x, y and z if that box has the smaller surface.

    Three products and two sums are rounded by 3/2 eps of the sum of the coordinates, and these
    differences once more; but nothing is along x, y and z.
    """
    row = volumes.rows[index]
    align(row)
    aligned = bound_along_axes(corners, first, last, row, 0.0)
    longest = max(row[12] - row[9], row[13] - row[10], row[14] - row[11])
    # A power of two: nothing is rounded by it.
    add_covariance(corners, first, last, row, math.ldexp(1.0, -math.frexp(longest)[1]))
    diagonalise(row)
    if not (bound_along_axes(corners, first, last, row, 3.0 * EPS) < aligned):
        align(row)
        bound_along_axes(corners, first, last, row, 0.0)


# ---------------------------------------------------------------------------------------- the test


@implements(outside, OBBs)
def outside_obb(volumes, index, x, y, z):
    """Take the farthest of the six sides."""
    row = volumes.rows[index]
    worst = -np.inf
    for i in range(3):
        along = row[3 * i] * x + row[3 * i + 1] * y + row[3 * i + 2] * z
        worst = max(worst, row[9 + i] - along, along - row[12 + i])
    return worst


@implements(prepare, OBBs)
def prepare_obb(volumes, ray, strips):
    """Write the slack; the strips of every box run in directions of their own."""
    strips[0, 0] = slack_of(ray)


@implements(span, OBBs, inline=True)
def span_obb(volumes, index, ray, strips, limit):
    """Test three strips: the slab test in the box's own axes; stop at the first that is missed."""
    rows, slack = volumes.rows, strips[0, 0]
    t_enter, t_leave = ray.t_min, limit
    for i in range(3):
        x, y, z = rows[index, 3 * i], rows[index, 3 * i + 1], rows[index, 3 * i + 2]
        start = x * ray.ox + y * ray.oy + z * ray.oz
        inverse = 1.0 / (x * ray.dx + y * ray.dy + z * ray.dz)
        low = (rows[index, LOW + i] - start - slack) * inverse
        high = (rows[index, HIGH + i] - start + slack) * inverse
        # Parallel to the strip, both are infinite, or NaN on its border, which restricts nothing.
        t = high if high < low else low
        t_enter = t if t > t_enter else t_enter
        t = low if high < low else high
        t_leave = t if t < t_leave else t_leave
        if t_enter > t_leave:
            return MISS, 0.0
    return t_enter, t_leave
