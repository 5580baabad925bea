"""A triangle whose corners move along straight lines while the picture is taken.

A ray is under way at one moment, so it meets the triangle where that is then: its corners are
interpolated between the two keys, and the test is the same as of a triangle at rest (A. Glassner:
Spacetime Ray Tracing for Animation, 1988). Triangles that share two corners at both keys share
them at all times, bit by bit, and stay watertight.

A triangle at rest has the same key twice, and so is at its place at any time.
"""

from __future__ import annotations

from ...kernels import inner
from ..triangle import NO_HIT, intersect_sheared


@inner
def at_time(corners, index, k, axis, time):
    """Return a coordinate of corner k of a moving triangle; exactly that of a key at its time."""
    start = corners[index, k, axis]
    end = corners[index, 3 + k, axis]
    return end if time == 1.0 else start + time * (end - start)


@inner
def intersect_moving_triangle(corners, index, ray, reach):
    """Return the t at which a ray hits a moving triangle, or NO_HIT; not yet clamped.

    Parameters
    ----------
    corners : (n, 6, 3) float64
        Three of the first key, three of the second.
    reach : (3,) float64
    """
    time = ray.time
    ax, ay, az = at(corners, index, 0, ray, time)
    bx, by, bz = at(corners, index, 1, ray, time)
    cx, cy, cz = at(corners, index, 2, ray, time)
    # Rounding could let a ray hit collinear corners.
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    if uy * vz == uz * vy and uz * vx == ux * vz and ux * vy == uy * vx:
        return NO_HIT
    az, bz, cz = az - ray.okz, bz - ray.okz, cz - ray.okz
    return intersect_sheared(
        ax - ray.okx - ray.shear_x * az, ay - ray.oky - ray.shear_y * az, az,
        bx - ray.okx - ray.shear_x * bz, by - ray.oky - ray.shear_y * bz, bz,
        cx - ray.okx - ray.shear_x * cz, cy - ray.oky - ray.shear_y * cz, cz,
        ray, reach,
    )  # fmt: skip


@inner
def at(corners, index, k, ray, time):
    """Return a corner at a time, its coordinates permuted as the ray's are."""
    return (
        at_time(corners, index, k, ray.kx, time),
        at_time(corners, index, k, ray.ky, time),
        at_time(corners, index, k, ray.kz, time),
    )
