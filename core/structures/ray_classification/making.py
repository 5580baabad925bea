"""Making cells of ray space: what their beams may hit is found among what their parents' may.

A cell gets its list when the first ray comes to it. If that is too long, and the cell is in the way
of many rays of a batch, it is divided: across the dimension in which it is longest, of the ones in
which the scene has an extent. Making the two lists takes as long as testing the one for some dozen
rays; for fewer it would not pay.

- Behind an item that blocks the whole beam nothing is listed: no ray gets there.
- A child whose list is its parent's shares it, or one from which less than a part is missing.
- Lists that no ray has come to for the longest time are thrown away where there are too many. A
  cell that is needed again is made anew, from the nearest ancestor that has a list.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...geometry.shapes import Shapes
from ...kernels import call, inner, kernel, whole
from ...memory import refuse_if_too_large
from ...progress import Progress
from ...ranges import longer, ranges
from .back_faces import AWAY, TOWARDS, seen_by_cell
from .beam import MOST_PLANES, blocks_beam, bound_beam, box_in_beam, reaches_beam
from .ray_space import LEAF, NO_LIST, ROOTS, TIME, UNMADE, Cells

DIMENSIONS = 6

SIMILAR = 0.1
"""Lists are similar if less than this part of the longer one is missing in the other."""

EXACT = 512
"""Of so many candidates it is asked exactly whether they reach into a beam; of more, only whether
their boxes may."""

NARROW = 2.0**-24
"""A cell is not divided across an interval that is this part of the root's."""

AT_ONCE = 1 << 8
"""Cells that are made between two looks at the cancel button."""


class Rule(NamedTuple):
    """When cells are divided, and what their lists leave out.

    Attributes
    ----------
    max_list_size, max_depth : int
    min_rays : int
        Of a batch, in the cell, for it to be divided.
    dimensions : int
        5, or 6 with the time.
    truncate : bool
        Whether nothing is listed behind what blocks a beam.
    similar : float
        A list that lacks at most this part of the parent's shares that; below 0 none does.
    slack : float
    cull : bool
        Whether what all rays of a cell see from behind is left out.
    """

    max_list_size: int
    max_depth: int
    min_rays: int
    dimensions: int
    truncate: bool
    similar: float
    slack: float
    cull: bool


class Known(NamedTuple):
    """What is known of all cells there are, beside what walks see of them.

    Attributes
    ----------
    bounds : (n, 2, 6) float64
        Lower and upper ends of the intervals.
    parent, root, depth : (n,) int32
    """

    bounds: np.ndarray
    parent: np.ndarray
    root: np.ndarray
    depth: np.ndarray


class Ordered(NamedTuple):
    """Items as roots list them.

    Attributes
    ----------
    order : (ROOTS, n) int32
        Those first that begin first along the root's axis.
    nearest, farthest : (ROOTS, n) float64
        Where each begins and ends along the axes, by item.
    boxes : (n, 6) float64
    """

    order: np.ndarray
    nearest: np.ndarray
    farthest: np.ndarray
    boxes: np.ndarray


class Scratch(NamedTuple):
    """Scratch memory for making cells."""

    planes: np.ndarray
    polygon: np.ndarray
    ray: np.ndarray


def ordered(boxes: np.ndarray) -> Ordered:
    """Return where items with these boxes, (n, 6), lie along the axes of the roots."""
    ways = [(axis, sign) for axis in range(3) for sign in (1, -1)]
    nearest = np.stack([boxes[:, a] if s > 0 else -boxes[:, 3 + a] for a, s in ways])
    farthest = np.stack([boxes[:, 3 + a] if s > 0 else -boxes[:, a] for a, s in ways])
    order = np.argsort(nearest, axis=1, kind="stable").astype(np.int32)
    return Ordered(order, nearest, farthest, boxes)


def scratch_for(shapes: Shapes) -> Scratch:
    """Return scratch memory for items of these shapes."""
    most = int(shapes.size.max()) + MOST_PLANES
    return Scratch(np.zeros((MOST_PLANES, 4)), np.zeros((2, most, 3)), np.zeros((2, 3)))


@inner
def list_cell(cells, known, rule, shapes, items, scratch, cell, ancestor, place):
    """Write the list of a cell from `place` on, out of an ancestor's; return where it ends.

    Parameters
    ----------
    ancestor : int
        A cell above that has a list; NO_LIST for none, and so all items.
    """
    root, bounds = known.root[cell], known.bounds[cell]
    count = bound_beam(root, bounds, scratch.planes)
    begin, end = 0, len(items.order[0])
    if ancestor >= 0:
        begin, end = cells.first[ancestor], cells.last[ancestor]
    behind = np.inf
    for slot in range(begin, end):
        item = whole(items.order[root, slot] if ancestor < 0 else cells.references[slot])
        if items.nearest[root, item] > behind:
            break
        seen = seen_by_cell(cells.normals, item, root, bounds) if rule.cull else TOWARDS
        if seen == AWAY:
            continue
        where = box_in_beam(items.boxes, item, scratch.planes, count, rule.slack)
        if where > 0 or (
            where == 0
            and (
                end - begin > EXACT
                or reaches_beam(
                    shapes, item, bounds, scratch.planes, count, rule.slack, scratch.polygon
                )
            )
        ):
            cells.references[place] = item
            place += 1
            farthest = items.farthest[root, item] + rule.slack
            if (
                rule.truncate
                and seen == TOWARDS
                and farthest < behind
                and blocks_beam(shapes, item, root, bounds, rule.slack, scratch.ray)
            ):
                behind = farthest
    return place


@inner
def longest_dimension(known, cell, dimensions):
    """Return the dimension in which a cell is longest, compared with its root; -1 for none."""
    longest, chosen = NARROW, whole(-1)
    for dimension in range(dimensions):
        whole_low = known.bounds[0, 0, dimension]
        whole_high = known.bounds[0, 1, dimension]
        if not whole_high > whole_low:
            continue
        low, high = known.bounds[cell, 0, dimension], known.bounds[cell, 1, dimension]
        share = (high - low) / (whole_high - whole_low)
        if share > longest:
            longest, chosen = share, whole(dimension)
    return chosen


@kernel
def make_some(cells, known, rule, shapes, items, scratch, wanted, rays, first, used):
    """Make the cells ``wanted[first:]``, or divide them; return how many until room ran out.

    Parameters
    ----------
    wanted : (k,) int64
        Cells that are not divided.
    rays : (k,) int64
        How many are in each.
    used : (2,) int64
        Cells, and references, that there are.
    """
    for number in range(first, len(wanted)):
        cell = whole(wanted[number])
        if cells.first[cell] == NO_LIST:
            ancestor = whole(known.parent[cell])
            while ancestor >= 0 and cells.first[ancestor] == NO_LIST:
                ancestor = whole(known.parent[ancestor])
            most = len(items.order[0])
            if ancestor >= 0:
                most = cells.last[ancestor] - cells.first[ancestor]
            if used[1] + most > len(cells.references):
                return number
            begin = used[1]
            end = list_cell(cells, known, rule, shapes, items, scratch, cell, ancestor, begin)
            size = end - begin
            used[1] = end
            if ancestor >= 0 and most - size <= rule.similar * most:
                begin, end = cells.first[ancestor], cells.last[ancestor]
                used[1] -= size
            elif size == 0:
                begin, end = whole(0), whole(0)
            cells.first[cell], cells.last[cell] = begin, end
            if cells.children[cell] == UNMADE:
                cells.children[cell] = LEAF
        is_long = cells.last[cell] - cells.first[cell] > rule.max_list_size
        is_full = rays[number] >= rule.min_rays and known.depth[cell] < rule.max_depth
        if cells.children[cell] != LEAF or not (is_long and is_full):
            continue
        dimension = longest_dimension(known, cell, rule.dimensions)
        if dimension < 0:
            continue
        low, high = known.bounds[cell, 0, dimension], known.bounds[cell, 1, dimension]
        middle = 0.5 * (low + high)
        child = used[0]
        used[0] = child + 2
        cells.children[cell], cells.dimension[cell], cells.plane[cell] = child, dimension, middle
        for side in range(2):
            new = child + side
            for key in range(2):
                for each in range(DIMENSIONS):
                    known.bounds[new, key, each] = known.bounds[cell, key, each]
            known.bounds[new, 1 - side, dimension] = middle
            known.parent[new], known.root[new] = cell, known.root[cell]
            known.depth[new] = known.depth[cell] + 1
            cells.children[new], cells.first[new], cells.last[new] = UNMADE, NO_LIST, NO_LIST
            cells.used[new] = 0
    return len(wanted)


def roots_of(box: np.ndarray, slack: float, items: Ordered) -> tuple[Cells, Known]:
    """Return the six roots, for which no list is made yet."""
    bounds = np.zeros((ROOTS, 2, DIMENSIONS))
    bounds[:, 0, :3], bounds[:, 1, :3] = box[:3], box[3:]
    bounds[:, 0, 3:], bounds[:, 1, 3:] = -1.0, 1.0
    bounds[:, 0, TIME] = 0.0
    numbers = np.arange(ROOTS, dtype=np.int32)
    none = np.full(ROOTS, NO_LIST, np.int64)
    cells = Cells(
        box[None].copy(), slack, np.full(ROOTS, UNMADE, np.int32), np.zeros(ROOTS, np.int32),
        np.zeros(ROOTS), none, none.copy(), np.zeros(0, np.int32), items.nearest,
        np.zeros(ROOTS, np.int32), 0, np.zeros(ROOTS, np.uint8), np.empty((0, 3)),
    )  # fmt: skip
    return cells, Known(bounds, np.full(ROOTS, -1, np.int32), numbers, np.zeros(ROOTS, np.int32))


OF_CELLS = "children", "dimension", "plane", "first", "last", "used"
"""Fields of :class:`.ray_space.Cells` with a row for each."""


def with_room(cells: Cells, known: Known, n_cells: int) -> tuple[Cells, Known]:
    """Return copies of both with room for so many cells."""
    fields: dict[str, Any] = {name: longer(getattr(cells, name), n_cells) for name in OF_CELLS}
    return cells._replace(**fields), Known(*(longer(values, n_cells) for values in known))


def make(
    cells: Cells, known: Known, used: np.ndarray, wanted: np.ndarray, rays: np.ndarray, rule: Rule,
    shapes: Shapes, items: Ordered, progress: Progress,
) -> tuple[Cells, Known]:  # fmt: skip
    """Make cells, and return all there are then; `used` is counted up.

    Raises
    ------
    InputError
        When cells or lists do not fit into memory.
    Cancelled
        From `progress`.
    """
    scratch = scratch_for(shapes)
    cells, known = with_room(cells, known, int(used[0]) + 2 * len(wanted))
    for begin in range(0, len(wanted), AT_ONCE):
        progress.report(begin, len(wanted), "Making cells of ray space")
        some, count = wanted[begin : begin + AT_ONCE], 0
        in_each = rays[begin : begin + AT_ONCE]
        while count < len(some):
            count = call(
                make_some, cells, known, rule, shapes, items, scratch, some, in_each, count, used
            )
            if count < len(some):
                size = 2 * len(cells.references) + len(shapes.start)
                refuse_if_too_large(
                    4 * size, f"lists of {int(used[0])} cells of ray space",
                    "lower most_references, or raise max_list_size",
                )  # fmt: skip
                cells = cells._replace(references=longer(cells.references, size))
    n_cells = int(used[0])
    refuse_if_too_large(
        180 * n_cells, f"{n_cells} cells of ray space", "lower max_depth, or raise max_list_size"
    )
    fields: dict[str, Any] = {name: getattr(cells, name)[:n_cells] for name in OF_CELLS}
    return cells._replace(**fields), Known(*(values[:n_cells] for values in known))


def without_old(cells: Cells, used: np.ndarray, most: int) -> tuple[Cells, int]:
    """Return cells without the lists that rays came to longest ago, and how many these were.

    Parameters
    ----------
    used : (2,) int64
        The references there are are counted anew.
    most : int
        References that are kept at most.
    """
    is_listed = cells.last > cells.first
    has_list = np.flatnonzero(is_listed)
    # Cells that share a list keep it together, as the newest of them would.
    newest = has_list[np.argsort(-cells.used[has_list], kind="stable")]
    begins, place, which = np.unique(cells.first[newest], return_index=True, return_inverse=True)
    sizes = (cells.last - cells.first)[newest[place]]
    order = np.argsort(place)
    stays = np.zeros(len(begins), np.bool_)
    stays[order] = np.cumsum(sizes[order]) <= most
    now = np.cumsum(np.where(stays, sizes, 0)) - np.where(stays, sizes, 0)
    references = cells.references[ranges(begins[stays], sizes[stays])]
    first, last = cells.first.copy(), cells.last.copy()
    first[newest] = np.where(stays, now, NO_LIST)[which]
    last[newest] = np.where(stays, now + sizes, NO_LIST)[which]
    used[1] = len(references)
    left_out = int((first == NO_LIST).sum() - (cells.first == NO_LIST).sum())
    return cells._replace(first=first, last=last, references=references), left_out
