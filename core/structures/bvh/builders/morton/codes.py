"""Morton codes: triangles in the order of a space-filling curve.

A grid of 2^k cells per axis is laid over the centroids. The k-bit numbers x, y, z of a centroid's
cell are interleaved into one code of 3k bits, the bit of x highest in each triple:

    x = x1 x0,  y = y1 y0,  z = z1 z0   ->   x1 y1 z1 x0 y0 z0

The first triple says in which octant of the grid the cell is, the next one in which octant of that
octant, and so on. Cells in the order of their codes therefore lie along a curve that finishes one
octant before it enters the next (the Z-curve), and sorting the codes groups the triangles in space.

*Extended* codes have as many bits, but of other things:

- The axis of each bit is the one along which cells are longest so far, and are halved then: a long
  scene is cut across its length first, and long axes have more bits than short ones.
- Of SIZE_EVERY bits the last says how large the box itself is: its diagonal as a share of the
  scene's, as a number of `size_bits` bits. Large triangles leave the small ones around them, whose
  boxes stay small.

SAH cost (1.2 and 1, leaves of up to 4 triangles) with standard codes, with extended ones, and with
those without bits of the size; 63 bits:

    builder    Suzanne 250k        Sponza                 kitchen             dragon 203k
    lbvh       46.4, 46.4, 46.4    103.9, 103.1, 108.6    88.1, 81.9, 87.3    62.5, 61.7, 61.7
    hlbvh      42.3, 42.9          79.5, 80.6             62.6, 61.1          57.4, 58.2
    ploc       43.1, 42.2          72.9, 73.7             54.1, 54.0          57.0, 56.6
    phr        41.0, 41.1          79.0, 78.2             62.6, 62.1          54.4, 54.4

What pays is the size, where large triangles are among small ones, and most where nobody asks for
the cost afterwards. Bit by bit, codes take 2 to 4 times as long to compute, `lbvh` as a whole a
third longer.

They are off by default: M. Vinkler and J. Bittner have filed a patent application in the US for
them, which whoever ships a product should look at.

G. M. Morton: A Computer Oriented Geodetic Data Base and a New Technique in File Sequencing, IBM
1966. C. Lauterbach et al.: Fast BVH Construction on GPUs, Eurographics 2009. M. Vinkler,
J. Bittner, V. Havran: Extended Morton Codes for High Performance Bounding Volume Hierarchy
Construction, HPG 2017.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .....kernels import call, inner, kernel
from .....parallel import Team
from .....settings import setting
from ...topology.collapse import LeafSettings
from .radix_sort import radix_sort

SIZE = 3
"""What a bit is of that is of no axis: the size of a box."""

SIZE_EVERY = 7
"""Every so many bits of an extended code one is of the size, as long as there are such."""

MOST_BITS = 52
"""Bits of one axis: centroids in float64 have no more."""


@dataclass(frozen=True)
class MortonSettings(LeafSettings):
    """Settings of every builder that sorts triangles by Morton codes."""

    morton_bits: str = setting(
        "63",
        "Morton Bits",
        "Length of Morton codes",
        choices={"30": "10 bits per axis", "63": "21 bits per axis"},
    )
    morton_codes: str = setting(
        "standard",
        "Morton Codes",
        "What the bits of Morton codes are of",
        choices={
            "standard": "x, y and z in turn",
            "extended": "The longest side of a cell, and every seventh the size of the triangle "
            "(Vinkler 2017; a patent application covers this in the US)",
        },
    )
    size_bits: int = setting(
        6,
        "Size Bits",
        "How many bits of extended codes are of the size; at most one of seven is",
        unit="bits",
        minimum=0,
        maximum=9,
        only_for={"morton_codes": ["extended"]},
    )


class Coding(NamedTuple):
    """How the codes of some boxes are made, and what their bits mean.

    Attributes
    ----------
    low : (3,) float64
        Of doubled centroids.
    scale : (4,) float64
        Cells per unit of x, y and z of doubled centroids, and of diagonals.
    cells : (4,) int64
        How many numbers each has.
    kinds : (bits,) int64
        Of which of the four each bit is, the highest first.
    places : (bits,) int64
        Which bit of that number it is; 0 is the lowest.
    """

    low: np.ndarray
    scale: np.ndarray
    cells: np.ndarray
    kinds: np.ndarray
    places: np.ndarray


@inner
def expand_bits(x):
    """Move bit i of a number of 21 bits to place 3 i."""
    x = (x | x << 32) & 0x001F00000000FFFF
    x = (x | x << 16) & 0x001F0000FF0000FF
    x = (x | x << 8) & 0x100F00F00F00F00F
    x = (x | x << 4) & 0x10C30C30C30C30C3
    return (x | x << 2) & 0x1249249249249249


@kernel
def bound(boxes, bounds, first, last):
    """Widen `bounds`, (12,), so that it holds the doubled centroids of boxes, then the boxes."""
    for i in range(first, last):
        for axis in range(3):
            a, b = boxes[i, axis], boxes[i, 3 + axis]
            centre = a + b
            low, high = bounds[axis], bounds[3 + axis]
            bounds[axis] = centre if centre < low else low
            bounds[3 + axis] = centre if centre > high else high
            low, high = bounds[6 + axis], bounds[9 + axis]
            bounds[6 + axis] = a if a < low else low
            bounds[9 + axis] = b if b > high else high


@inner
def number_of(value, coding, kind):
    """Return the number of a cell; a value on the upper border belongs to the last one."""
    number = int((value - coding.low[kind]) * coding.scale[kind])
    return min(number, coding.cells[kind] - 1)


@kernel
def encode(boxes, coding, codes, first, last):
    """Write the standard codes of the boxes ``first <= i < last``."""
    for i in range(first, last):
        code = 0
        for axis in range(3):
            cell = number_of(boxes[i, axis] + boxes[i, 3 + axis], coding, axis)
            code = code << 1 | expand_bits(cell)
        codes[i] = code


@kernel
def encode_extended(boxes, coding, codes, first, last):
    """Write the codes of the boxes ``first <= i < last``, bit by bit."""
    for i in range(first, last):
        x = number_of(boxes[i, 0] + boxes[i, 3], coding, 0)
        y = number_of(boxes[i, 1] + boxes[i, 4], coding, 1)
        z = number_of(boxes[i, 2] + boxes[i, 5], coding, 2)
        # Scaled before they are squared, which must not become too large.
        scale = coding.scale[SIZE]
        a, b = scale * (boxes[i, 3] - boxes[i, 0]), scale * (boxes[i, 4] - boxes[i, 1])
        c = scale * (boxes[i, 5] - boxes[i, 2])
        size = min(int(np.sqrt(a * a + b * b + c * c)), coding.cells[SIZE] - 1)
        code = 0
        for bit in range(len(coding.kinds)):
            kind = coding.kinds[bit]
            number = x if kind == 0 else y if kind == 1 else z if kind == 2 else size
            code = code << 1 | (number >> coding.places[bit] & 1)
        codes[i] = code


def kinds_of_bits(extent: np.ndarray, settings: MortonSettings) -> np.ndarray:
    """Return of what each bit of a code is, the highest first: of axis 0, 1, 2 or SIZE.

    Parameters
    ----------
    extent : (3,) float64
        Of the box around the centroids.
    """
    bits = int(settings.morton_bits)
    if settings.morton_codes == "standard":
        return np.arange(bits) % 3
    sides, used = extent.astype(np.float64), np.zeros(4, np.int64)
    kinds = np.empty(bits, np.int64)
    for bit in range(bits):
        if bit % SIZE_EVERY == SIZE_EVERY - 1 and used[SIZE] < settings.size_bits:
            kind = SIZE
        else:  # of equal sides the first
            kind = int(np.where(used[:3] < MOST_BITS, sides, -1.0).argmax())
            sides[kind] *= 0.5
        kinds[bit] = kind
        used[kind] += 1
    return kinds


def coding_between(bounds: np.ndarray, settings: MortonSettings) -> Coding:
    """Return how boxes with these bounds are coded, (12,): see :func:`bound`."""
    low, extent = bounds[:3], bounds[3:6] - bounds[:3]
    diagonal = math.hypot(*(bounds[9:] - bounds[6:9]))
    kinds = kinds_of_bits(extent, settings)
    counts = np.bincount(kinds, minlength=4)
    with np.errstate(divide="ignore", over="ignore"):
        scale = (1 << counts) / np.append(extent, diagonal)
    scale[~np.isfinite(scale)] = 0.0  # an axis along which all centroids are the same
    places = np.empty_like(kinds)
    for kind in range(4):
        places[kinds == kind] = np.arange(counts[kind])[::-1]
    return Coding(low, scale, 1 << counts, kinds, places)


def coding_over(boxes: np.ndarray, settings: MortonSettings, team: Team) -> Coding:
    """Return how boxes, (n, 6), are coded.

    Raises
    ------
    Cancelled
        From the team's progress.
    """

    def bound_block(first: int, last: int) -> np.ndarray:
        bounds = np.tile(np.repeat([np.inf, -np.inf], 3), 2)
        call(bound, boxes, bounds, first, last)
        return bounds

    found = np.array(team.run(bound_block, len(boxes)))
    lowest, highest = found.min(axis=0), found.max(axis=0)
    return coding_between(np.where(np.arange(12) % 6 < 3, lowest, highest), settings)


def planes_between(
    codes: np.ndarray, others: np.ndarray, coding: Coding
) -> tuple[np.ndarray, np.ndarray]:
    """Return the planes of the grid that part codes at the highest bit in which two differ.

    Parameters
    ----------
    codes, others : (k,) int64
        The lower and the higher of each pair.

    Returns
    -------
    axis : (k,) int8
        -1 where both are the same, or differ in size.
    position : (k,) float64
    """
    bits = len(coding.kinds)
    highest = highest_bit(codes ^ others)
    kind = np.where(highest >= 0, coding.kinds[bits - 1 - np.maximum(highest, 0)], SIZE)
    axis, position = np.full(len(codes), -1, np.int8), np.full(len(codes), np.nan)
    for along in range(3):
        there = np.flatnonzero(kind == along)
        above, up_to = others[there], highest[there]
        cell = np.zeros(len(there), np.int64)  # the first one above the plane
        for bit in np.flatnonzero(coding.kinds == along).tolist():
            place = bits - 1 - bit
            cell |= np.where(place >= up_to, above >> place & 1, 0) << coding.places[bit]
        axis[there] = along
        position[there] = 0.5 * (coding.low[along] + cell / coding.scale[along])
    return axis, position


def highest_bit(numbers: np.ndarray) -> np.ndarray:
    """Return which is the highest bit that is set in int64 numbers of at least 0; -1 for 0."""
    _, exponents = np.frexp(numbers.astype(np.float64))
    found = exponents.astype(np.int64) - 1
    # A number of more than 53 bits may have been rounded up to the next power of two.
    return found - ((numbers >> np.maximum(found, 0) == 0) & (numbers > 0))


def codes_of(boxes: np.ndarray, settings: MortonSettings, team: Team) -> np.ndarray:
    """Return the Morton codes of the centroids of boxes, or their extended codes.

    Parameters
    ----------
    boxes : (n, 6) float64
    settings : MortonSettings
    team : Team

    Returns
    -------
    (n,) int64

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    coding = coding_over(boxes, settings, team)
    encoder = encode if settings.morton_codes == "standard" else encode_extended
    codes = np.empty(len(boxes), np.int64)
    team.run(lambda *block: call(encoder, boxes, coding, codes, *block), len(boxes))
    return codes


def sort_by_code(
    boxes: np.ndarray, settings: MortonSettings, team: Team
) -> tuple[np.ndarray, np.ndarray]:
    """Return the codes of boxes, ascending, and which box has each; of equal ones in order.

    Parameters
    ----------
    boxes : (n, 6) float64
    settings : MortonSettings

    Returns
    -------
    codes : (n,) int64
    order : (n,) int32

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    return radix_sort(codes_of(boxes, settings, team), int(settings.morton_bits), team)
