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

from ...kernels import implements
from ..subdivision.frontier import Frontier
from ..subdivision.selection import select
from .builder import ABOVE, BELOW, BOTH, choose_plane, classify, divide_lists
from .work import BEGIN, DEPTH, EVENTS, FIRST, LEAF, SIZE, START, Limits, Work, start

CYCLIC, LONGEST, OBJECT_MEDIAN = range(3)
RULES = {"cyclic": CYCLIC, "longest": LONGEST, "object_median": OBJECT_MEDIAN}


class StaticPlanes(NamedTuple):
    """The rule: CYCLIC, LONGEST or OBJECT_MEDIAN."""

    rule: int


@implements(choose_plane, StaticPlanes)
def plane_by_rule(planes, work, node, scratch):
    """Take the first axis whose plane lies inside the cell."""
    nodes, cells, boxes, codes = work.nodes, work.cells, work.boxes, work.codes
    begin, n = nodes[node, BEGIN], nodes[node, SIZE]
    first_axis = nodes[node, DEPTH] % 3
    if planes.rule != CYCLIC:
        first_axis, longest = 0, 0.0
        for axis in range(3):
            if cells[node, 3 + axis] - cells[node, axis] > longest:
                first_axis, longest = axis, cells[node, 3 + axis] - cells[node, axis]
    for i in range(3):
        axis = (first_axis + i) % 3
        low, high = cells[node, axis], cells[node, 3 + axis]
        position = 0.5 * low + 0.5 * high
        if planes.rule == OBJECT_MEDIAN:
            middles = work.positions
            for k in range(n):
                reference = codes[begin + k] >> 2
                middles[scratch + k] = (
                    0.5 * boxes[reference, axis] + 0.5 * boxes[reference, 3 + axis]
                )
            position = select(middles, scratch, scratch + n - 1, scratch + n // 2)
        # A flat cell, or one of neighbouring numbers, has no plane inside.
        if low < position < high:
            return axis, position, True
    return LEAF, 0.0, True


@implements(classify, StaticPlanes)
def classify_boxes(planes, work, node, axis, position, planar_below, scratch):
    """Compare the boxes of all references with the plane."""
    nodes, boxes, codes, side = work.nodes, work.boxes, work.codes, work.side
    n_below, n_both = 0, 0
    for i in range(nodes[node, BEGIN], nodes[node, BEGIN] + nodes[node, SIZE]):
        reference = codes[i] >> 2
        if boxes[reference, axis] >= position and boxes[reference, 3 + axis] > position:
            side[reference] = ABOVE
            continue
        side[reference] = BELOW
        n_below += 1
        if boxes[reference, 3 + axis] > position:
            side[reference] = BOTH
            codes[scratch + n_both] = reference
            n_both += 1
    return n_below, n_both


@implements(divide_lists, StaticPlanes)
def divide_unsorted_lists(planes, work, node, scratch, n_both):
    """Copy every reference to the list of its side, then those of the parts."""
    nodes, codes, side = work.nodes, work.codes, work.side
    begin, left = nodes[node, BEGIN], nodes[node, FIRST]
    for which in range(2):
        place = nodes[left + which, BEGIN]
        for i in range(begin, begin + nodes[node, SIZE]):
            if side[codes[i] >> 2] == which:
                codes[place] = codes[i]
                place += 1
        for i in range(scratch + n_both * which, scratch + n_both * (which + 1)):
            codes[place] = 4 * codes[i] + START
            place += 1
        row = nodes[left + which]
        row[EVENTS], row[EVENTS + 1], row[EVENTS + 2] = row[SIZE], 0, 0


def start_static(boxes: np.ndarray, cell: np.ndarray, limits: Limits) -> tuple[Work, Frontier]:
    """Return the memory of a builder with a list of all triangles, in no order."""
    n = len(boxes)
    nothing = np.empty(0), np.empty(0, np.int32)
    codes = 4 * np.arange(n, dtype=np.int32) + START
    return start(boxes, cell, 1, [(np.zeros(n), codes), nothing, nothing], limits)
