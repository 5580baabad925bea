"""Whether a cone reaches into a volume, or into a ball.

A volume is asked by the ball around it: a ball at some distance from the axis is out of reach when
it is farther from the cone's side than its radius.
"""

from __future__ import annotations

from ...kernels import dispatched, implements, inner
from ..box import Boxes
from ..combined import Intersection, Union
from ..kdop import KDOPs
from ..obb import OBBs
from ..sphere import SmallestSpheres, Spheres
from ..volume import MISS, slack_of, span
from .cone import Cone


@dispatched
def ball_around(volumes, index):
    """Return the centre and the radius of a ball that contains a volume: x, y, z, r."""
    raise TypeError(f"no ball around {type(volumes).__name__}")


@inner
def ball_around_box(x0, y0, z0, x1, y1, z1):
    """Return the ball through the corners of a box."""
    x, y, z = 0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.5 * (z1 - z0)
    return x0 + x, y0 + y, z0 + z, (x * x + y * y + z * z) ** 0.5


@implements(ball_around, Boxes)
def ball_around_boxes(volumes, index):
    """Take that through the corners."""
    row = volumes.rows[index]
    return ball_around_box(row[0], row[1], row[2], row[3], row[4], row[5])


@implements(ball_around, KDOPs)
def ball_around_kdop(volumes, index):
    """Take that of the first three strips, which are a box."""
    row = volumes.rows[index]
    return ball_around_box(row[0], row[2], row[4], row[1], row[3], row[5])


@implements(ball_around, SmallestSpheres)
@implements(ball_around, Spheres)
def ball_around_sphere(volumes, index):
    """Take it as it is."""
    row = volumes.rows[index]
    return row[0], row[1], row[2], row[3]


@implements(ball_around, OBBs)
def ball_around_obb(volumes, index):
    """Take the middle along each of the three axes; they are of unit length."""
    row = volumes.rows[index]
    x, y, z, squared = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        half = 0.5 * (row[12 + i] - row[9 + i])
        middle = row[9 + i] + half
        x, y, z = x + middle * row[3 * i], y + middle * row[3 * i + 1], z + middle * row[3 * i + 2]
        squared += half * half
    return x, y, z, squared**0.5


@implements(ball_around, Intersection)
def ball_around_intersection(volumes, index):
    """Take the smaller of two."""
    a, b = ball_around(volumes.first, index), ball_around(volumes.second, index)
    return a if a[3] < b[3] else b


@implements(ball_around, Union)
def ball_around_union(volumes, index):
    """Enlarge the first until it contains the second."""
    x, y, z, r = ball_around(volumes.first, index)
    bx, by, bz, br = ball_around(volumes.second, index)
    apart = ((bx - x) ** 2 + (by - y) ** 2 + (bz - z) ** 2) ** 0.5
    return x, y, z, max(r, apart + br)


@inner
def reach_ball(cone, x, y, z, r, limit):
    """Return the t from and up to which a cone may be in a ball; a miss enters after it leaves."""
    r += slack_of(cone)
    x, y, z = x - cone.ox, y - cone.oy, z - cone.oz
    along = x * cone.ux + y * cone.uy + z * cone.uz
    px, py, pz = x - along * cone.ux, y - along * cone.uy, z - along * cone.uz
    across = (px * px + py * py + pz * pz) ** 0.5
    # With slope = sin / cos, both sides times the cosine's inverse.
    secant = (1.0 + cone.slope * cone.slope) ** 0.5
    if across - along * cone.slope > r * secant:
        return MISS, 0.0
    # Behind the apex the side is not the nearest.
    if along + across * cone.slope < 0.0 and along * along + across * across > r * r:
        return MISS, 0.0
    enter, leave = (along - r) / cone.length, (along + r) / cone.length
    enter = enter if enter > cone.t_min else cone.t_min
    return enter, leave if leave < limit else limit


def span_by_ball(volumes, index, probe, strips, limit):
    """Ask for the ball around the volume."""
    x, y, z, r = ball_around(volumes, index)
    return reach_ball(probe, x, y, z, r, limit)


for kind in (Boxes, KDOPs, OBBs, SmallestSpheres, Spheres, Intersection, Union):
    implements(span, kind, beside=Cone)(span_by_ball)
