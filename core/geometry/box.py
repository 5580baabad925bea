"""Axis-aligned bounding box (AABB), stored as six numbers ``[x0, y0, z0, x1, y1, z1]``.

The ray test is the slab test: the box is the intersection of three strips, and the ray is inside
it where it is inside all three (lecture: "intersection of strips").
"""

from __future__ import annotations

import numpy as np

from ..kernels import kernel

MISS = np.inf
"""What :func:`enter_box` returns for a ray that misses."""


@kernel
def enter_box(boxes, index, ray, limit):
    """Return the t at which the ray enters a box, or MISS if it does not by t = `limit`.

    A ray that starts inside enters at 0. A NaN arises where the ray lies in a slab's plane
    (0 * inf); every comparison with it is false, so that slab is taken as no restriction.
    """
    enter, leave = 0.0, limit
    t = (boxes[index, ray.side_x] - ray.near_x) * ray.ix
    enter = t if t > enter else enter
    t = (boxes[index, 1 + ray.side_y] - ray.near_y) * ray.iy
    enter = t if t > enter else enter
    t = (boxes[index, 2 + ray.side_z] - ray.near_z) * ray.iz
    enter = t if t > enter else enter
    t = (boxes[index, 3 - ray.side_x] - ray.far_x) * ray.ix
    leave = t if t < leave else leave
    t = (boxes[index, 4 - ray.side_y] - ray.far_y) * ray.iy
    leave = t if t < leave else leave
    t = (boxes[index, 5 - ray.side_z] - ray.far_z) * ray.iz
    leave = t if t < leave else leave
    return enter if enter <= leave else MISS


@kernel
def leave_box(boxes, index, ray):
    """Return the t at which the ray leaves a box; meaningful only if it enters."""
    leave = np.inf
    t = (boxes[index, 3 - ray.side_x] - ray.far_x) * ray.ix
    leave = t if t < leave else leave
    t = (boxes[index, 4 - ray.side_y] - ray.far_y) * ray.iy
    leave = t if t < leave else leave
    t = (boxes[index, 5 - ray.side_z] - ray.far_z) * ray.iz
    return t if t < leave else leave


def boxes_of(triangles: np.ndarray) -> np.ndarray:
    """Return the boxes of triangles.

    Parameters
    ----------
    triangles : (n, 3, 3) float64

    Returns
    -------
    (n, 6) float64
    """
    boxes = np.empty((len(triangles), 6))
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    np.minimum(np.minimum(a, b), c, out=boxes[:, :3])
    np.maximum(np.maximum(a, b), c, out=boxes[:, 3:])
    return boxes


def surface_area(boxes: np.ndarray) -> np.ndarray:
    """Return the surface areas of boxes, (n, 6) to (n,): 2 (ab + bc + ca)."""
    size = boxes[..., 3:] - boxes[..., :3]
    x, y, z = size[..., 0], size[..., 1], size[..., 2]
    return 2.0 * (x * y + y * z + z * x)
