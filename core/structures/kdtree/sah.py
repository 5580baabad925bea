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

from ...kernels import call, implements, inlined, inner, kernel
from .builder import (
    BEGIN,
    DEPTH,
    EVENTS,
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

END, PLANAR, START = range(3)
"""Kinds of events; a code is 4 * reference + kind."""

ONE, TWO = np.uint64(1), np.uint64(2)
"""Unsigned, since Numba looks at every signed index whether it is negative."""

BELOW, ABOVE, BOTH = range(3)
"""Sides of a reference."""


class SweepPlanes(NamedTuple):
    """Constants of the cost; `keep` is 1 - empty_bonus."""

    c_trav: float
    c_isect: float
    keep: float


@inlined
def inner_cost(planes, n_below, n_above, share_below, share_above):
    """Return the cost of a plane; the shares are SA(L) / SA(V) and SA(R) / SA(V)."""
    return planes.c_trav + planes.c_isect * (share_below * n_below + share_above * n_above)


@inlined
def plane_cost(planes, n_below, n_above, share_below, share_above):
    """Return the cost of a plane, lowered if one side is empty."""
    cost = inner_cost(planes, n_below, n_above, share_below, share_above)
    return planes.keep * cost if n_below == 0 or n_above == 0 else cost


@inner
def sweep(planes, positions, codes, first, count, n, low, high, across, around, best_cost):
    """Find the cheapest plane of one axis, if it costs less than `best_cost`.

    Of equal positions come ends first, then planar events, then starts. So the counts are right
    after the last end and before the first start; the planes tried in between have too many
    triangles on one side, cost more, and do no harm.

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
    i, last = np.uint64(first), np.uint64(first + count)
    # Before the first position and behind the last one there is nothing.
    here = positions[i]
    if low < here < high:
        cost = plane_cost(
            planes, 0, n, across + around * (here - low), across + around * (high - here)
        )
        if cost < best_cost:
            best_cost, best_position, best_below = cost, here, False
    n_below, n_above = 0, n
    while i < last:
        kind, here = codes[i] & 3, positions[i]
        i += ONE
        share_below = across + around * (here - low)
        share_above = across + around * (high - here)
        if kind == PLANAR:
            planar = 1
            while i < last and positions[i] == here and (codes[i] & 3) == PLANAR:
                planar += 1
                i += ONE
            cost = inner_cost(planes, n_below, n_above, share_below, share_above)
            if cost < best_cost and low < here < high:
                best_cost, best_position, best_below = cost, here, False
            n_below += planar
            n_above -= planar
            cost = inner_cost(planes, n_below, n_above, share_below, share_above)
            if (cost < best_cost or (cost == best_cost and here == best_position)) and (
                low < here < high
            ):
                best_cost, best_position, best_below = cost, here, True
            continue
        is_start = kind >> 1
        n_above -= 1 - is_start
        cost = inner_cost(planes, n_below, n_above, share_below, share_above)
        if cost < best_cost and low < here < high:
            best_cost, best_position, best_below = cost, here, is_start == 1
        n_below += is_start
    if low < here < high:
        cost = plane_cost(
            planes, n, 0, across + around * (here - low), across + around * (high - here)
        )
        if cost < best_cost or (cost == best_cost and here == best_position):
            best_cost, best_position, best_below = cost, here, True
    return best_cost, best_position, best_below


@inlined
def find_plane(planes, positions, codes, begin, n, events, cell):
    """Return axis and position of the cheapest plane, and whether planar triangles go below.

    The axis is LEAF if no plane inside the cell costs less than a leaf.

    Parameters
    ----------
    begin : int
        Where the lists of the cell start; those of the three axes are 2 n apart.
    events : (1, N_COLUMNS) int64
        Row 0 holds the number of events per axis from column EVENTS on.
    cell : (1, 6) float64
        Row 0 is the box of the cell.
    """
    best_axis, best_position, best_cost, best_below = LEAF, 0.0, planes.c_isect * n, True
    x, y, z = cell[0, 3] - cell[0, 0], cell[0, 4] - cell[0, 1], cell[0, 5] - cell[0, 2]
    longest = max(x, y, z)
    for axis in range(3):
        length = x if axis == 0 else y if axis == 1 else z
        # Lengths relative to the longest, lest areas of tiny scenes vanish.
        width = (y if axis == 0 else x) / longest
        height = (y if axis == 2 else z) / longest
        area = width * height + (width + height) * (length / longest)
        if not (length > 0.0 and area > 0.0):
            continue
        cost, position, below = sweep(
            planes, positions, codes, begin + 2 * n * axis, events[0, EVENTS + axis], n,
            cell[0, axis], cell[0, 3 + axis],
            width * height / area, (width + height) / (area * longest), best_cost,
        )  # fmt: skip
        if cost < best_cost:
            best_axis, best_position, best_cost, best_below = axis, position, cost, below
    return best_axis, best_position, best_below


@inlined
def classify(positions, codes, begin, count, position, planar_below, sides, straddlers):
    """Find the side of every reference in the events of the split axis.

    Returns
    -------
    n_below, n_above, n_both : int
        Those on both sides are listed in `straddlers`.
    """
    n_below, n_above, n_both = 0, 0, 0
    i, last = np.uint64(begin), np.uint64(begin + count)
    while i < last:
        code, here = codes[i], positions[i]
        kind, reference = code & 3, np.uint64(code) >> TWO
        i += ONE
        if kind == START:
            if here >= position:
                sides[reference] = ABOVE
                n_above += 1
            else:
                sides[reference] = BOTH
        elif kind == END:
            if here <= position:
                sides[reference] = BELOW
                n_below += 1
            elif sides[reference] == BOTH:
                straddlers[n_both] = reference
                n_both += 1
        elif here < position or (here == position and planar_below):
            sides[reference] = BELOW
            n_below += 1
        else:
            sides[reference] = ABOVE
            n_above += 1
    return n_below, n_above, n_both


@inner
def write_fresh(boxes, straddlers, first_new, side, count, axis, positions, codes):
    """Write the events of clipped parts; return their number.

    The parts below have the old references `straddlers`, those above `first_new` and following.
    """
    n = 0
    for i in range(count):
        reference = straddlers[i] if side == BELOW else first_new + i
        low, high = boxes[reference, axis], boxes[reference, 3 + axis]
        positions[n] = low
        codes[n] = 4 * reference + (START if low < high else PLANAR)
        n += 1
        if low < high:
            positions[n] = high
            codes[n] = 4 * reference + END
            n += 1
    return n


@inlined
def comes_later(position, code, other, other_code):
    """Say whether an event comes after another one: by position, then by kind."""
    return position > other or (position == other and (code & 3) > (other_code & 3))


@inner
def sort_fresh(positions, codes, count):
    """Sort events: insertion across ever smaller gaps (Shell), since there are mostly few."""
    gap = 1
    while 3 * gap < count:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, count):
            position, code = positions[i], codes[i]
            j = i
            while j >= gap and comes_later(positions[j - gap], codes[j - gap], position, code):
                positions[j], codes[j] = positions[j - gap], codes[j - gap]
                j -= gap
            positions[j], codes[j] = position, code
        gap //= 3


@inner
def divide_events(positions, codes, first, count, sides, below, above):
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
    i, last = np.uint64(first), np.uint64(first + count)
    to_below, to_above = np.uint64(below), np.uint64(above)
    while i < last:
        code, position = codes[i], positions[i]
        side = sides[np.uint64(code) >> TWO]
        positions[to_below], codes[to_below] = position, code
        positions[to_above], codes[to_above] = position, code
        to_below += np.uint64(side == BELOW)
        to_above += np.uint64(side == ABOVE)
        i += ONE
    return np.int64(to_below) - below, np.int64(to_above) - above


@inner
def merge_fresh(positions, codes, begin, count, fresh, fresh_codes, n_fresh):
    """Merge the sorted fresh events into a list, from the back."""
    kept, new, to = begin + count - 1, n_fresh - 1, begin + count + n_fresh - 1
    while new >= 0:
        position, code = fresh[new], fresh_codes[new]
        while kept >= begin and comes_later(positions[kept], codes[kept], position, code):
            positions[to], codes[to] = positions[kept], codes[kept]
            kept -= 1
            to -= 1
        positions[to], codes[to] = position, code
        new -= 1
        to -= 1


# ------------------------------------------------------------------------ what the builder calls


@implements(list_size, SweepPlanes)
def events_at_most(planes, n):
    """Two events on each of three axes, and one place for :func:`divide_events` to write to.

    A planar triangle has but one event and leaves a gap.
    """
    return 6 * n + 1


@implements(split_cell, SweepPlanes)
def split_by_sweep(planes, limits, work, corners):
    """Find the plane, classify, clip, divide the lists."""
    taken, state, sides = work.taken, work.state, work.side
    positions, codes, boxes, straddlers = work.positions, work.codes, work.boxes, work.straddlers
    begin, n = taken[0, BEGIN], taken[0, SIZE]
    axis, position, planar_below = find_plane(planes, positions, codes, begin, n, taken, work.cell)
    if axis == LEAF:
        return LEAF, 0.0

    n_below, n_above, n_both = classify(
        positions, codes, begin + 2 * n * axis, taken[0, EVENTS + axis], position, planar_below,
        sides, straddlers,
    )  # fmt: skip
    first_new = state[N_REFERENCES]
    state[N_REFERENCES] += n_both
    for i in range(n_both):
        work.triangle[first_new + i] = work.triangle[straddlers[i]]
    n_below += n_both
    n_above += n_both
    taken[2, SIZE], taken[2, BEGIN] = n_above, state[TOP]
    taken[1, SIZE], taken[1, BEGIN] = n_below, state[TOP] + 6 * n_above + 1
    state[TOP] += 6 * (n_above + n_below) + 2

    if max(n_below, n_above) <= limits.max_leaf_size or taken[0, DEPTH] + 1 >= limits.max_depth:
        # Two leaves need but a list of what is in them, in any order.
        below, above = taken[1, BEGIN], taken[2, BEGIN]
        kept_below, kept_above = divide_events(
            positions, codes, begin, taken[0, EVENTS], sides, below, above
        )
        for i in range(n_both):
            codes[below + kept_below + i] = 4 * straddlers[i] + START
            codes[above + kept_above + i] = 4 * (first_new + i) + START
        taken[1, EVENTS], taken[2, EVENTS] = kept_below + n_both, kept_above + n_both
        return axis, position

    for i in range(n_both):
        divide_reference(
            corners, work.triangle[straddlers[i]], work.cell[0], axis, position,
            boxes, straddlers[i], first_new + i, work.polygon, work.bounds,
        )  # fmt: skip
    fresh, fresh_codes = work.fresh_positions, work.fresh_codes
    for other in range(3):
        below, above = taken[1, BEGIN] + 2 * n_below * other, taken[2, BEGIN] + 2 * n_above * other
        kept_below, kept_above = divide_events(
            positions, codes, begin + 2 * n * other, taken[0, EVENTS + other], sides, below, above
        )
        taken[1, EVENTS + other], taken[2, EVENTS + other] = kept_below, kept_above
        if n_both == 0:
            continue
        for side in range(2):
            if taken[1 + side, SIZE] <= limits.max_leaf_size and other > 0:
                continue  # a leaf needs one list
            list_of_child = taken[1 + side, BEGIN] + 2 * taken[1 + side, SIZE] * other
            n_fresh = write_fresh(
                boxes, straddlers, first_new, side, n_both, other, fresh, fresh_codes
            )
            sort_fresh(fresh, fresh_codes, n_fresh)
            kept = taken[1 + side, EVENTS + other]
            merge_fresh(positions, codes, list_of_child, kept, fresh, fresh_codes, n_fresh)
            taken[1 + side, EVENTS + other] += n_fresh
    return axis, position


@implements(list_references, SweepPlanes)
def list_of_events(planes, work):
    """Every reference of a cell has one event that starts it or is planar."""
    taken, state = work.taken, work.state
    begin, place = taken[0, BEGIN], state[N_LISTED]
    for i in range(begin, begin + taken[0, EVENTS]):
        code = work.codes[i]
        if (code & 3) != END:
            work.listed[place] = work.triangle[code >> 2]
            place += 1
    state[N_LISTED] = place


# -------------------------------------------------------------------------------------- starting


@kernel
def order_kinds(positions, codes, spare):
    """Bring events of one position into the order of their kinds; `spare` is (n,) int32."""
    n = len(positions)
    first = 0
    while first < n:
        last = first + 1
        while last < n and positions[last] == positions[first]:
            last += 1
        if last > first + 1:
            place = first
            for kind in range(3):
                for i in range(first, last):
                    if (codes[i] & 3) == kind:
                        spare[place] = codes[i]
                        place += 1
            for i in range(first, last):
                codes[i] = spare[i]
        first = last


def events_of(boxes: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and codes of the events of boxes (n, 6) along an axis, sorted."""
    low, high = boxes[:, axis], boxes[:, 3 + axis]
    code = 4 * np.arange(len(boxes), dtype=np.int32)
    flat = low == high
    if flat.any():
        positions = np.concatenate([high[~flat], low[flat], low[~flat]])
        codes = np.concatenate([code[~flat] + END, code[flat] + PLANAR, code[~flat] + START])
    else:
        positions, codes = np.concatenate([high, low]), np.concatenate([code + END, code + START])
    order = np.argsort(positions)
    positions, codes = positions[order], codes[order]
    call(order_kinds, positions, codes, np.empty_like(codes))
    return positions, codes


def start_sweep(boxes: np.ndarray, cell: np.ndarray) -> Work:
    """Return the memory of a builder with the sorted events of all triangles."""
    n = len(boxes)
    work = make_work(n, 6 * n + 1, cell)
    work.triangle[:n] = np.arange(n)
    work.boxes[:n] = boxes
    with ThreadPoolExecutor(3) as pool:
        lists = list(pool.map(lambda axis: events_of(boxes, axis), range(3)))
    for axis, (positions, codes) in enumerate(lists):
        begin = 2 * n * axis
        work.positions[begin : begin + len(positions)] = positions
        work.codes[begin : begin + len(codes)] = codes
        work.candidates[0, EVENTS + axis] = len(codes)
    return work


def extract_sweep(work: Work, row: int) -> Work:
    """Return a builder of its own for a candidate, its references numbered anew."""
    candidate = work.candidates[row]
    n, begin = int(candidate[SIZE]), int(candidate[BEGIN])
    own = make_work(n, 6 * n + 1, work.cells[row])
    own.candidates[0, DEPTH] = candidate[DEPTH]
    own.candidates[0, EVENTS : EVENTS + 3] = candidate[EVENTS : EVENTS + 3]
    for axis in range(3):
        source, target = begin + 2 * n * axis, 2 * n * axis
        count = int(candidate[EVENTS + axis])
        codes = work.codes[source : source + count]
        if axis == 0:
            references = codes[(codes & 3) != END] >> 2
            number = np.empty(len(work.triangle), np.int32)
            number[references] = np.arange(n)
        own.positions[target : target + count] = work.positions[source : source + count]
        own.codes[target : target + count] = 4 * number[codes >> 2] + (codes & 3)
    own.triangle[:n] = work.triangle[references]
    own.boxes[:n] = work.boxes[references]
    return own
