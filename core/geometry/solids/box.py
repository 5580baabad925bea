"""A box; seen through a matrix, a box of any orientation or a parallelepiped.

It is the intersection of three strips, and the ray is inside of it where it is inside all three. A
ray through an edge enters two strips at once, whichever of the two comes first by rounding: nothing
slips through between two sides.
"""

from __future__ import annotations

from ...kernels import inner
from .mixed import SHAPE
from .unit_space import NOWHERE, cross_slab


@inner
def cross_box(rows, index, ray):
    """Return the u at which a ray enters and leaves the box.

    Along an axis where it is flat, its half-width is 0.
    """
    near, far = cross_slab(ray.x, ray.dx, rows[index, SHAPE, 0])
    low, high = cross_slab(ray.y, ray.dy, rows[index, SHAPE, 1])
    near, far = low if low > near else near, high if high < far else far
    low, high = cross_slab(ray.z, ray.dz, rows[index, SHAPE, 2])
    near, far = low if low > near else near, high if high < far else far
    if near <= far:
        return near, far
    return NOWHERE
