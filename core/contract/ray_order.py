"""Rays in the order in which they enter the scene.

Rays that follow each other through the same cells find these in the processor's cache, and the
guesses it makes at the way of a walk are right more often. A batch of random lines has no such
order. Sorted by where they enter the scene, and there by the octant of their direction, their walks
take a quarter to a third less time (binary hierarchies over 57,000 to a million triangles).
Sorting, fetching the rays and putting the results where they belong takes two thirds to all of that
again, so it pays over large scenes only. What each ray hits and counts is its own affair, and stays
the same.

The scene's box is divided into 2^BITS cells along each axis. The numbers of the cell in which a ray
enters the box (or begins, if that is within) are interleaved to a Morton code, to which the signs
of its direction are added; one pass of counting sorts by that.

M. Pharr, C. Kolb, R. Gershbein, P. Hanrahan: Rendering Complex Scenes with Memory-Coherent Ray
Tracing, SIGGRAPH 1997 (rays are put off, so that those in one cell go together). B. Moon et al.:
Cache-Oblivious Ray Reordering, TOG 2010.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

from ..geometry.rays import RayArrays
from ..kernels import call, has_numba, inlined, is_plain, kernel, whole
from ..parallel import for_chunks
from ..progress import Progress

T = TypeVar("T", bound=tuple[Any, ...])

BITS = 4

LAST_CELL = (1 << BITS) - 1.0

CODES = 1 << 3 * BITS + 3

LARGE, LARGE_SCENE = 1 << 15, 500_000
"""Rays of a batch, and items of a scene, from which on sorting pays. A walk through a small scene
finds everything in the cache anyhow, and what it saves is then less than what sorting costs."""

SAMPLE = 1024
"""Pairs of neighbours by which a batch is judged."""

AUTOMATIC, AS_GIVEN, SORTED = "automatic", "as_given", "sorted"

CHOICES = {
    AUTOMATIC: "Sort large batches without an order, over scenes of 500,000 and more",
    AS_GIVEN: "Trace rays in the order in which they are given",
    SORTED: "Sort rays by where they enter the scene, and by direction",
}


@kernel
def encode_entries(rays, box, codes, first, last):
    """Write the codes of the rays ``first <= i < last``.

    Of rays that miss the box, the place that is nearest to where they would enter counts.

    Parameters
    ----------
    rays : RayArrays
    box : (6,) float64
        Of the scene.
    codes : (n,) int32
    """
    cells = 1 << BITS
    scale_x = cells / (box[3] - box[0])
    scale_y = cells / (box[4] - box[1])
    scale_z = cells / (box[5] - box[2])
    for i in range(first, last):
        ox, oy, oz = rays.origins[i, 0], rays.origins[i, 1], rays.origins[i, 2]
        dx, dy, dz = rays.directions[i, 0], rays.directions[i, 1], rays.directions[i, 2]
        t = rays.t_min[i]
        t = later(t, box[0], box[3], ox, dx)
        t = later(t, box[1], box[4], oy, dy)
        t = later(t, box[2], box[5], oz, dz)
        x = spread(cell_of((ox + t * dx - box[0]) * scale_x))
        y = spread(cell_of((oy + t * dy - box[1]) * scale_y))
        z = spread(cell_of((oz + t * dz - box[2]) * scale_z))
        octant = (dx > 0.0) << 2 | (dy > 0.0) << 1 | (dz > 0.0)
        codes[i] = (x << 2 | y << 1 | z) << 3 | octant


@inlined
def later(t, low, high, origin, along):
    """Return the t at which a ray has entered a slab as well; `t` if it runs along that."""
    if along == 0.0:
        return t
    enter = ((low if along > 0.0 else high) - origin) / along
    return enter if enter > t else t


@inlined
def cell_of(place):
    """Return the cell at a place along an axis, the nearest if it is beyond the ends."""
    place = place if place > 0.0 else 0.0  # what is no number, in a flat scene, as well
    return whole(place if place < LAST_CELL else LAST_CELL)


@inlined
def spread(cell):
    """Move bit i of a number of BITS bits to place 3 i."""
    cell = (cell | cell << 4) & 0b000011000011
    return (cell | cell << 2) & 0b001001001001


@kernel
def sort_by_counting(codes, places, order):
    """Write the numbers of the codes, sorted; of equal codes in order.

    Parameters
    ----------
    codes : (n,) int32
    places : (CODES + 1,) int64
        Zeros; in the end, how many codes are less than each or equal to it.
    order : (n,) int32
    """
    for i in range(len(codes)):
        places[codes[i] + 1] += 1
    for code in range(1, len(places)):
        places[code] += places[code - 1]
    for i in range(len(codes)):
        code = codes[i]
        order[places[code]] = i
        places[code] += 1


def are_out_of_order(rays: RayArrays, box: np.ndarray) -> bool:
    """Say whether most rays of a batch enter the scene elsewhere than the ray before."""
    firsts = np.linspace(0, len(rays.t_max) - 2, SAMPLE).astype(np.int64)
    pairs = taken(rays, np.stack([firsts, firsts + 1], axis=1).ravel())
    codes = np.empty(2 * SAMPLE, np.int32)
    call(encode_entries, pairs, box, codes, 0, len(codes))
    return bool((codes[::2] != codes[1::2]).mean() > 0.5)


def may_be_sorted(items: int, choice: str) -> bool:
    """Say whether there may be batches that are sorted, over so many items."""
    if is_plain() or not has_numba():
        return False
    return choice == SORTED or (choice == AUTOMATIC and items >= LARGE_SCENE)


def order_of(
    rays: RayArrays, box: np.ndarray, items: int, choice: str, threads: int, progress: Progress
) -> np.ndarray | None:
    """Return the order in which to trace a batch, (n,) int32; None for that in which it is.

    Parameters
    ----------
    box : (6,) float64
        Of the scene.
    items : int
        In the scene.
    choice : str
        One of CHOICES. Where kernels run as plain Python nothing is sorted: it would not pay.
    threads : int
        0 takes every core.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    count = len(rays.t_max)
    if not may_be_sorted(items, choice):
        return None
    if choice == AUTOMATIC and (count < LARGE or not are_out_of_order(rays, box)):
        return None
    codes, order = np.empty(count, np.int32), np.empty(count, np.int32)

    def encode(first: int, last: int) -> None:
        call(encode_entries, rays, box, codes, first, last)

    for_chunks(encode, count, threads, progress, "Ordering rays")
    call(sort_by_counting, codes, np.zeros(CODES + 1, np.int64), order)
    return order


def taken(batch: T, numbers: np.ndarray) -> T:
    """Return those of a batch, of rays or cones, that have some numbers, in their order."""
    columns = [
        column.take(numbers, axis=0) if isinstance(column, np.ndarray) else taken(column, numbers)
        for column in batch
    ]
    return type(batch)(*columns)
