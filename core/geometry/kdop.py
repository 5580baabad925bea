"""k-DOP: the intersection of k/2 strips in fixed directions (discrete oriented polytope).

A strip is the space between two parallel planes. Of an object it needs only two numbers, the
lecture's d and D: the least and the largest n . p over its vertices. Directions are

- 6: the axes, which makes a box;
- 14: and the diagonals of a cube, which cut its corners;
- 18: the axes and the diagonals of a cube's sides, which cut its edges;
- 26: all of them.

Normals have components 0, 1 and -1, and are not brought to length 1: so n . p has two sums to round
and no product.

What n . o and n . d are is the same for all volumes that a ray meets, so it is computed once.

J. Klosowski, M. Held, J. Mitchell, H. Sowizral, K. Zikan: Efficient Collision Detection Using
Bounding Volume Hierarchies of k-DOPs, IEEE TVCG 4(1), 1998. T. Kay, J. Kajiya: Ray Tracing Complex
Scenes, SIGGRAPH 1986.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import implements
from ..progress import SILENT, Progress
from .box_shape import surface_area
from .half_spaces import faces_of, tight_neighbours
from .kdop_edges import half_space_normals, measured_by_edges
from .polygons import Polygons
from .volume import EPS, MISS, fit, outside, prepare, slack_of, span

AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
CORNERS = [(1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)]
EDGES = [(1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)]

DIRECTIONS = {6: AXES, 14: AXES + CORNERS, 18: AXES + EDGES, 26: AXES + CORNERS + EDGES}
"""Normals of the strips for each k."""


class KDOPs(NamedTuple):
    """k-DOPs as bounding volumes, all with the same directions.

    Attributes
    ----------
    rows : (n, k) float64
        Bounds of the strips: d, D of the first, d, D of the second, ...
    directions : (k / 2, 3) float64
        Normals of the strips; the axes are the first three.
    """

    rows: np.ndarray
    directions: np.ndarray

    @property
    def k(self) -> int:
        """Number of half-spaces."""
        return self.rows.shape[1]

    def boxes(self) -> np.ndarray:
        """Return the axis-aligned boxes around them, (n, 6): the first three strips."""
        return np.ascontiguousarray(self.rows[:, [0, 2, 4, 1, 3, 5]])

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas, (n,), of k-DOPs that fit tightly."""
        if self.k == 6:
            return surface_area(self.boxes())
        return measured_by_edges(self.rows, self.directions, progress)[0]

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,), of k-DOPs that fit tightly."""
        return measured_by_edges(self.rows, self.directions)[1]

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the faces of some k-DOPs; the owner of a face is its place in `numbers`."""
        return faces_of(self, numbers, progress)

    def half_spaces(self, numbers: np.ndarray) -> np.ndarray:
        """Return some k-DOPs as half-spaces ``n . p <= h``: (m, k, 4), each [nx, ny, nz, h]."""
        rows = self.rows[numbers]
        planes = np.empty((len(rows), self.k, 4))
        planes[:, 0::2, :3], planes[:, 1::2, :3] = -self.directions, self.directions
        planes[:, 0::2, 3], planes[:, 1::2, 3] = -rows[:, 0::2], rows[:, 1::2]
        return planes

    def neighbours(self) -> np.ndarray:
        """Return the half-spaces that may cut each face, (k, c) int64, filled with -1."""
        return tight_neighbours(half_space_normals(self.directions))

    def contain(self, parents: np.ndarray, children: np.ndarray) -> np.ndarray:
        """Say of pairs whether the one contains the other, (m,) bool."""
        a, b = self.rows[parents], self.rows[children]
        return (a[:, 0::2] <= b[:, 0::2]).all(1) & (a[:, 1::2] >= b[:, 1::2]).all(1)


@implements(fit, KDOPs)
def fit_kdop(volumes, index, corners, first, last):
    """Find d and D of every strip.

    A sum of coordinates is rounded by 3/2 eps of the sum of their sizes, the last difference
    included; a coordinate is not rounded. Parents, whose coordinates are no smaller, contain their
    children even so.
    """
    row, directions = volumes.rows[index], volumes.directions
    reach = 0.0
    for strip in range(len(directions)):
        x, y, z = directions[strip, 0], directions[strip, 1], directions[strip, 2]
        low, high = np.inf, -np.inf
        for i in range(first, last):
            for k in range(3):
                along = x * corners[i, k, 0] + y * corners[i, k, 1] + z * corners[i, k, 2]
                low = along if along < low else low
                high = along if along > high else high
        if strip < 3:
            reach += max(abs(low), abs(high))
        slack = 2.0 * EPS * reach if strip > 2 else 0.0
        row[2 * strip], row[2 * strip + 1] = low - slack, high + slack


@implements(outside, KDOPs)
def outside_kdop(volumes, index, x, y, z):
    """Take the farthest of all sides."""
    row, directions = volumes.rows[index], volumes.directions
    worst = -np.inf
    for strip in range(len(directions)):
        nx, ny, nz = directions[strip, 0], directions[strip, 1], directions[strip, 2]
        along, length = nx * x + ny * y + nz * z, (nx * nx + ny * ny + nz * nz) ** 0.5
        worst = max(worst, (row[2 * strip] - along) / length, (along - row[2 * strip + 1]) / length)
    return worst


@implements(prepare, KDOPs)
def prepare_kdop(volumes, ray, strips):
    """Write n . o with the slack for the low and the high plane, and 1 / n . d of every strip."""
    directions, slack = volumes.directions, slack_of(ray)
    for strip in range(len(directions)):
        x, y, z = directions[strip, 0], directions[strip, 1], directions[strip, 2]
        start = x * ray.ox + y * ray.oy + z * ray.oz
        strips[strip, 0], strips[strip, 1] = start + slack, start - slack
        strips[strip, 2] = 1.0 / (x * ray.dx + y * ray.dy + z * ray.dz)


@implements(span, KDOPs, inline=True)
def span_kdop(volumes, index, ray, strips, limit):
    """Intersect the intervals within all strips; stop as soon as nothing is left."""
    rows = volumes.rows
    t_enter, t_leave = ray.t_min, limit
    for strip in range(len(volumes.directions)):
        low = (rows[index, 2 * strip] - strips[strip, 0]) * strips[strip, 2]
        high = (rows[index, 2 * strip + 1] - strips[strip, 1]) * strips[strip, 2]
        # Parallel to the strip, both are infinite, or NaN on its border, which restricts nothing.
        t = high if high < low else low
        t_enter = t if t > t_enter else t_enter
        t = low if high < low else high
        t_leave = t if t < t_leave else t_leave
        if t_enter > t_leave:
            return MISS, 0.0
    return t_enter, t_leave
