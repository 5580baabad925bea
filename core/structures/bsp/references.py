"""What lies in a cell: items, each cut down to its part inside where it can be cut.

A *reference* is one item in one cell, with the polygon that is left of it there. A plane sends
a reference to the sides that its polygon reaches into by more than `shell`; one that does not, as
it lies in the plane, goes below. A polygon that reaches into both is cut (Sutherland and Hodgman),
so that no leaf lists a triangle for nothing. What is not flat goes to both as it is
(:mod:`...geometry.shapes`).

Rounding: a cut polygon is off by some units in the last place for each plane on the way from the
root, sixty at most. The shell is larger, and walks know of it (:mod:`.storage`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inner

MOST_PLANES = 61
"""On the way from the root: each adds a corner at most."""


class Lists(NamedTuple):
    """The references of all cells that wait to be split, and the lists of leaves.

    Attributes
    ----------
    item : (m,) int32
    start : (m,) int64
        First corner of its polygon, or point of its hull, in `points`.
    size : (m,) int32
        Number of these.
    points : (p, 3) float64
    listed : (l,) int32
        Items of the leaves, leaf after leaf.
    used : (3,) int64
        How much is in use of the references, of `points` and of `listed`.
    is_cut : (n,) bool
        Of every item of the scene: whether planes cut it.
    """

    item: np.ndarray
    start: np.ndarray
    size: np.ndarray
    points: np.ndarray
    listed: np.ndarray
    used: np.ndarray
    is_cut: np.ndarray


@inner
def project(lists, begin, stride, count, plane, low, high):
    """Write the least and largest position along a plane's normal of every `stride`-th polygon."""
    points, a, b, c = lists.points, plane[0], plane[1], plane[2]
    for i in range(count):
        reference = begin + i * stride
        start = lists.start[reference]
        least, most = np.inf, -np.inf
        for j in range(start, start + lists.size[reference]):
            h = a * points[j, 0] + b * points[j, 1] + c * points[j, 2]
            least = h if h < least else least
            most = h if h > most else most
        low[i], high[i] = least, most


@inner
def count_sides(low, high, count, position, shell):
    """Return how many references a plane sends below, and how many above."""
    n_above, n_only_above = 0, 0
    for i in range(count):
        is_above = high[i] > position + shell
        n_above += is_above
        n_only_above += is_above and low[i] >= position - shell
    return count - n_only_above, n_above


@inner
def append_side(lists, begin, count, plane, sign, shell):
    """Append the references of a cell's part above a plane, or below with sign -1; return how many.

    There must be room for all references and one corner more for each.
    """
    points, item, start, size = lists.points, lists.item, lists.start, lists.size
    first, place, corner = lists.used[0], lists.used[0], lists.used[1]
    for reference in range(begin, begin + count):
        this, n = start[reference], size[reference]
        least, most = np.inf, -np.inf
        for i in range(this, this + n):
            h = plane[0] * points[i, 0] + plane[1] * points[i, 1] + plane[2] * points[i, 2]
            h = sign * (h - plane[3])
            least = h if h < least else least
            most = h if h > most else most
        is_in_plane = most <= shell and least >= -shell
        if not (most > shell or (is_in_plane and sign < 0.0)):
            continue
        item[place], start[place] = item[reference], corner
        # A plane crosses the border of a convex polygon twice, one with rounding as well: what is
        # within the shell counts as on the plane, in both parts.
        is_cut, crossings = least < -shell and lists.is_cut[item[reference]], 0
        last = this + n - 1
        h = plane[0] * points[last, 0] + plane[1] * points[last, 1] + plane[2] * points[last, 2]
        before = sign * (h - plane[3])
        before = before if abs(before) > shell else 0.0
        for i in range(this, this + n):
            here = 0.0
            if is_cut:
                h = plane[0] * points[i, 0] + plane[1] * points[i, 1] + plane[2] * points[i, 2]
                here = sign * (h - plane[3])
                here = here if abs(here) > shell else 0.0
                if (here < 0.0 < before or before < 0.0 < here) and crossings < 2:
                    crossings += 1
                    share = before / (before - here)
                    for axis in range(3):
                        points[corner, axis] = points[last, axis] + share * (
                            points[i, axis] - points[last, axis]
                        )
                    corner += 1
            if here >= 0.0:
                for axis in range(3):
                    points[corner, axis] = points[i, axis]
                corner += 1
            last, before = i, here
        size[place] = corner - start[place]
        place += 1
    lists.used[0], lists.used[1] = place, corner
    return place - first


@inner
def move_references(lists, begin, count, place, corner):
    """Move references and their polygons down to a place; return the end of the polygons."""
    for reference in range(begin, begin + count):
        this = lists.start[reference]
        lists.item[place], lists.size[place] = lists.item[reference], lists.size[reference]
        lists.start[place] = corner
        for i in range(this, this + lists.size[place]):
            for axis in range(3):
                lists.points[corner, axis] = lists.points[i, axis]
            corner += 1
        place += 1
    return corner
