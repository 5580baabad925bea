"""The test of a leaf: the one place where the items of a cell are tested, and ties are decided.

Of equal t the item with the lowest id wins, in whichever leaf it is met first. So every structure
returns the same item for every ray, bit for bit.

A mailbox saves testing an item again that the ray has met in another leaf. A hit that lies behind
the leaf may have a nearer one before it, in a leaf still to come: it is kept, and *postponed*.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Imported for what they register: how a triangle is met, and a solid, by a ray and by a cone.
from ..geometry import cones as cones
from ..geometry import triangle as triangle
from ..geometry.geometry import intersect
from ..geometry.rays import ALL, ANY
from ..geometry.solids import crossing as crossing
from ..geometry.solids import extent as extent
from ..geometry.solids.mixed import Mixed
from ..geometry.triangles import Triangles
from ..kernels import dispatched, implements, whole
from .csg import Crossings, CsgTrees
from .events import HIT, MAILBOX, NONE, POSTPONE, TEST, note
from .instances import Instances


class Best(NamedTuple):
    """The nearest hit so far, and what was counted on the way to it.

    Attributes
    ----------
    t : float
    primitive : int
        NONE before the first hit.
    tests, mailbox_hits, postponed : int
        Items tested, tests saved, hits that lay behind their leaf.
    """

    t: float
    primitive: int | np.integer
    tests: int
    mailbox_hits: int
    postponed: int


NOTHING = Best(np.inf, NONE, 0, 0, 0)
"""Before the first leaf."""

EVERYWHERE = np.inf
"""As `leave`: no hit is postponed, since whatever the leaf holds lies within it."""


@dispatched
def test_leaf(
    geometry, references, mailbox, first, last, ray, number, workspace, log, cell, enter, leave,
    any_ends, best,
):  # fmt: skip
    """Test the items of a leaf; one implementation per kind of geometry.

    Parameters
    ----------
    geometry : NamedTuple of arrays
        Decides the implementation.
    references : (n,) int32 or None
        Items in the order of the leaves; None if they are stored in that order themselves.
    mailbox : bool
        Whether to test an item only once per ray.
    first, last : int
        Which references: ``first <= i < last``.
    ray : Ray
    number : int
        Of the ray, unique in this workspace.
    workspace : Workspace
    log : Log
    cell : int
        For the log.
    enter, leave : float
        Interval of the ray in the leaf: hits from `leave` on are postponed.
    any_ends : bool
        Whether a ray that asks for any hit ends in the middle of a leaf.
    best : Best

    Returns
    -------
    Best
    """
    raise TypeError(f"no test_leaf for {type(geometry).__name__}")


@implements(test_leaf, Mixed)
@implements(test_leaf, Instances)
@implements(test_leaf, CsgTrees)
@implements(test_leaf, Crossings)
# Inlined, not called: a fifth faster.
@implements(test_leaf, Triangles, inline=True)
def test_items(
    geometry, references, mailbox, first, last, ray, number, workspace, log, cell, enter, leave,
    any_ends, best,
):  # fmt: skip
    """Test the items of a leaf."""
    best_t, primitive = best.t, best.primitive
    tests, mailbox_hits, postponed = best.tests, best.mailbox_hits, best.postponed
    for slot in range(first, last):
        item = whole(slot if references is None else references[slot])
        n = whole(geometry.ids[item])
        if mailbox:
            if workspace.mailbox[n] == number:
                mailbox_hits += 1
                note(log, MAILBOX, cell, n, enter, leave)
                continue
            workspace.mailbox[n] = number
        limit = best_t if ray.query != ALL and best_t < ray.t_max else ray.t_max
        t, met = intersect(geometry, item, ray, limit, number, workspace, log)
        tests += 1
        note(log, TEST, cell, n, t, t)
        if t <= ray.t_max and (t < best_t or (t == best_t and met < primitive)):
            best_t, primitive = t, met
            is_later = t >= leave
            postponed += is_later
            note(log, POSTPONE if is_later else HIT, cell, n, t, t)
            if any_ends and ray.query == ANY:
                break
    return Best(best_t, primitive, tests, mailbox_hits, postponed)
