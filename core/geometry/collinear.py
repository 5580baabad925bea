"""Triangles whose corners lie on one line are drawn together to a point."""

from __future__ import annotations

from ..kernels import kernel


@kernel
def copy_triangles(corners, order, out, first, last):
    """Copy the triangles of the references ``first <= i < last``.

    Rounding could let a ray hit collinear corners. Drawn together to one point, all edge functions
    are exactly zero.
    """
    for i in range(first, last):
        source, copy = corners[order[i]], out[i]
        for axis in range(3):
            for k in range(3):
                copy[k, axis] = source[k, axis]
        ux, uy, uz = copy[1, 0] - copy[0, 0], copy[1, 1] - copy[0, 1], copy[1, 2] - copy[0, 2]
        vx, vy, vz = copy[2, 0] - copy[0, 0], copy[2, 1] - copy[0, 1], copy[2, 2] - copy[0, 2]
        if uy * vz == uz * vy and uz * vx == ux * vz and ux * vy == uy * vx:
            for axis in range(3):
                copy[1, axis] = copy[2, axis] = copy[0, axis]
