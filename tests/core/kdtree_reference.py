"""The two slower SAH builders of Wald and Havran: what the fast one must agree with, node for node.

Both work on boxes of references and know nothing of event lists that are kept sorted. The first
counts anew for every plane, O(N^2); the second sorts at every node, O(N log^2 N).
"""

import sys

import numpy as np
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.clip import POLYGON_SIZE, divide_reference
from accelscope.core.kernels import kernel
from accelscope.core.structures.subdivision.settings import depth_limit


@kernel
def divide(geometry, triangle, cells, left, axis, boxes, old, new, polygon):
    """Only kernels can call kernels."""
    divide_reference(geometry, triangle, cells, left, axis, boxes, old, new, polygon)


class Planes:
    """Costs of the planes of one axis of a cell."""

    def __init__(self, settings, cell, axis):
        self.settings = settings
        self.low, self.high = cell[axis], cell[3 + axis]
        size = cell[3:] - cell[:3]
        longest = size.max()
        width, height = (np.delete(size, axis)) / longest
        area = width * height + (width + height) * (size[axis] / longest)
        self.exists = size[axis] > 0 and area > 0
        if self.exists:
            self.across, self.around = width * height / area, (width + height) / (area * longest)

    def cost(self, position, n_below, n_above):
        below = self.across + self.around * (position - self.low)
        above = self.across + self.around * (self.high - position)
        s = self.settings
        cost = s.C_trav + s.C_isect * (below * n_below + above * n_above)
        return (1.0 - s.empty_bonus) * cost if n_below == 0 or n_above == 0 else cost


def counts_by_counting(low, high):
    """Yield position, triangles below, in the plane, above: each plane against each triangle."""
    flat = low == high
    for position in np.unique(np.concatenate([low, high])):
        planar = flat & (low == position)
        below, above = (low < position) & ~planar, (high > position) & ~planar
        yield position, int(below.sum()), int(planar.sum()), int(above.sum())


def counts_by_sweeping(low, high):
    """The same by sorting events and running over them: E9 of the notes."""
    events = []
    for a, b in zip(low, high):
        events += [(a, 1)] if a == b else [(a, 2), (b, 0)]
    events.sort()
    n_below, n_above, i = 0, len(low), 0
    while i < len(events):
        position, ends, planar, starts = events[i][0], 0, 0, 0
        while i < len(events) and events[i][0] == position:
            kind = events[i][1]
            ends, planar, starts = ends + (kind == 0), planar + (kind == 1), starts + (kind == 2)
            i += 1
        n_above -= ends + planar
        yield position, n_below, planar, n_above
        n_below += starts + planar


def choose(settings, cell, boxes, counts):
    """Return cost, axis, position, planar below, n_below, n_above of the best plane, or None."""
    best = (settings.C_isect * len(boxes),)
    for axis in range(3):
        planes = Planes(settings, cell, axis)
        if not planes.exists:
            continue
        for position, below, planar, above in counts(boxes[:, axis], boxes[:, 3 + axis]):
            if not planes.low < position < planes.high:
                continue
            for is_below in (True, False) if planar else (True,):
                n_below, n_above = below + planar * is_below, above + planar * (not is_below)
                cost = planes.cost(position, n_below, n_above)
                if cost < best[0]:
                    best = cost, axis, position, is_below, n_below, n_above
    return best if len(best) > 1 else None


def build(scene, triangles, settings, cell, counts):
    """Return the tree as nested tuples: (axis, position, left, right), or a leaf's triangles."""
    polygon = np.empty((2 * POLYGON_SIZE, 3))
    max_depth = depth_limit(settings.max_depth, len(scene))
    sys.setrecursionlimit(10_000)

    def grow(cell, ids, boxes, depth):
        best = None
        if len(ids) > settings.max_leaf_size and depth < max_depth:
            best = choose(settings, cell, boxes, counts)
        if best is None:
            return tuple(sorted(ids.tolist()))
        _, axis, position, planar_below, n_below, n_above = best
        low, high = boxes[:, axis], boxes[:, 3 + axis]
        planar = (low == position) & (high == position)
        is_below = (low < position) | (planar & planar_below)
        is_above = (high > position) | (planar & (not planar_below))
        assert (n_below, n_above) == (is_below.sum(), is_above.sum())
        left, right = cell.copy(), cell.copy()
        left[3 + axis] = right[axis] = position
        cells = np.stack([left, right])
        below, above, pair = boxes.copy(), boxes.copy(), np.empty((2, 6))
        for i in np.flatnonzero(is_below & is_above):
            pair[0] = boxes[i]
            divide(triangles, ids[i], cells, 0, axis, pair, 0, 1, polygon)
            below[i], above[i] = pair
        return (
            (axis, position),
            grow(left, ids[is_below], below[is_below], depth + 1),
            grow(right, ids[is_above], above[is_above], depth + 1),
        )

    return grow(cell, np.arange(len(scene), dtype=np.int32), boxes_of(triangles.corners), 0)


def nested(tree):
    """Return a built tree in the same form."""

    def of(node):
        link = int(tree.link[node])
        axis, number = link & 3, link >> 2
        if axis == 3:
            return tuple(tree.references[tree.offsets[number] : tree.offsets[number + 1]].tolist())
        return ((axis, tree.split[node]), of(number), of(number + 1))

    return of(0)
