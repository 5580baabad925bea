"""Where the planes of a BSP tree go.

- *autopartition*: in the plane of one of the triangles. Of a few, pseudo-random ones, the one that
  cuts fewest others, and has about as many on either side.
- *sah*: where the surface area heuristic (:mod:`..kdtree.sah`) costs least, over planes across the
  three axes, planes of triangles, and planes through their edges perpendicular to them. The areas
  are those of the convex cells.
- *fixed*: the same over a fixed set of directions, the normals of a k-DOP (restricted BSP, RBSP).

Trying everything would take for ever, so: across each fixed direction, planes at all ends of the
polygons where there are at most EXACT of these, else BINS planes at equal distances. Of oblique
planes at most `candidates` are tried per cell, four per triangle, of triangles at equal distances
in the list. Where there are more than SAMPLE references, every second, third, ... speaks for all.

H. Fuchs, Z. Kedem, B. Naylor: On Visible Surface Generation by A Priori Tree Structures, SIGGRAPH
1980. M. Paterson, F. Yao: Efficient Binary Space Partitions for Hidden-Surface Removal and Solid
Modeling, DCG 1990 (autopartition). R. Kammaje, B. Mora: A Study of Restricted BSP Trees for Ray
Tracing, RT 2007. T. Ize, I. Wald, S. Parker: Ray Tracing with the BSP Tree, RT 2008.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from ...kernels import dispatched, implements, inner, whole
from .polyhedron import measure_heights, side_areas
from .references import count_sides, project

EXACT = 24
BINS = 32
SAMPLE = 2048

MARGIN = 4.0
"""A plane must leave that many shells of the cell on either side."""

SAFELY = 1.0 - 1e-9
"""Factor of a lower bound that leaves room for rounding."""

CUT = 8.0
"""What one cut triangle weighs, for autopartition, against one more on one side than the other."""

ATTEMPTS = 256
"""Planes of triangles that are looked at, for autopartition: those on the border do not cut."""

PRIME = 2654435761
"""Steps of so many, modulo n, come to each of n triangles once, in a scattered order."""

EDGES, OWN = 3, whole(3)
"""Planes of a triangle: through its edges 0, 1, 2, and its own."""


class Heuristic(NamedTuple):
    """SAH over `directions`, (k, 3) float64 of unit length, and `candidates` oblique planes.

    `keep` is the share of the cost that is left where one side is empty.
    """

    directions: np.ndarray
    candidates: int
    c_trav: float
    c_isect: float
    keep: float


class Autopartition(NamedTuple):
    """The best of `candidates` planes of triangles."""

    candidates: int


def directions_of(count: int) -> np.ndarray:
    """Return k-DOP normals, (count, 3): 3 axes, 6 of edges or 4 of corners of the cube, or all.

    7 are axes and corners (14-DOP), 9 axes and edges (18-DOP), 13 all (26-DOP).
    """
    signs = [d for d in itertools.product((0, 1, -1), repeat=3) if any(d)]
    half = [d for d in signs if next(x for x in d if x) > 0]
    kinds = {3: (1,), 7: (1, 3), 9: (1, 2), 13: (1, 2, 3)}[count]
    chosen = np.array(
        [d for kind in kinds for d in half if sum(map(abs, d)) == kind], dtype=np.float64
    )
    return chosen / np.linalg.norm(chosen, axis=1, keepdims=True)


@inner
def count_bins(low, high, count, first, width, shell, sides):
    """Count what :func:`.references.count_sides` does, for all planes between bins at once.

    A polygon that is above a plane is above all planes before it, too: so it is enough to find the
    last of them, and to add up from the end.

    Parameters
    ----------
    first, width : float
        Plane i lies at ``first + i * width``.
    sides : (2, BINS + 2) int64
        For every plane: how many polygons are above it, and how many are only above.
    """
    for i in range(BINS + 2):
        sides[0, i], sides[1, i] = 0, 0
    for i in range(count):
        # One more than the last plane above which it is, and above which it is only.
        above, only = 0, 0
        if width > 0.0:
            above = int(min(max((high[i] - shell - first) / width, 0.0), BINS + 0.0))
            only = int(min(max((low[i] + shell - first) / width, 0.0), BINS + 0.0))
        # The divisions may be off by one; the same comparisons as for a single plane decide.
        while above <= BINS and high[i] > first + above * width + shell:
            above += 1
        while above > 0 and not high[i] > first + (above - 1) * width + shell:
            above -= 1
        while only <= BINS and low[i] >= first + only * width - shell:
            only += 1
        while only > 0 and not low[i] >= first + (only - 1) * width - shell:
            only -= 1
        sides[0, above] += 1
        sides[1, min(above, only)] += 1
    # Who ends at k is above the planes before k.
    n_above, n_only = sides[0, BINS + 1], sides[1, BINS + 1]
    for i in range(BINS, -1, -1):
        here, only_here = sides[0, i], sides[1, i]
        sides[0, i], sides[1, i] = n_above, n_only
        n_above += here
        n_only += only_here


class Scratch(NamedTuple):
    """Scratch memory of the builder.

    Attributes
    ----------
    low, high : (SAMPLE,) float64
        Extents of polygons along a normal.
    sides : (2, BINS + 2) int64
        See :func:`count_bins`.
    tried, plane : (4,) float64
        The plane being tried, and the best so far: unit normal and position along it.
    path : (64,) int64
        Nodes from a cell up to the root.
    """

    low: np.ndarray
    high: np.ndarray
    sides: np.ndarray
    tried: np.ndarray
    plane: np.ndarray
    path: np.ndarray


def make_scratch() -> Scratch:
    """Return scratch memory for one builder."""
    return Scratch(
        np.empty(SAMPLE * 2), np.empty(SAMPLE * 2), np.empty((2, BINS + 2), np.int64), np.zeros(4),
        np.zeros(4), np.zeros(64, np.int64),
    )  # fmt: skip


@dispatched
def choose_plane(rule, lists, begin, n, room, row, area, scratch, facets, shell):
    """Write the plane that is to split a cell to `scratch.plane`; False if none is any good.

    Parameters
    ----------
    rule : NamedTuple
        Decides how.
    lists : Lists
    begin, n : int
        The cell's references.
    room, row : Polyhedra, int
        The cell.
    area : float
        Its surface area; its faces are measured.
    facets : (n_items, 3, 3) float64
        See :class:`...geometry.shapes.Shapes`.
    shell : float
    """
    raise TypeError(type(rule).__name__)


@inner
def make_plane(facets, item, which, plane):
    """Write a plane of a triangle: OWN, or through an edge; False if it has no area."""
    first, second, third = which % EDGES, (which + 1) % EDGES, (which + 2) % EDGES
    ax, ay, az = (
        facets[item, first, 0],
        facets[item, first, 1],
        facets[item, first, 2],
    )
    ex, fx = facets[item, second, 0] - ax, facets[item, third, 0] - ax
    ey, fy = facets[item, second, 1] - ay, facets[item, third, 1] - ay
    ez, fz = facets[item, second, 2] - az, facets[item, third, 2] - az
    # Relative to one of the edges, lest products of very long or short ones leave the range.
    size = max(abs(ex), abs(ey), abs(ez))
    if size == 0.0:
        return False
    ex, ey, ez, fx, fy, fz = ex / size, ey / size, ez / size, fx / size, fy / size, fz / size
    x, y, z = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    if which != OWN:
        x, y, z = y * ez - z * ey, z * ex - x * ez, x * ey - y * ex
    length = (x * x + y * y + z * z) ** 0.5
    if not 0.0 < length < np.inf:
        return False
    x, y, z = x / length, y / length, z / length
    plane[0], plane[1], plane[2], plane[3] = x, y, z, x * ax + y * ay + z * az
    return True


@inner
def take_plane(scratch, position):
    """Make the plane being tried the best, at a position."""
    for i in range(3):
        scratch.plane[i] = scratch.tried[i]
    scratch.plane[3] = position


@inner
def cost_of(rule, room, row, area, plane, position, share, n_below, n_above, best):
    """Return the expected cost of a split, or inf where it cannot be less than `best`.

    Parameters
    ----------
    share : float
        How far up the plane is, from 0 at the lowest corner of the cell to 1 at the highest.
    """
    factor = rule.keep if n_below == 0.0 or n_above == 0.0 else 1.0
    # Shrunk by `share` towards its lowest corner, a convex cell is inside its part below, which so
    # has share^2 of its area at least; above likewise. Together they have more than the cell.
    fewer, more, small = n_below, n_above, (1.0 - share) * (1.0 - share)
    if n_below > n_above:
        fewer, more, small = n_above, n_below, share * share
    least = rule.c_trav + rule.c_isect * SAFELY * (fewer + small * (more - fewer))
    if not factor * least < best:
        return np.inf
    below, above = side_areas(room, row, plane, position)
    return factor * (rule.c_trav + rule.c_isect * (below * n_below + above * n_above) / area)


@implements(choose_plane, Heuristic)
def choose_by_cost(rule, lists, begin, n, room, row, area, scratch, facets, shell):
    """Try planes across the fixed directions, then oblique ones."""
    low, high, tried = scratch.low, scratch.high, scratch.tried
    stride = (n + SAMPLE - 1) // SAMPLE
    count = n // stride
    scale = n / count
    best = rule.c_isect * n
    found = False
    n_directions = len(rule.directions)
    n_triangles = min(n, rule.candidates // 4)
    for number in range(n_directions + 4 * n_triangles):
        if number < n_directions:
            for axis in range(3):
                tried[axis] = rule.directions[number, axis]
        else:
            rank, which = (number - n_directions) // 4, (number - n_directions) % 4
            item = lists.item[begin + rank * n // n_triangles]
            if not make_plane(facets, item, which, tried):
                continue
        position, tried[3] = tried[3], 0.0
        bottom, top = measure_heights(room, row, tried)
        lowest, highest = bottom + MARGIN * shell, top - MARGIN * shell
        n_positions, is_binned = 1, False
        if number >= n_directions and not lowest < position < highest:
            continue
        project(lists, begin, stride, count, tried, low, high)
        first, width = np.inf, 0.0
        if number < n_directions:
            n_positions = 2 * count
            if count > EXACT:
                last = -np.inf
                for i in range(count):
                    first = low[i] if low[i] < first else first
                    last = high[i] if high[i] > last else last
                n_positions, is_binned = BINS + 1, True
                width = (last - first) / BINS
                count_bins(low, high, count, first, width, shell, scratch.sides)
        for i in range(n_positions):
            if number < n_directions:
                position = first + i * width
                if count <= EXACT:
                    position = low[i] if i < count else high[i - count]
                if not lowest < position < highest:
                    continue
            if is_binned:
                n_below, n_above = count - scratch.sides[1, i], scratch.sides[0, i]
            else:
                n_below, n_above = count_sides(low, high, count, position, shell)
            share = (position - bottom) / (top - bottom)
            cost = cost_of(
                rule, room, row, area, tried, position, share, scale * n_below, scale * n_above,
                best,
            )  # fmt: skip
            if cost < best:
                best, found = cost, True
                take_plane(scratch, position)
    return found


@implements(choose_plane, Autopartition)
def choose_by_cuts(rule, lists, begin, n, room, row, area, scratch, facets, shell):
    """Try the planes of some triangles that cut the cell."""
    low, high, tried = scratch.low, scratch.high, scratch.tried
    stride = (n + SAMPLE - 1) // SAMPLE
    count = n // stride
    best = np.inf
    n_tried = 0
    # Pseudo-random, but the same whenever the turn of this cell comes.
    salt = whole(lists.item[begin]) + 61 * n
    for i in range(min(n, ATTEMPTS)):
        if n_tried == rule.candidates:
            break
        rank = (salt + i * PRIME) % n
        if not make_plane(facets, lists.item[begin + rank], OWN, tried):
            continue
        position, tried[3] = tried[3], 0.0
        lowest, highest = measure_heights(room, row, tried)
        if not lowest + MARGIN * shell < position < highest - MARGIN * shell:
            continue
        n_tried += 1
        project(lists, begin, stride, count, tried, low, high)
        n_below, n_above = count_sides(low, high, count, position, shell)
        score = CUT * (n_below + n_above - count) + abs(n_below - n_above)
        if score < best:
            best = score
            take_plane(scratch, position)
    return best < np.inf
