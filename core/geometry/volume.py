"""Bounding volume: a simple shape around a complicated one.

A ray that misses the volume misses what is inside. A volume pays where its own test B and the
share p of rays that hit it satisfy the lecture's inequality ``B + p I < I``, with I the time of
testing what is inside.

One file per kind: :mod:`.sphere`, :mod:`.box`, :mod:`.obb`, :mod:`.kdop`, and :mod:`.combined` for
intersections and unions of them. Each has a NamedTuple of arrays that holds any number of volumes
of its kind, and implements the kernels declared here. A hierarchy, a sorted list, a single object
use them all alike. The names of all kinds are in :mod:`.kinds`.

Slack
-----
Whatever is rounded, no hit may be lost. Let ``s`` be the sum of ``|origin| + reach`` over the three
axes, `reach` being the scene's largest coordinates. Two errors are to be held:

- A hit of a triangle, at t, lies within a few eps * s of that triangle: that is the promise of
  :mod:`.triangle`, whose edge functions and whose clamp to the triangle's box work with 4 and 8 eps
  per axis.
- A volume's test multiplies and adds coordinates, none of them larger than s. What a direction d
  contributes is rounded in proportion to t |d|, the way to the hit, which is no longer than s
  either. All of it adds up to less than 16 eps * s.

So it is enough to measure every volume as if it reached :func:`slack_of` = 64 eps * s further. A
strip moved by that on both sides, and a ball grown by it, contain the hit as they are computed: a
displacement is added to the coordinate before anything is divided or drawn a root of, so a ray that
only grazes a volume is no exception. Tests compare all kinds with brute force, bit by bit, on rays
from up to a million scene sizes away.
"""

from __future__ import annotations

import numpy as np

from ..kernels import dispatched, inlined, inner

EPS = np.finfo(np.float64).eps
"""Spacing of the numbers above 1: twice what one operation rounds, relatively."""

MISS = float("inf")
"""What :func:`enter` returns for a ray that misses."""

STRIPS = 13
"""Rows of a ray's scratch memory that one kind needs: the strips of a 26-DOP."""

MOST_STRIPS = 4 * STRIPS
"""Rows of a ray's scratch memory: for four members of a combined volume."""


@dispatched
def fit(volumes, index, corners, first, last):
    """Make volume `index` contain the triangles ``first <= i < last``, whatever is rounded.

    Parameters
    ----------
    volumes : NamedTuple of arrays
        Decides the implementation.
    corners : (n, 3, 3) float64
    """
    raise TypeError(f"no fit for {type(volumes).__name__}")


@dispatched
def outside(volumes, index, x, y, z):
    """Return how far a point is outside of a volume, as rounded; at most 0 if it is inside."""
    raise TypeError(f"no outside for {type(volumes).__name__}")


@dispatched
def prepare(volumes, ray, strips):
    """Write into `strips`, (MOST_STRIPS, 3), what of a ray is the same for all volumes."""
    raise TypeError(f"no prepare for {type(volumes).__name__}")


@dispatched
def span(volumes, index, ray, strips, limit):
    """Return the t at which a ray enters a volume, at least t_min, and leaves it, at most `limit`.

    A ray that misses enters after it leaves. Conservative: whatever is rounded, every hit of a
    triangle inside is in between.
    """
    raise TypeError(f"no span for {type(volumes).__name__}")


@inlined
def enter(volumes, index, ray, strips, limit):
    """Return the t at which a probe enters a volume, or MISS if it does not by t = `limit`.

    One that starts inside enters at its t_min.
    """
    t_enter, t_leave = span(volumes, index, ray, strips, limit)
    return t_enter if t_enter <= t_leave else MISS


@inner
def slack_of(ray):
    """Return how much further than it does a volume is taken to reach; see "Slack"."""
    return 8.0 * (abs(ray.low_x - ray.ox) + abs(ray.low_y - ray.oy) + abs(ray.low_z - ray.oz))
