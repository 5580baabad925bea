"""The walk of a ray through a structure: what it is called with, and what it returns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import dispatched, whole
from .counters import Counter


class Found(NamedTuple):
    """What the walk of one ray returns.

    Attributes
    ----------
    t : float
        Ray parameter of the hit, inf for a miss.
    primitive : int
        Number of the item in the scene, -1 for a miss.
    counts : tuple of int
        Values of the structure's COUNTERS, in their order.
    """

    t: float
    primitive: int | np.integer
    counts: tuple[int, ...]


NOWHERE = -2
"""Primitive of a ray whose walk has lost its way."""


MISSING = -3
"""Primitive of a ray whose walk has met cells that are not made yet (:mod:`.lazy`)."""


def lost(counters: tuple[Counter, ...]) -> Found:
    """Return what a walk returns that has taken more steps than there can be.

    Instead of going on for ever. That is a defect, whatever the ray: :meth:`Structure.trace` raises
    an error for it.
    """
    return Found(np.inf, whole(NOWHERE), (0,) * len(counters))


def missing(counters: tuple[Counter, ...]) -> Found:
    """Return what a walk returns that has met cells not made yet, and noted them."""
    return Found(np.inf, whole(MISSING), (0,) * len(counters))


@dispatched
def walk(structure, geometry, ray, number, workspace, log):
    """Walk one ray through a structure: the traversal, one implementation per structure.

    All are inlined into the driver: a call would pass every field of every array on its own, for
    each ray, which took a tenth to a fifth of the time of most walks that were measured.

    Parameters
    ----------
    structure : NamedTuple of arrays
        Decides the implementation.
    geometry : NamedTuple of arrays
        What its leaves refer to, see :mod:`..geometry.geometry`.
    ray : Ray
    number : int
        Number of the ray, unique in this workspace; for the mailbox.
    workspace : Workspace
    log : Log

    Returns
    -------
    Found
    """
    raise TypeError(f"no walk for {type(structure).__name__}")
