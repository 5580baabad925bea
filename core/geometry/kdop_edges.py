"""Surface areas and volumes of k-DOPs, from their edges.

The directions of a k-DOP's faces never change, and so neither do those of its edges: of two faces
i and j that may meet, the line of their common edge has the direction n_i x n_j, and only its place
follows from the heights h_i and h_j. What the other faces leave of it is found by comparing numbers
along the line, each a sum of three heights with weights known beforehand. A length l of edge, seen
from face i, is the base of a triangle whose tip is the foot of the origin: as high as

    (h_j - h_i cos) / sin        with cos = n_i . n_j

Half the sum of l times that is the area of the faces, and a third of area times height the volume.

Nothing is written down, so it takes a tenth of the time of cutting polygons (:mod:`.half_spaces`).
It is right for k-DOPs that fit tightly, in which all faces touch the same object: of all edges that
rounding could count twice, :func:`.half_spaces.tight_neighbours` leaves one.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from ..kernels import call, inner, kernel
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from .half_spaces import tight_neighbours

PARALLEL = 1e-9
"""Sine of an angle between a line and a plane that are parallel; the least other one is 0.3."""


class Edges(NamedTuple):
    """The edges that k-DOPs of some directions may have. Half-spaces 2 s and 2 s + 1 bound strip s.

    Attributes
    ----------
    faces : (m, 2) uint64
        The half-spaces i < j that meet.
    angles : (m, 2) float64
        Cosine of the angle between their normals, and 1 / sine.
    ends : (m, 3) uint64
        Rows of `others` and `weights`: where those begin that bound the edge's line from above,
        those that do from below, and where these end.
    others : (c,) uint64
        A half-space that may cut the edge, o.
    weights : (c, 3) float64
        It does so at ``w0 h_o + w1 h_i + w2 h_j`` along the line.
    """

    faces: np.ndarray
    angles: np.ndarray
    ends: np.ndarray
    others: np.ndarray
    weights: np.ndarray


def half_space_normals(directions: np.ndarray) -> np.ndarray:
    """Return the outward normals, (k, 3), of the half-spaces of strips in directions (k / 2, 3)."""
    return np.stack([-directions, directions], axis=1).reshape(-1, 3)


def edges_of(directions: np.ndarray) -> Edges:
    """Return the edges that k-DOPs may have whose strips have these directions, (k / 2, 3)."""
    return _edges_of(tuple(map(tuple, directions.tolist())))


@functools.cache
def _edges_of(directions: tuple[tuple[float, ...], ...]) -> Edges:
    """Do it once for each set of directions."""
    normals = half_space_normals(np.array(directions))
    lists = [row[row >= 0] for row in tight_neighbours(normals)]
    units = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    pairs = [(i, j) for i, row in enumerate(lists) for j in row.tolist() if i < j]
    angles, ends, weights = [], [], []
    others: list[int] = []
    for i, j in pairs:
        cosine = units[i] @ units[j]
        sine = np.sqrt(1.0 - cosine * cosine)
        along = np.cross(units[i], units[j]) / sine
        # The line's point nearest to the origin is (h_i u + h_j v).
        u = (units[i] - cosine * units[j]) / sine**2
        v = (units[j] - cosine * units[i]) / sine**2
        # Who is a neighbour of only one face cuts no more off the line than who lies between.
        near = np.intersect1d(lists[i], lists[j])
        rates = {o: units[o] @ along for o in near.tolist()}
        above = [o for o, rate in rates.items() if rate > PARALLEL]
        below = [o for o, rate in rates.items() if rate < -PARALLEL]
        begin = len(others)
        ends.append((begin, begin + len(above), begin + len(above) + len(below)))
        angles.append((cosine, 1.0 / sine))
        for o in above + below:
            others.append(o)
            weights.append(np.array([1.0, -units[o] @ u, -units[o] @ v]) / rates[o])
    return Edges(
        np.array(pairs, np.uint64), np.array(angles), np.array(ends, np.uint64),
        np.array(others, np.uint64), np.array(weights),
    )  # fmt: skip


@inner
def write_heights(row, directions, heights):
    """Write the heights of a k-DOP's half-spaces over the middle of its box; return their unit.

    The unit is a power of two, so that nothing is rounded by it, and about the size of the box.
    """
    longest = 0.0
    for axis in range(3):
        longest = max(longest, row[2 * axis + 1] - row[2 * axis])
    unit = math.ldexp(1.0, math.frexp(longest)[1])
    for strip in range(len(directions)):
        middle, reach, square = 0.0, 0.0, 0.0
        for axis in range(3):
            n, low, high = directions[strip, axis], row[2 * axis], row[2 * axis + 1]
            middle += n * (0.5 * low + 0.5 * high)
            reach += abs(n) * (0.5 * high - 0.5 * low)
            square += n * n
        # Far from the origin, the room for rounding may lie outside of the box.
        scale = 1.0 / (unit * square**0.5)
        heights[2 * strip] = min(middle - row[2 * strip], reach) * scale
        heights[2 * strip + 1] = min(row[2 * strip + 1] - middle, reach) * scale
    return unit


@kernel
def measure_each(rows, directions, edges, heights, first, last, areas, contents):
    """Write area and volume of the k-DOPs ``first <= i < last``; `heights`, (k,), is scratch."""
    faces, angles, ends, others, weights = edges
    for i in range(first, last):
        unit = write_heights(rows[i], directions, heights)
        area, content = 0.0, 0.0
        for edge in range(len(faces)):
            a, b = heights[faces[edge, 0]], heights[faces[edge, 1]]
            low, high = -np.inf, np.inf
            for n in range(ends[edge, 0], ends[edge, 1]):
                t = weights[n, 0] * heights[others[n]] + weights[n, 1] * a + weights[n, 2] * b
                high = t if t < high else high
            for n in range(ends[edge, 1], ends[edge, 2]):
                t = weights[n, 0] * heights[others[n]] + weights[n, 1] * a + weights[n, 2] * b
                low = t if t > low else low
                if low >= high:
                    break
            if low < high:
                length = 0.5 * (high - low) * angles[edge, 1]
                on_a, on_b = length * (b - angles[edge, 0] * a), length * (a - angles[edge, 0] * b)
                area += on_a + on_b
                content += on_a * a + on_b * b
        areas[i] = max(area, 0.0) * unit * unit
        contents[i] = max(content, 0.0) / 3.0 * unit * unit * unit


def measured_by_edges(
    rows: np.ndarray, directions: np.ndarray, progress: Progress = SILENT
) -> tuple[np.ndarray, np.ndarray]:
    """Return surface areas and volumes of tight k-DOPs, (n,) each.

    Parameters
    ----------
    rows : (n, k) float64
        As in :class:`.kdop.KDOPs`; the first three strips are the axes.
    directions : (k / 2, 3) float64

    Raises
    ------
    Cancelled
        From `progress`.
    """
    edges = edges_of(directions)
    areas, contents = np.empty(len(rows)), np.empty(len(rows))

    def work(first: int, last: int) -> None:
        heights = np.empty(2 * len(directions))
        call(measure_each, rows, directions, edges, heights, first, last, areas, contents)

    for_chunks(work, len(rows), 0, progress, "Measuring volumes")
    return areas, contents
