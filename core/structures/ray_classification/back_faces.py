"""Back faces: what a ray would hit from behind.

Nobody sees the back of a closed mesh from outside, for a front is nearer. So what all rays of a
cell see from behind need not be listed (Arvo and Kirk 1987). That a front is nearer is certain only
where the mesh is closed, its faces are turned outward, and no part of it runs through another; and
at the outline a front and a back meet in an edge, where either may be hit. So it is a setting, and
what it does is defined ray by ray: a ray passes through every triangle that it would hit from
behind, whatever its cell lists. The front of a triangle is where its corners go round
counterclockwise, or clockwise where a matrix has mirrored the mesh. All that is no triangle has no
back.
"""

from __future__ import annotations

import numpy as np

from ...geometry.solids.mixed import TRIANGLE, Mixed
from ...geometry.triangles import Triangles
from ...kernels import inlined, inner, whole
from ...scene import Scene
from .ray_space import U, V

AWAY, TOWARDS, EITHER = -1, 1, 0
"""How all rays of a cell see an item: from behind, from the front, or this way and that."""

CERTAIN = 1e-12
"""Cosine from which on it is certain how a ray sees a triangle."""


def normals_of(scene: Scene) -> np.ndarray:
    """Return the outward normals of items, (n, 3), of whatever length; 0 for what has no back."""
    geometry, normals = scene.geometry, np.zeros((len(scene), 3))
    if isinstance(geometry, Triangles):
        which, corners = np.arange(len(scene)), geometry.corners
    elif isinstance(geometry, Mixed):
        which = np.flatnonzero(geometry.kinds == TRIANGLE)
        corners = geometry.rows[which, :3]
    else:
        return normals
    edges = corners[:, 1:] - corners[:, :1]
    # Squares of what is small or large are no numbers any more.
    size = np.abs(edges).max(axis=2, keepdims=True)
    edges /= np.where(size > 0.0, size, 1.0)
    sides = np.where(scene.is_turned(which), -1.0, 1.0)
    normals[which] = sides[:, None] * np.cross(edges[:, 0], edges[:, 1])
    return normals


@inlined
def is_behind(normals, item, dx, dy, dz):
    """Say whether a direction leads to the back of an item."""
    return normals[item, 0] * dx + normals[item, 1] * dy + normals[item, 2] * dz > 0.0


@inner
def seen_by_cell(normals, item, root, bounds):
    """Return how the rays of a cell see an item.

    The product of a normal and a direction is linear in both slopes: it is least, and greatest, in
    corners.
    """
    a = whole(root // 2)
    nb, nc = normals[item, (a + 1) % 3], normals[item, (a + 2) % 3]
    along = normals[item, a] if root % 2 == 0 else -normals[item, a]
    least, most = along, along
    for n, slope in ((nb, U), (nc, V)):
        low, high = n * bounds[0, slope], n * bounds[1, slope]
        least += low if low < high else high
        most += high if low < high else low
    certain = CERTAIN * (along * along + nb * nb + nc * nc) ** 0.5
    if least > certain:
        return AWAY
    return TOWARDS if most < -certain else EITHER
