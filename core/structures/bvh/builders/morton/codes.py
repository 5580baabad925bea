"""Morton codes: triangles in the order of a space-filling curve.

A grid of 2^k cells per axis is laid over the centroids. The k-bit numbers x, y, z of a centroid's
cell are interleaved into one code of 3k bits, the bit of x highest in each triple:

    x = x1 x0,  y = y1 y0,  z = z1 z0   ->   x1 y1 z1 x0 y0 z0

The first triple says in which octant of the grid the cell is, the next one in which octant of that
octant, and so on. Cells in the order of their codes therefore lie along a curve that finishes one
octant before it enters the next (the Z-curve), and sorting the codes groups the triangles in space.

G. M. Morton: A Computer Oriented Geodetic Data Base and a New Technique in File Sequencing, IBM
1966. C. Lauterbach et al.: Fast BVH Construction on GPUs, Eurographics 2009.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .....kernels import call, inner, kernel
from .....parallel import Team
from .....settings import setting
from ...topology.collapse import LeafSettings
from .radix_sort import radix_sort


@dataclass(frozen=True)
class MortonSettings(LeafSettings):
    """Settings of every builder that sorts triangles by Morton codes."""

    morton_bits: str = setting(
        "63",
        "Morton Bits",
        "Length of Morton codes",
        choices={"30": "10 bits per axis", "63": "21 bits per axis"},
    )


@inner
def expand_bits(x):
    """Move bit i of a number of 21 bits to place 3 i."""
    x = (x | x << 32) & 0x001F00000000FFFF
    x = (x | x << 16) & 0x001F0000FF0000FF
    x = (x | x << 8) & 0x100F00F00F00F00F
    x = (x | x << 4) & 0x10C30C30C30C30C3
    return (x | x << 2) & 0x1249249249249249


@kernel
def bound_centroids(boxes, bounds, first, last):
    """Widen `bounds`, (6,), so that it holds the centroids of boxes, doubled."""
    for i in range(first, last):
        for axis in range(3):
            centre = boxes[i, axis] + boxes[i, 3 + axis]
            low, high = bounds[axis], bounds[3 + axis]
            bounds[axis] = centre if centre < low else low
            bounds[3 + axis] = centre if centre > high else high


@kernel
def encode(boxes, low, scale, cells, codes, first, last):
    """Write the Morton codes of the boxes ``first <= i < last``.

    A centroid on the upper border belongs to the last cell.
    """
    for i in range(first, last):
        code = 0
        for axis in range(3):
            cell = int((boxes[i, axis] + boxes[i, 3 + axis] - low[axis]) * scale[axis])
            cell = cell if cell < cells else cells - 1
            code = code << 1 | expand_bits(cell)
        codes[i] = code


def scale_of(low: np.ndarray, high: np.ndarray, bits: int) -> np.ndarray:
    """Return how many cells of the grid there are per unit along each axis, (3,).

    Parameters
    ----------
    low, high : (3,) float64
        Of the centroids, doubled.
    """
    with np.errstate(divide="ignore", over="ignore"):
        scale = (1 << bits // 3) / (high - low)
    scale[~np.isfinite(scale)] = 0.0  # an axis along which all centroids are the same
    return scale


def planes_between(
    codes: np.ndarray, others: np.ndarray, boxes: np.ndarray, bits: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the planes of the grid that part codes at the highest bit in which two differ.

    Parameters
    ----------
    codes, others : (k,) int64
        The lower and the higher of each pair.
    boxes : (n, 6) float64
        That the grid is laid over.

    Returns
    -------
    axis : (k,) int8
        -1 where both are the same.
    position : (k,) float64
    """
    centroids = boxes[:, :3] + boxes[:, 3:]
    low = centroids.min(axis=0)
    scale = scale_of(low, centroids.max(axis=0), bits)
    differ = codes ^ others
    highest = np.full(len(codes), -1)
    for bit in range(bits):
        highest[differ >> bit > 0] = bit
    axis = np.where(highest >= 0, 2 - highest % 3, -1)
    cell = np.zeros(len(codes), np.int64)  # the first one above the plane
    for bit in range(bits // 3):
        place = 3 * bit + 2 - axis
        cell |= np.where(place >= highest, others >> place & 1, 0) << bit
    with np.errstate(divide="ignore", invalid="ignore"):
        position = 0.5 * (low[axis] + cell / scale[axis])
    return axis.astype(np.int8), np.where(axis >= 0, position, np.nan)


def codes_of(boxes: np.ndarray, bits: int, team: Team) -> np.ndarray:
    """Return the Morton codes of the centroids of boxes.

    Parameters
    ----------
    boxes : (n, 6) float64
    bits : int
        Length of the codes, a multiple of 3, at most 63.
    team : Team

    Returns
    -------
    (n,) int64

    Raises
    ------
    Cancelled
        From the team's progress.
    """

    def bound(first: int, last: int) -> np.ndarray:
        bounds = np.repeat([np.inf, -np.inf], 3)
        call(bound_centroids, boxes, bounds, first, last)
        return bounds

    bounds = np.array(team.run(bound, len(boxes)))
    low, high = bounds[:, :3].min(axis=0), bounds[:, 3:].max(axis=0)
    cells, scale = 1 << bits // 3, scale_of(low, high, bits)
    codes = np.empty(len(boxes), np.int64)
    team.run(lambda *block: call(encode, boxes, low, scale, cells, codes, *block), len(boxes))
    return codes


def sort_by_code(boxes: np.ndarray, bits: int, team: Team) -> tuple[np.ndarray, np.ndarray]:
    """Return Morton codes of boxes, ascending, and which box has each; of equal ones in order.

    Parameters
    ----------
    boxes : (n, 6) float64
    bits : int
        Length of the codes, a multiple of 3, at most 63.

    Returns
    -------
    codes : (n,) int64
    order : (n,) int32

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    return radix_sort(codes_of(boxes, bits, team), bits, team)
