"""Bounding volume: a simple shape around a complicated one.

A ray that misses the volume misses what is inside. A volume pays where its own test B and the
share p of rays that hit it satisfy the lecture's inequality ``B + p I < I``, with I the time of
testing what is inside.

One file per kind: :mod:`.sphere`, :mod:`.box`, :mod:`.obb`, :mod:`.kdop`. Each has a NamedTuple of
arrays that holds any number of volumes of its kind, and implements the three kernels declared here.
A hierarchy, a sorted list, a single object use them all alike.
"""

from __future__ import annotations

from ..kernels import dispatched

MISS = float("inf")
"""What :func:`enter` returns for a ray that misses."""

MOST_STRIPS = 13
"""Rows of a ray's scratch memory: strips of a 26-DOP."""


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
def prepare(volumes, ray, strips):
    """Write into `strips`, (MOST_STRIPS, 3), what of a ray is the same for all volumes."""
    raise TypeError(f"no prepare for {type(volumes).__name__}")


@dispatched
def enter(volumes, index, ray, strips, limit):
    """Return the t at which the ray enters a volume, or MISS if it does not by t = `limit`.

    A ray that starts inside enters at 0. Conservative: whatever is rounded, no hit of a triangle
    inside is before this t or in a volume that is missed.
    """
    raise TypeError(f"no enter for {type(volumes).__name__}")
