"""Where in a triangle a ray hits it, and from which side.

The weights of the corners are the edge functions of the test that found the hit
(:mod:`..geometry.triangle`), each divided by their sum.
"""

from __future__ import annotations

from ..kernels import inlined


@inlined
def faced(corners, index, ray):
    """Return whether a ray meets the front of a triangle, and the weights of its corners 1 and 2.

    Its front is where its corners run counter-clockwise in the right-handed space of this house:
    that is clockwise in the left-handed space of the specification.

    Parameters
    ----------
    corners : (n, 3, 3) float64
    index : int
    ray : Ray
        It hits the triangle.
    """
    az = corners[index, 0, ray.kz] - ray.okz
    bz = corners[index, 1, ray.kz] - ray.okz
    cz = corners[index, 2, ray.kz] - ray.okz
    ax = corners[index, 0, ray.kx] - ray.okx - ray.shear_x * az
    ay = corners[index, 0, ray.ky] - ray.oky - ray.shear_y * az
    bx = corners[index, 1, ray.kx] - ray.okx - ray.shear_x * bz
    by = corners[index, 1, ray.ky] - ray.oky - ray.shear_y * bz
    cx = corners[index, 2, ray.kx] - ray.okx - ray.shear_x * cz
    cy = corners[index, 2, ray.ky] - ray.oky - ray.shear_y * cz
    u = cx * by - cy * bx
    v = ax * cy - ay * cx
    w = bx * ay - by * ax
    determinant = u + v + w
    return determinant * ray.shear_z > 0.0, v / determinant, w / determinant
