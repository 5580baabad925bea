"""The walk through a list: what rays of all directional techniques have in common."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.events import (
    COVER,
    NONE,
    OVERLOOK,
    RECALL,
    STRANGER,
    VISIT_EMPTY,
    VISIT_LEAF,
    note,
)
from ...contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ...contract.walk import Found
from ...geometry.rays import ALL, ANY
from ...kernels import inlined, whole

ASK_COVER, ASK_LAST, ASK_DRAWN, ASK_LISTED, ASK_ALL, FINISHED = range(6)
"""What is tested next: the item that covers the cell; the last occluder; what was drawn; what the
cell lists; all items."""


class Seen(NamedTuple):
    """Where a ray lies as a face sees it.

    Attributes
    ----------
    cell : int
        NONE for a ray beside all cells: it meets nothing.
    is_known : bool
        Whether the lists are for such a ray. If not, all items are tested.
    start, rate : float
        What the ray meets at t is ``start + rate t`` away from the face's origin at most. A
        `rate` of 0 is that of a ray which comes from there, and begins so far away.
    place : int
        Of its last occluder; NONE if none is remembered.
    """

    cell: int | np.integer
    is_known: bool
    start: float
    rate: float
    place: int | np.integer


@inlined
def reached(seen, t):
    """Return how far away a ray is at t, at most."""
    return seen.start if seen.rate == 0.0 else seen.start + seen.rate * t


@inlined
def walk_list(lists, drawn, last, geometry, seen, ray, number, workspace, log):
    """Test what a ray may hit, and stop as soon as nothing nearer can follow.

    Parameters
    ----------
    lists : Lists
        In which nothing is missing.
    drawn : Lists
        Of some items, which are asked before; without cells, none are.
    last : (k,) int32
        Last occluders.
    seen : Seen

    Returns
    -------
    Found
        With the counters of a directional structure.
    """
    best = NOTHING
    empty, covered, recalled, overlooked, strangers = 0, 0, 0, 0, 0
    cell, asks_for_any = seen.cell, ray.query == ANY
    item, slot, stop, stage = whole(0), whole(0), whole(0), whole(ASK_LISTED)
    if not seen.is_known:
        stage = whole(ASK_ALL)
    elif cell < 0:
        note(log, VISIT_EMPTY, NONE, NONE, ray.t_min, ray.t_max)
        return Found(best.t, best.primitive, (1, 1, 1, 0, 0, 0, 0, 0))
    else:
        slot, stop = lists.first[cell], lists.last[cell]
        empty = 1 if slot == stop else 0
        note(log, VISIT_EMPTY if empty else VISIT_LEAF, cell, NONE, ray.t_min, ray.t_max)
        if seen.rate == 0.0 and seen.start > lists.far[cell]:
            item, stage = whole(lists.cover[cell]), whole(ASK_COVER if asks_for_any else ASK_ALL)
        elif asks_for_any and seen.place >= 0 and last[seen.place] >= 0:
            item, stage = whole(last[seen.place]), whole(ASK_LAST)
        elif asks_for_any and len(drawn.first) > 0:
            stage = whole(ASK_DRAWN)
    visits = 0 if stage == ASK_ALL and not seen.is_known else 1
    if stage == ASK_DRAWN:
        slot, stop = drawn.first[cell], drawn.last[cell]
    while stage != FINISHED:
        begin, end = item, item + 1
        if stage == ASK_LISTED or stage == ASK_DRAWN:  # noqa: SIM109  no tuples in a kernel
            t = best.t if best.t < ray.t_max and ray.query != ALL else ray.t_max
            is_listed = stage == ASK_LISTED
            near = np.inf
            if slot < stop:
                near = lists.nearest[slot] if is_listed else drawn.nearest[slot]
            if slot >= stop or near > reached(seen, t):
                # Nothing that follows can be nearer; but of what lies behind what covers a cell
                # nothing is listed, and a ray may begin, or have hit something, only there.
                if not is_listed:
                    slot, stop, stage = lists.first[cell], lists.last[cell], whole(ASK_LISTED)
                elif reached(seen, t) > lists.far[cell]:
                    stage = whole(ASK_ALL)
                else:
                    stage = whole(FINISHED)
                continue
            item = whole(lists.references[slot] if is_listed else drawn.references[slot])
            slot += 1
            begin, end = item, item + 1
        elif stage == ASK_COVER:
            covered = 1
            note(log, COVER, cell, geometry.ids[item], ray.t_min, ray.t_max)
        elif stage == ASK_ALL:
            strangers = 1
            note(log, STRANGER, NONE, NONE, ray.t_min, ray.t_max)
            begin, end = whole(0), whole(len(geometry.ids))
        best = test_leaf(
            geometry, None, False, begin, end, ray, number, workspace, log, cell, ray.t_min,
            EVERYWHERE, True, best,
        )  # fmt: skip
        if stage == ASK_ALL or (asks_for_any and best.primitive >= 0):
            break
        if stage == ASK_COVER:
            stage = whole(ASK_ALL)
        elif stage == ASK_LAST:
            stage = whole(ASK_LISTED)
            if len(drawn.first) > 0:
                slot, stop, stage = drawn.first[cell], drawn.last[cell], whole(ASK_DRAWN)
    if asks_for_any and best.primitive >= 0:
        if stage == ASK_LAST:
            recalled = 1
            note(log, RECALL, cell, best.primitive, best.t, best.t)
        if stage == ASK_LISTED and len(drawn.first) > 0:
            overlooked = 1
            note(log, OVERLOOK, cell, best.primitive, best.t, best.t)
        if seen.place >= 0 and stage != ASK_ALL:
            last[seen.place] = item
    counts = (visits, visits, empty, best.tests, covered, recalled, overlooked, strangers)
    return Found(best.t, best.primitive, counts)
