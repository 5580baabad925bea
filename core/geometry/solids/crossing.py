"""Where a ray meets an item of a mixed geometry, and where it is inside of one.

Whatever its kind finds, a hit is moved into the interval of the item's own box, as with triangles:
so no structure can lose it to rounding (see "Slack" in :mod:`..rays`).
"""

from __future__ import annotations

import numpy as np

from ...kernels import implements, inner, whole
from ..box import span_box
from ..geometry import intersect, interval
from ..triangle import NO_HIT
from .box import cross_box
from .cone import cross_cone
from .disc import cross_disc
from .mixed import BOX, CAPPED, CONE, MOVING_TRIANGLE, POLYGON, SPHERE, Mixed
from .moving_triangle import intersect_moving_triangle
from .polygon import intersect_polygon
from .sphere import cross_sphere
from .unit_space import BEYOND, NOWHERE, to_unit_space


@implements(intersect, Mixed)
def intersect_mixed(geometry, index, ray, limit, number, workspace, log):
    """Return t of one of the items, and its id."""
    primitive = whole(geometry.ids[index])
    # Most items of a leaf are missed by far, and their boxes are quicker to look at.
    enter, leave = span_box(geometry.boxes, index, ray, np.inf)
    if enter > leave or enter > limit:
        return NO_HIT, primitive
    kind = geometry.kinds[index]
    if kind <= MOVING_TRIANGLE:
        t = intersect_moving_triangle(geometry.rows, index, ray, geometry.reach)
    elif kind == POLYGON:
        t = intersect_polygon(geometry.points, geometry.first[index], geometry.size[index], ray)
    else:
        near, far = cross(geometry, index, ray)
        # They are surfaces: from inside, a ray hits the far side.
        t = near if near >= ray.t_min else far
    if not (ray.t_min <= t < NO_HIT):
        return NO_HIT, primitive
    t = enter if enter > t else t
    return leave if leave < t else t, primitive


@inner
def cross(geometry, index, ray):
    """Return the t at which a ray enters and leaves what lives in unit space; see NOWHERE.

    Both are of any sign. Where a surface is crossed only once, they are equal.
    """
    rows, kind = geometry.rows, geometry.kinds[index]
    unit = to_unit_space(rows, index, ray)
    # This leaves out what is NaN as well, and all that follows is in the range of numbers.
    if not (unit.x * unit.x + unit.y * unit.y + unit.z * unit.z <= BEYOND):
        return NOWHERE
    if kind == SPHERE:
        near, far = cross_sphere(rows, index, unit)
    elif kind == CONE:
        near, far = cross_cone(rows, index, unit)
    elif kind == BOX:
        near, far = cross_box(rows, index, unit)
    else:
        near, far = cross_disc(rows, index, unit)
    return unit.rate * (unit.start + near), unit.rate * (unit.start + far)


@implements(interval, Mixed)
def interval_of_mixed(geometry, index, ray):
    """Take both crossings of a sphere, box or capped cone."""
    kind = geometry.kinds[index]
    is_capped = kind == CONE and geometry.rows[index, CAPPED, 0] != 0.0
    if kind in (SPHERE, BOX) or is_capped:
        return cross(geometry, index, ray)
    return NOWHERE
