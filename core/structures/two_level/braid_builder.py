"""The builder of a re-braided top level: binned SAH over references that are opened on the way.

See :mod:`.rebraid` for what it does and why.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.workspace import MAXIMUM_DEPTH
from ...geometry.box import area_of, boxes_overlap, clear, include
from ...kernels import inner, kernel

BINS = 16

FEW = 4
"""References that are looked at pair by pair, whether they overlap."""

SINGLE = float(np.finfo(np.float32).eps)


class References(NamedTuple):
    """What the top level is built over; there is room behind those that there are.

    Attributes
    ----------
    boxes : (capacity, 6) float64
        In world space; of float32 numbers where those of instances are.
    owner, node : (capacity,) int32
        Instance, and node in the forest; -1 where the matrix is singular.
    """

    boxes: np.ndarray
    owner: np.ndarray
    node: np.ndarray


class Scratch(NamedTuple):
    """Memory of the builder: boxes, counts and costs of bins, and the box around a node."""

    bins: np.ndarray
    counts: np.ndarray
    areas: np.ndarray
    around: np.ndarray


class Openable(NamedTuple):
    """What may be opened, and the rules of it.

    Attributes
    ----------
    rows, first, size
        The forest: boxes in the spaces of meshes, children, items of leaves.
    matrices : (n, 3, 4) float64
    padding : (n,) float64
        By what boxes in an instance are enlarged; negative where it is not to be opened.
    is_single : bool
        Whether boxes are rounded to float32.
    extent : float
    """

    rows: np.ndarray
    first: np.ndarray
    size: np.ndarray
    matrices: np.ndarray
    padding: np.ndarray
    is_single: bool
    extent: float


@inner
def box_in_world(of, owner, node, around, out):
    """Write the box around a node of an instance, (6,), in the world; within that of its parent."""
    for row in range(3):
        middle, half = of.matrices[owner, row, 3], of.padding[owner]
        for axis in range(3):
            low, high = of.rows[node, axis], of.rows[node, 3 + axis]
            middle += of.matrices[owner, row, axis] * (0.5 * (low + high))
            half += abs(of.matrices[owner, row, axis]) * (0.5 * (high - low))
        low, high = middle - half, middle + half
        if of.is_single:
            # Rounding to the nearest moves a number by half of what it has been moved before.
            low = float(np.float32(low - abs(low) * SINGLE))
            high = float(np.float32(high + abs(high) * SINGLE))
        out[row] = max(low, around[row])
        out[3 + row] = min(high, around[3 + row])


@inner
def may_gain(references, first, end):
    """Say whether opening may gain anything: several instances, and few only if they overlap."""
    has_several = False
    for i in range(first + 1, end):
        has_several = has_several or references.owner[i] != references.owner[first]
    if not has_several or end - first > FEW:
        return has_several
    for i in range(first, end):
        for j in range(i + 1, end):
            if boxes_overlap(references.boxes[i], references.boxes[j]):
                return True
    return False


@inner
def open_long(references, of, first, end, limit, around, opened, n_opened):
    """Open what is long, each once, as long as there is room; return the new end, and how many.

    Parameters
    ----------
    limit : int
        Where the room ends.
    around : (6,) float64
        The box around all of them.
    opened : (capacity, 2) int32
        Instance and node of what was opened.
    """
    axis = 0
    for other in range(1, 3):
        if around[3 + other] - around[other] > around[3 + axis] - around[axis]:
            axis = other
    longest = of.extent * (around[3 + axis] - around[axis])
    last = end
    for i in range(first, last):
        owner, node = references.owner[i], references.node[i]
        if end >= limit:
            break
        if node < 0 or of.padding[owner] < 0.0 or of.size[node] > 0:
            continue
        if not references.boxes[i, 3 + axis] - references.boxes[i, axis] > longest:
            continue
        opened[n_opened, 0], opened[n_opened, 1] = owner, node
        n_opened += 1
        left = of.first[node]
        references.node[i], references.node[end] = left, left + 1
        references.owner[end] = owner
        box_in_world(of, owner, left + 1, references.boxes[i], references.boxes[end])
        box_in_world(of, owner, left, references.boxes[i], references.boxes[i])
        end += 1
    return end, n_opened


@inner
def best_split(references, first, end, bins, counts, areas):
    """Return axis and bin of the best plane between bins of centres; axis -1 for none.

    That for which the sum over both sides of area times references is least.
    """
    best_axis, best_bin, best = -1, 0, np.inf
    for axis in range(3):
        low, high = np.inf, -np.inf
        for i in range(first, end):
            centre = references.boxes[i, axis] + references.boxes[i, 3 + axis]
            low = centre if centre < low else low
            high = centre if centre > high else high
        if not low < high:
            continue
        scale = BINS * (1.0 - 1e-6) / (high - low)
        for k in range(BINS):
            clear(bins[k])
            counts[k] = 0
        for i in range(first, end):
            k = int((references.boxes[i, axis] + references.boxes[i, 3 + axis] - low) * scale)
            counts[k] += 1
            include(bins[k], references.boxes[i])
        clear(bins[BINS])
        number = 0
        for k in range(BINS - 1, 0, -1):
            number += counts[k]
            include(bins[BINS], bins[k])
            areas[k] = number * area_of(bins[BINS]) if number else 0.0
        clear(bins[BINS])
        number = 0
        for k in range(1, BINS):
            number += counts[k - 1]
            include(bins[BINS], bins[k - 1])
            if number == 0 or number == end - first:
                continue
            cost = number * area_of(bins[BINS]) + areas[k]
            if cost < best:
                best_axis, best_bin, best = axis, k, cost
    return best_axis, best_bin


@inner
def swap_references(references, i, j):
    """Let two references change places."""
    for side in range(6):
        value = references.boxes[i, side]
        references.boxes[i, side] = references.boxes[j, side]
        references.boxes[j, side] = value
    owner, node = references.owner[i], references.node[i]
    references.owner[i], references.node[i] = references.owner[j], references.node[j]
    references.owner[j], references.node[j] = owner, node


@inner
def partition_references(references, first, end, axis, border):
    """Bring what lies in bins below a border to the front; return where the rest begins."""
    low, high = np.inf, -np.inf
    for i in range(first, end):
        centre = references.boxes[i, axis] + references.boxes[i, 3 + axis]
        low = centre if centre < low else low
        high = centre if centre > high else high
    scale = BINS * (1.0 - 1e-6) / (high - low)
    middle = first
    for i in range(first, end):
        k = int((references.boxes[i, axis] + references.boxes[i, 3 + axis] - low) * scale)
        if k < border:
            swap_references(references, i, middle)
            middle += 1
    return middle


@kernel
def build_top(references, count, of, tree, out, opened, stack, scratch):
    """Build the tree of the top level, opening references on the way.

    Parameters
    ----------
    references : References
        The first `count` are the instances; the rest is room.
    tree : Tree
        Room for the nodes.
    out : References
        Written in the order of the leaves.
    stack : (STACK_SIZE, 6) int64
        Node, first, end, limit, depth, and whether more may be opened.
    scratch : Scratch

    Returns
    -------
    nodes, n_references, n_opened : int
    """
    bins, counts, areas, around = scratch
    nodes, taken, n_opened, height = 1, 0, 0, 1
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, count, len(references.owner)
    stack[0, 4], stack[0, 5] = 0, 1
    while height > 0:
        height -= 1
        node, first, end = stack[height, 0], stack[height, 1], stack[height, 2]
        limit, depth, opens = stack[height, 3], stack[height, 4], stack[height, 5]
        clear(around)
        for i in range(first, end):
            include(around, references.boxes[i])
        if opens == 1 and end < limit and may_gain(references, first, end):
            end, n_opened = open_long(references, of, first, end, limit, around, opened, n_opened)
            clear(around)
            for i in range(first, end):
                include(around, references.boxes[i])
        elif opens == 1:
            opens = 0
        for side in range(6):
            tree.boxes[node, side] = around[side]
        size = end - first
        if size == 1 or depth >= MAXIMUM_DEPTH:
            tree.first[node], tree.size[node] = taken, size
            for i in range(first, end):
                for side in range(6):
                    out.boxes[taken, side] = references.boxes[i, side]
                out.owner[taken], out.node[taken] = references.owner[i], references.node[i]
                taken += 1
            continue
        axis, border = best_split(references, first, end, bins, counts, areas)
        middle = (first + end) // 2
        if axis >= 0:
            middle = partition_references(references, first, end, axis, border)
        # The room is shared out by the number of references; those on the right move behind it.
        room = limit - end
        left_room = (room * (middle - first)) // size
        moved = end - middle
        for i in range(moved - 1, -1, -1):
            if left_room > 0:
                swap_references(references, middle + i, middle + left_room + i)
        tree.first[node], tree.size[node] = nodes, 0
        begin = middle + left_room
        for right in range(1, -1, -1):
            stack[height, 0] = nodes + right
            stack[height, 1] = begin if right else first
            stack[height, 2] = begin + moved if right else middle
            stack[height, 3] = limit if right else begin
            stack[height, 4], stack[height, 5] = depth + 1, opens
            height += 1
        nodes += 2
    return nodes, taken, n_opened
