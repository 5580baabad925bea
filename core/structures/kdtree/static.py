"""Planes by simple rules, which look at the cell but not at the cost.

- *cyclic*: the middle of the cell, along x, y and z in turn (lecture, "KD-tree (static variant)");
- *longest*: the middle of its longest side, the spatial median;
- *object_median*: along the longest side, where half of the boxes have their middle on either side.

A triangle goes to every side that the part of it inside the cell reaches into. One that only
touches the plane goes to the side it lies on, one that lies in the plane below.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import implements, inlined, inner
from .builder import (
    BEGIN,
    DEPTH,
    LEAF,
    N_LISTED,
    N_REFERENCES,
    SIZE,
    TOP,
    Work,
    list_references,
    list_size,
    make_work,
    split_cell,
)
from .clip import divide_reference

CYCLIC, LONGEST, OBJECT_MEDIAN = range(3)
RULES = {"cyclic": CYCLIC, "longest": LONGEST, "object_median": OBJECT_MEDIAN}


class StaticPlanes(NamedTuple):
    """The rule: CYCLIC, LONGEST or OBJECT_MEDIAN."""

    rule: int


@inner
def select(values, count, rank):
    """Return the value of a rank among the first `count`, which are reordered (Hoare)."""
    first, last = 0, count - 1
    while first < last:
        pivot = values[(first + last) // 2]
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if rank <= j:
            last = j
        elif rank >= i:
            first = i
        else:
            return pivot
    return values[rank]


@inlined
def plane_along(planes, work, axis, begin, n):
    """Return the plane of the rule along an axis."""
    low, high = work.cell[0, axis], work.cell[0, 3 + axis]
    if planes.rule != OBJECT_MEDIAN:
        return 0.5 * low + 0.5 * high
    middles = work.fresh_positions
    for i in range(n):
        reference = work.codes[begin + i]
        middles[i] = 0.5 * work.boxes[reference, axis] + 0.5 * work.boxes[reference, 3 + axis]
    return select(middles, n, n // 2)


@implements(list_size, StaticPlanes)
def references_at_most(planes, n):
    """One entry for each reference."""
    return n


@implements(split_cell, StaticPlanes)
def split_by_rule(planes, limits, work, corners):
    """Take the first axis whose plane lies inside the cell; sort the references to its sides."""
    taken, state, cell, codes, boxes = work.taken, work.state, work.cell, work.codes, work.boxes
    begin, n = taken[0, BEGIN], taken[0, SIZE]
    first_axis = taken[0, DEPTH] % 3
    if planes.rule != CYCLIC:
        first_axis = 0
        for other in range(1, 3):
            longest = cell[0, 3 + first_axis] - cell[0, first_axis]
            if cell[0, 3 + other] - cell[0, other] > longest:
                first_axis = other
    axis, position = LEAF, 0.0
    for i in range(3):
        other = (first_axis + i) % 3
        plane = plane_along(planes, work, other, begin, n)
        # A flat cell, or one of neighbouring numbers, has no plane inside.
        if cell[0, other] < plane < cell[0, 3 + other]:
            axis, position = other, plane
            break
    if axis == LEAF:
        return LEAF, 0.0

    # The right child's list first. Those on both sides get a second reference.
    place, n_above = state[TOP], 0
    for i in range(begin, begin + n):
        reference = codes[i]
        low, high = boxes[reference, axis], boxes[reference, 3 + axis]
        if high <= position:
            continue
        if low < position:
            new = state[N_REFERENCES]
            state[N_REFERENCES] += 1
            work.triangle[new] = work.triangle[reference]
            divide_reference(
                corners, work.triangle[reference], cell[0], axis, position, boxes, reference, new,
                work.polygon, work.bounds,
            )  # fmt: skip
            reference = new
        codes[place + n_above] = reference
        n_above += 1
    taken[2, SIZE], taken[2, BEGIN] = n_above, place
    place += n_above
    n_below = 0
    for i in range(begin, begin + n):
        # Parts below of the divided ones end at the plane at the latest.
        reference = codes[i]
        if boxes[reference, 3 + axis] <= position:
            codes[place + n_below] = reference
            n_below += 1
    taken[1, SIZE], taken[1, BEGIN] = n_below, place
    state[TOP] = place + n_below
    return axis, position


@implements(list_references, StaticPlanes)
def list_of_references(planes, work):
    """Copy the list."""
    taken, state = work.taken, work.state
    begin, place = taken[0, BEGIN], state[N_LISTED]
    for i in range(taken[0, SIZE]):
        work.listed[place + i] = work.triangle[work.codes[begin + i]]
    state[N_LISTED] = place + taken[0, SIZE]


def start_static(boxes: np.ndarray, cell: np.ndarray) -> Work:
    """Return the memory of a builder with a list of all triangles."""
    n = len(boxes)
    work = make_work(n, n, cell)
    work.triangle[:n] = np.arange(n)
    work.boxes[:n] = boxes
    work.codes[:n] = np.arange(n)
    return work


def extract_static(work: Work, row: int) -> Work:
    """Return a builder of its own for a candidate, its references numbered anew."""
    candidate = work.candidates[row]
    n, begin = int(candidate[SIZE]), int(candidate[BEGIN])
    references = work.codes[begin : begin + n]
    own = start_static(work.boxes[references], work.cells[row])
    own.triangle[:n] = work.triangle[references]
    own.candidates[0, DEPTH] = candidate[DEPTH]
    return own
