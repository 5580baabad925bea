"""Planes by the surface area heuristic, in O(N log N) (Wald and Havran).

The cost of a cell V that is split by a plane into L and R is expected to be

    Cost = C_trav + C_isect * (SA(L) / SA(V) * N_L + SA(R) / SA(V) * N_R)

and a cell stays a leaf where no plane costs less than C_isect * N. Where one side is empty, the
cost is lowered by a share of `empty_bonus`: cutting off empty space pays off more than the formula
knows.

Between two neighbouring bounds of boxes the cost is linear in the plane's position, so only bounds
are candidates. They are *events*: a triangle's box ends, lies in the plane, or starts there. A
sweep over the sorted events of an axis knows at each position how many triangles are on the left
and on the right. Those that lie in the plane are tried on both sides.

Sorting at every node would cost O(N log^2 N). Here the events are sorted once, at the root. At a
split every reference is classified as left, right or both, the sorted lists are divided without
losing their order, and only triangles on both sides get new events, of their clipped parts, which
are sorted for themselves and merged. There are some sqrt(N) of those.

Ties: the first of the cheapest planes in the order of x, y, z, then of ascending position; those in
the plane go to the left if that is no worse. A sweep reads all events of one position before it
looks at the cost, so their order among each other does not matter.

I. Wald, V. Havran: On building fast kd-trees for ray tracing, and on doing that in O(N log N),
RT 2006.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from ...kernels import implements, inlined, inner, unsigned, whole
from ...parallel import core_count
from ..subdivision.frontier import Frontier
from ..subdivision.subtrees import Meter, results_of
from .builder import ABOVE, BELOW, BOTH, choose_plane, classify, divide_lists
from .work import AXIS, BEGIN, END, EVENTS, FIRST, LEAF, PLANAR, SIZE, START, Limits, Work, start

ONE, TWO = unsigned(1), unsigned(2)


class SweepPlanes(NamedTuple):
    """Constants of the cost; `keep` is 1 - empty_bonus."""

    c_trav: float
    c_isect: float
    keep: float


@inlined
def plane_cost(planes, n_below, n_above, share_below, share_above):
    """Return the cost of a plane, lowered if one side is empty.

    The shares are SA(L) / SA(V) and SA(R) / SA(V).
    """
    cost = planes.c_trav + planes.c_isect * (share_below * n_below + share_above * n_above)
    return planes.keep * cost if n_below == 0 or n_above == 0 else cost


@inner
def sweep(planes, positions, codes, first, count, n, low, high, across, around, best_cost):
    """Find the cheapest plane of one axis, if it costs less than `best_cost`.

    Parameters
    ----------
    first, count : int
        The events.
    n : int
        Triangles of the cell.
    low, high : float
        Where the cell starts and ends; planes lie inside.
    across, around : float
        A piece of the cell that is x long has the share ``across + around * x`` of its area.
    best_cost : float
        Only planes that cost less are of interest.

    Returns
    -------
    cost : float
        `best_cost` if there is none.
    position : float
    planar_below : bool
        Whether the triangles in the plane go below.
    """
    best_position, best_below = np.nan, True
    n_below, n_above = 0, n
    i, last = unsigned(first), unsigned(first + count)
    while i < last:
        here = positions[i]
        ends, planar, starts = 0, 0, 0
        while i < last and positions[i] == here:
            kind = codes[i] & 3
            ends += kind == END
            planar += kind == PLANAR
            starts += kind == START
            i += ONE
        n_above -= ends + planar
        if low < here < high:
            share_below = across + around * (here - low)
            share_above = across + around * (high - here)
            cost = plane_cost(planes, n_below + planar, n_above, share_below, share_above)
            if cost < best_cost:
                best_cost, best_position, best_below = cost, here, True
            if planar > 0:
                cost = plane_cost(planes, n_below, n_above + planar, share_below, share_above)
                if cost < best_cost:
                    best_cost, best_position, best_below = cost, here, False
        n_below += starts + planar
    return best_cost, best_position, best_below


@implements(choose_plane, SweepPlanes)
def cheapest_plane(planes, work, node, scratch):
    """Sweep along all three axes. The plane must lie inside the cell and cost less than a leaf."""
    row, cell = work.nodes[node], work.cells[node]
    n = row[SIZE]
    best_axis, best_position, best_below = LEAF, 0.0, True
    best_cost = planes.c_isect * n
    longest = 0.0
    for axis in range(3):
        longest = max(longest, cell[3 + axis] - cell[axis])
    for axis in range(3):
        # Lengths relative to the longest, lest areas of tiny scenes vanish.
        u, v = (axis + 1) % 3, (axis + 2) % 3
        low, high = cell[axis], cell[3 + axis]
        width = (cell[3 + u] - cell[u]) / longest
        height = (cell[3 + v] - cell[v]) / longest
        area = width * height + (width + height) * ((high - low) / longest)
        if low < high and area > 0.0:
            cost, position, below = sweep(
                planes, work.positions, work.codes, row[BEGIN] + 2 * n * axis,
                row[EVENTS + axis], n, low, high,
                width * height / area, (width + height) / (area * longest), best_cost,
            )  # fmt: skip
            if cost < best_cost:
                best_axis, best_position, best_cost, best_below = axis, position, cost, below
    return best_axis, best_position, best_below


@implements(classify, SweepPlanes)
def classify_events(planes, work, node, axis, position, planar_below, scratch):
    """Go through the events of the split axis: a triangle is on both sides till it ends."""
    row, positions, codes, side = work.nodes[node], work.positions, work.codes, work.side
    n_below, n_both = 0, 0
    begin = row[BEGIN] + 2 * row[SIZE] * axis
    i, last = unsigned(begin), unsigned(begin + row[EVENTS + axis])
    while i < last:
        code, here = codes[i], positions[i]
        kind, reference = code & 3, unsigned(code) >> TWO
        i += ONE
        if kind == END:
            # What starts below and has not ended at the plane is on both sides.
            if here > position and side[reference] == BELOW:
                side[reference] = BOTH
                codes[scratch + n_both] = reference
                n_both += 1
        elif here < position or (here == position and planar_below and kind == PLANAR):
            side[reference] = BELOW
            n_below += 1
        else:
            side[reference] = ABOVE
    return n_below, n_both


@inner
def divide_events(positions, codes, first, count, side, below, above):
    """Copy what stays on one side of the plane from the cell's list to those of its children.

    Every event is written to both places, and one of them then moves on: a choice would be
    guessed wrongly half of the time.

    Parameters
    ----------
    first, count : int
        The cell's list of one axis.
    below, above : int
        Where those of the children start.

    Returns
    -------
    n_below, n_above : int
    """
    i, last = unsigned(first), unsigned(first + count)
    to_below, to_above = unsigned(below), unsigned(above)
    while i < last:
        code, position = codes[i], positions[i]
        where = side[unsigned(code) >> TWO]
        positions[to_below], codes[to_below] = position, code
        positions[to_above], codes[to_above] = position, code
        to_below += unsigned(where == BELOW)
        to_above += unsigned(where == ABOVE)
        i += ONE
    return whole(to_below) - below, whole(to_above) - above


@inner
def merge_parts(positions, codes, begin, count, boxes, axis, parts, n_parts):
    """Put the events of clipped parts into a list; return their number.

    Parameters
    ----------
    begin, count : int
        The list, which has room behind it.
    parts, n_parts : int
        Where `codes` has the references; behind them is scratch.
    """
    # Write.
    fresh, n = parts + 2 * n_parts, 0
    for i in range(parts, parts + n_parts):
        code, box = 4 * codes[i], boxes[codes[i]]
        low, high = box[axis], box[3 + axis]
        positions[fresh + n], codes[fresh + n] = low, code + (START if low < high else PLANAR)
        n += 1
        if low < high:
            positions[fresh + n], codes[fresh + n] = high, code + END
            n += 1
    # Sort: insertion across ever smaller gaps (Shell), since there are mostly few.
    gap = 1
    while 3 * gap < n:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(fresh + gap, fresh + n):
            position, code = positions[i], codes[i]
            j = i
            while j >= fresh + gap and positions[j - gap] > position:
                positions[j], codes[j] = positions[j - gap], codes[j - gap]
                j -= gap
            positions[j], codes[j] = position, code
        gap //= 3
    # Merge, from the back.
    kept, to = begin + count - 1, begin + count + n - 1
    for i in range(fresh + n - 1, fresh - 1, -1):
        position, code = positions[i], codes[i]
        while kept >= begin and positions[kept] > position:
            positions[to], codes[to] = positions[kept], codes[kept]
            kept -= 1
            to -= 1
        positions[to], codes[to] = position, code
        to -= 1
    return n


@implements(divide_lists, SweepPlanes)
def divide_sorted_lists(planes, work, node, scratch, n_both):
    """Divide the lists of all axes in order, then merge in the events of clipped parts."""
    positions, codes, row = work.positions, work.codes, work.nodes[node]
    below, above = work.nodes[row[FIRST]], work.nodes[row[FIRST] + 1]
    are_leaves = below[AXIS] == LEAF and above[AXIS] == LEAF
    for axis in range(1 if are_leaves else 3):
        below[EVENTS + axis], above[EVENTS + axis] = divide_events(
            positions, codes, row[BEGIN] + 2 * row[SIZE] * axis, row[EVENTS + axis], work.side,
            below[BEGIN] + 2 * below[SIZE] * axis, above[BEGIN] + 2 * above[SIZE] * axis,
        )  # fmt: skip
    for side in range(2):
        child = work.nodes[row[FIRST] + side]
        parts = scratch + n_both * side
        if child[AXIS] == LEAF:
            for i in range(n_both):
                codes[child[BEGIN] + child[EVENTS] + i] = 4 * codes[parts + i] + START
            child[EVENTS] += n_both
            continue
        for axis in range(3):
            child[EVENTS + axis] += merge_parts(
                positions, codes, child[BEGIN] + 2 * child[SIZE] * axis, child[EVENTS + axis],
                work.boxes, axis, parts, n_both,
            )  # fmt: skip


# -------------------------------------------------------------------------------------- starting


def events_of(boxes: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and codes of the events of boxes (n, 6) along an axis, sorted."""
    low, high = boxes[:, axis], boxes[:, 3 + axis]
    code = 4 * np.arange(len(boxes), dtype=np.int32)
    flat = low == high
    positions = np.concatenate([high[~flat], low[flat], low[~flat]])
    codes = np.concatenate([code[~flat] + END, code[flat] + PLANAR, code[~flat] + START])
    order = np.argsort(positions)
    return positions[order], codes[order]


def start_sweep(
    boxes: np.ndarray, cell: np.ndarray, limits: Limits, meter: Meter
) -> tuple[Work, Frontier]:
    """Return the memory of a builder with the sorted events of all triangles.

    Each axis has room for two events per triangle; one place more is for :func:`divide_events` to
    write to.

    Raises
    ------
    Cancelled
        From the meter, when the axes that are being sorted are.
    """
    with ThreadPoolExecutor(min(core_count(), 3)) as pool:
        axes = [pool.submit(events_of, boxes, axis) for axis in range(3)]
        try:
            lists = results_of(axes, meter)
        finally:
            for axis in axes:
                axis.cancel()
    return start(boxes, cell, 6, lists, limits)
