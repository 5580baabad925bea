"""The walk of a ray through cells: what all directional techniques have in common.

What differs is which cell a ray comes through, and what is known of it then: :func:`seen_by`.
"""

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
from ...kernels import dispatched, inlined, whole
from .faces import face_towards, in_face

ASK_COVER, ASK_LAST, ASK_DRAWN, ASK_LISTED, ASK_ALL = range(5)
"""What is tested next: the item that covers the cell; the last occluder; what was drawn; what the
cell lists; all items."""


class Seen(NamedTuple):
    """What is known of a ray as the origin of a cube, or of another face, sees it.

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
def stranger():
    """Return what is known of a ray that the lists are not for."""
    return Seen(whole(NONE), False, 0.0, 0.0, whole(NONE))


@inlined
def reached(seen, t):
    """Return how far away a ray is at t, at most."""
    return seen.start if seen.rate == 0.0 else seen.start + seen.rate * t


class Sight(NamedTuple):
    """Where the line of a ray goes, as a face's origin sees it.

    Attributes
    ----------
    face : int
    u, v : float
        Where it goes through that.
    t : float
        Where the ray is nearest to the origin, or in the plane of parallel rays.
    length : float
        Of the ray's direction.
    off : float
        The square of how far off the origin the line passes; of parallel rays, of how far it strays
        within the scene. inf if it goes away from the face.
    """

    face: int | np.integer
    u: float
    v: float
    t: float
    length: float
    off: float


@inlined
def sight_of(faces, first, is_cube, way, extent, ray):
    """Return where the line of a ray goes.

    Parameters
    ----------
    faces : Faces
    first : int
        The face, or the first one of a cube.
    is_cube : bool
        Whether there are six of them, unless rays are parallel.
    way : float
        1 for rays that come from the origin, -1 for those that go there.
    extent : float
        How large the scene is.
    """
    o = faces.origins[first]
    x, y, z = ray.ox - o[0], ray.oy - o[1], ray.oz - o[2]
    dx, dy, dz = way * ray.dx, way * ray.dy, way * ray.dz
    square = dx * dx + dy * dy + dz * dz
    length = np.sqrt(square)
    if faces.is_parallel[first]:
        w = faces.axes[first, 2]
        ex, ey, ez = dx / length - w[0], dy / length - w[1], dz / length - w[2]
        size = extent + np.sqrt(x * x + y * y + z * z)
        u, v, depth = in_face(faces, first, x, y, z)
        off = (ex * ex + ey * ey + ez * ez) * size * size
        return Sight(first, u, v, -way * depth / length, length, off)
    along = -(x * dx + y * dy + z * dz) / square
    ex, ey, ez = x + along * dx, y + along * dy, z + along * dz
    face = whole(face_towards(first, dx, dy, dz)) if is_cube else first
    a, b, c = in_face(faces, face, dx, dy, dz)
    off = ex * ex + ey * ey + ez * ez if c > 0.0 else np.inf
    return Sight(face, a / c, b / c, way * along, length, off)


@dispatched
def seen_by(structure, ray):
    """Return what is known of a ray; one implementation per structure.

    Parameters
    ----------
    structure : NamedTuple of arrays
        Decides the implementation.
    ray : Ray

    Returns
    -------
    Seen
    """
    raise TypeError(f"no seen_by for {type(structure).__name__}")


def walk_cells(structure, geometry, ray, number, workspace, log):
    """Test what a ray may hit, and stop as soon as nothing nearer can follow.

    The walk of all directional structures: they register it for their arrays, inlined, and
    :func:`seen_by`. Of the arrays it takes

        lists : Lists             in which nothing is missing; behind them, what was drawn
        drawn : (n_cells + 1,)    where that begins, cell by cell; without cells, nothing was drawn
        last : (k,) int32         last occluders: items in the geometry, NONE for none

    Returns
    -------
    Found
        With the counters of a directional structure.
    """
    lists, drawn, last = structure.lists, structure.drawn, structure.last
    seen = seen_by(structure, ray)
    best, cell, asks_for_any = NOTHING, seen.cell, ray.query == ANY
    visits, empty, covered, recalled, overlooked, strangers = 0, 0, 0, 0, 0, 0
    item, slot, stop, stage = whole(0), whole(0), whole(0), whole(ASK_ALL)
    if seen.is_known:
        visits = 1
        if cell >= 0:
            slot, stop, stage = lists.first[cell], lists.last[cell], whole(ASK_LISTED)
        empty = 1 if slot == stop else 0
        note(log, VISIT_EMPTY if empty else VISIT_LEAF, cell, NONE, ray.t_min, ray.t_max)
        if cell < 0:
            return Found(best.t, best.primitive, (1, 1, 1, 0, 0, 0, 0, 0))
        if seen.rate == 0.0 and seen.start > lists.far[cell]:
            item, stage = whole(lists.cover[cell]), whole(ASK_COVER if asks_for_any else ASK_ALL)
        elif asks_for_any and seen.place >= 0 and last[seen.place] >= 0:
            item, stage = whole(last[seen.place]), whole(ASK_LAST)
        elif asks_for_any and len(drawn) > 0:
            slot, stop, stage = drawn[cell], drawn[cell + 1], whole(ASK_DRAWN)
    while True:
        begin, end = item, item + 1
        if stage == ASK_LISTED or stage == ASK_DRAWN:  # noqa: SIM109  no tuples in a kernel
            t = best.t if best.t < ray.t_max and ray.query != ALL else ray.t_max
            if slot >= stop or lists.nearest[slot] > reached(seen, t):
                # Nothing that follows can be nearer; but of what lies behind what covers a cell
                # nothing is listed, and a ray may begin, or have hit something, only there.
                if stage == ASK_DRAWN:
                    slot, stop, stage = lists.first[cell], lists.last[cell], whole(ASK_LISTED)
                elif reached(seen, t) > lists.far[cell]:
                    stage = whole(ASK_ALL)
                else:
                    break
                continue
            item = whole(lists.references[slot])
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
            if len(drawn) > 0:
                slot, stop, stage = drawn[cell], drawn[cell + 1], whole(ASK_DRAWN)
    if asks_for_any and best.primitive >= 0:
        if stage == ASK_LAST:
            recalled = 1
            note(log, RECALL, cell, best.primitive, best.t, best.t)
        if stage == ASK_LISTED and len(drawn) > 0:
            overlooked = 1
            note(log, OVERLOOK, cell, best.primitive, best.t, best.t)
        if seen.place >= 0 and stage != ASK_ALL:
            last[seen.place] = item
    counts = (visits, visits, empty, best.tests, covered, recalled, overlooked, strangers)
    return Found(best.t, best.primitive, counts)
