"""Elementary solids once more, in other words and with longer numbers: a witness for the kernels.

Everything is in the scene's space and from the description, not from what kernels are given: the
crossings of a line with a surface as roots of the equation of that surface, and the distance of a
point from it.
"""

import numpy as np

# Imported for what they register: how a triangle is met, and a solid.
from accelscope.core.geometry import triangle as triangle
from accelscope.core.geometry.geometry import intersect
from accelscope.core.geometry.rays import Rays, make_ray
from accelscope.core.geometry.solids import crossing as crossing
from accelscope.core.geometry.solids import extent as extent
from accelscope.core.geometry.solids.description import (
    Box,
    Cone,
    Disc,
    MovingTriangle,
    Polygon,
    Sphere,
    Triangle,
)
from accelscope.core.kernels import call, kernel

LONG = np.longdouble


@kernel
def trace_items(geometry, rays, nothing, t, primitive):
    for i in range(len(t)):
        ray = make_ray(rays, i, geometry.reach)
        for k in range(len(geometry.ids)):
            at, number = intersect(geometry, k, ray, np.inf, i, nothing, nothing)
            if at <= ray.t_max and (at < t[i] or (at == t[i] and number < primitive[i])):
                t[i], primitive[i] = at, number


def trace(geometry, rays):
    """Hits of rays with a geometry: t and numbers of items, by testing every one."""
    t, primitive = np.full(len(rays), np.inf), np.full(len(rays), -1)
    call(trace_items, geometry, rays.arrays(), np.empty(0), t, primitive)
    return t, primitive


def rays_of(origins, directions, **others):
    origins, directions = np.broadcast_arrays(np.atleast_2d(origins), directions)
    return Rays.from_arrays(np.array(origins, float), np.array(directions, float), **others)


def dot(a, b):
    return (a * b).sum(axis=-1)


def corners_at(item, time):
    if isinstance(item, MovingTriangle):
        start, end = np.array(item.start, LONG), np.array(item.end, LONG)
        return start + LONG(time) * (end - start)
    return np.array(item.corners, LONG)


def first_crossing(item, origins, directions, time=0.0):
    """The lowest t >= 0 of each line, inf where there is none; (n,) longdouble."""
    o, d = np.asarray(origins, LONG), np.asarray(directions, LONG)
    with np.errstate(all="ignore"):
        found = np.stack(list(crossings(item, o, d, time)))
    found = np.where(found >= 0, found, np.inf)  # NaN is no crossing
    return found.min(axis=0)


def roots(a, b, c):
    """Both roots of a t² + 2 b t + c, or of what is left of it."""
    root = np.sqrt(b * b - a * c)
    s = -b - np.where(b > 0, root, -root)
    linear = a == 0
    return np.where(linear, -c / (2 * b), s / a), np.where(linear, np.inf, c / s)


def crossings(item, o, d, time):
    if isinstance(item, Sphere):
        # From the point next to the centre, as far as longdouble reaches.
        near = o - np.array(item.centre, LONG)
        shift = -dot(near, d) / dot(d, d)
        near = near + shift[:, None] * d
        r = LONG(item.radius)
        for t in roots(dot(d, d), dot(near, d), dot(near, near) - r * r):
            yield shift + t
    elif isinstance(item, Cone):
        base, apex = np.array(item.base, LONG), np.array(item.apex, LONG)
        axis = apex - base
        height = np.sqrt(dot(axis, axis))
        axis = axis / height
        r0, r1 = LONG(item.base_radius), LONG(item.apex_radius)
        # From the point next to the tip, where the equation's terms are small.
        tip = base + axis * (r0 / (r0 - r1) if r0 != r1 else LONG(0.5)) * height
        shift = -dot(o - tip, d) / dot(d, d)
        near = o - tip + shift[:, None] * d + (tip - base)
        y, dy = dot(near, axis), dot(d, axis)
        side, dside = near - y[:, None] * axis, d - dy[:, None] * axis
        k = (r1 - r0) / height
        r, dr = r0 + k * y, k * dy
        for t in roots(
            dot(dside, dside) - dr * dr, dot(side, dside) - r * dr, dot(side, side) - r * r
        ):
            at = y + t * dy
            yield np.where((at >= 0) & (at <= height), shift + t, np.nan)
        if item.is_capped:
            for level, radius in ((LONG(0), r0), (height, r1)):
                t = (level - y) / dy
                p = side + t[:, None] * dside
                yield np.where(dot(p, p) <= radius * radius, shift + t, np.nan)
    elif isinstance(item, Box):
        low, high = np.array(item.lower, LONG), np.array(item.upper, LONG)
        for axis in range(3):
            others = [(axis + 1) % 3, (axis + 2) % 3]
            for plane in (low[axis], high[axis]):
                t = (plane - o[:, axis]) / d[:, axis]
                p = (o + t[:, None] * d)[:, others]
                yield np.where(((p >= low[others]) & (p <= high[others])).all(axis=1), t, np.nan)
    elif isinstance(item, Disc):
        normal = np.array(item.normal, LONG)
        t = -dot(o - np.array(item.centre, LONG), normal) / dot(d, normal)
        p = o + t[:, None] * d - np.array(item.centre, LONG)
        yield np.where(dot(p, p) <= LONG(item.radius) ** 2, t, np.nan)
    else:
        corners = corners_at(item, time)
        normal = normal_of(corners)
        t = -dot(o - corners[0], normal) / dot(d, normal)
        yield np.where(winds_around(corners, normal, o + t[:, None] * d), t, np.nan)


def normal_of(corners):
    normal = np.cross(corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]).sum(axis=0)
    return normal / np.sqrt(dot(normal, normal))


def winds_around(corners, normal, points):
    """Whether the angles under which points see the edges of a polygon add up to a full turn."""
    total = np.zeros(len(points), LONG)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u, v = a - points, b - points
        total += np.arctan2(dot(np.cross(u, v), normal), dot(u, v))
    return abs(total) > np.pi


def distance(item, points, time=0.0):
    """How far points are from the surface of an item, (n,) longdouble."""
    p = np.asarray(points, LONG)
    if isinstance(item, Sphere):
        away = p - np.array(item.centre, LONG)
        return abs(np.sqrt(dot(away, away)) - LONG(item.radius))
    if isinstance(item, Cone):
        base, apex = np.array(item.base, LONG), np.array(item.apex, LONG)
        height = np.sqrt(dot(apex - base, apex - base))
        y = dot(p - base, apex - base) / height
        aside = p - base - y[:, None] * (apex - base) / height
        flat = np.stack([np.sqrt(dot(aside, aside)), y], axis=1)
        ends = np.array([[item.base_radius, 0], [item.apex_radius, height]], LONG)
        found = [from_segment(flat, *ends)]
        if item.is_capped:
            found += [from_segment(flat, end * [0, 1], end) for end in ends]
        return np.min(found, axis=0)
    if isinstance(item, Box):
        low, high = np.array(item.lower, LONG), np.array(item.upper, LONG)
        out = np.maximum(np.maximum(low - p, p - high), 0)
        inside = np.minimum(p - low, high - p).min(axis=1)
        away = np.sqrt(dot(out, out))
        return np.where(away > 0, away, np.maximum(inside, 0))
    if isinstance(item, Disc):
        normal = np.array(item.normal, LONG)
        normal = normal / np.sqrt(dot(normal, normal))
        away = p - np.array(item.centre, LONG)
        y = dot(away, normal)
        aside = away - y[:, None] * normal
        over = np.maximum(np.sqrt(dot(aside, aside)) - LONG(item.radius), 0)
        return np.hypot(y, over)
    corners = corners_at(item, time)
    normal = normal_of(corners)
    inside = winds_around(corners, normal, p - dot(p - corners[0], normal)[:, None] * normal)
    edges = [
        from_segment(p, a, b) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    return np.where(inside, abs(dot(p - corners[0], normal)), np.min(edges, axis=0))


def from_segment(p, a, b):
    length = dot(b - a, b - a)
    share = np.clip(dot(p - a, b - a) / (length if length > 0 else 1), 0, 1)
    away = p - a - share[:, None] * (b - a)
    return np.sqrt(dot(away, away))


EVERY_KIND = {
    "sphere": Sphere((0.3, -0.2, 0.1), 1.25),
    "capped cylinder": Cone((0.2, 0.1, -0.7), (-0.4, 0.8, 1.1), 0.6, 0.6),
    "open cylinder": Cone((0.2, 0.1, -0.7), (-0.4, 0.8, 1.1), 0.6, 0.6, False),
    "upright cylinder": Cone((0.5, 0.25, -1), (0.5, 0.25, 1), 0.75, 0.75),
    "cone": Cone((0.1, 0.3, -0.9), (0.5, -0.6, 0.8), 0.9, 0.0),
    "open cone": Cone((0.1, 0.3, -0.9), (0.5, -0.6, 0.8), 0.0, 0.9, False),
    "upright cone": Cone((0, 0, -1), (0, 0, 1), 1.0, 0.0),
    "truncated cone": Cone((0.1, 0.3, -0.9), (0.5, -0.6, 0.8), 0.9, 0.3),
    "open truncated cone": Cone((0.1, 0.3, -0.9), (0.5, -0.6, 0.8), 0.2, 0.7, False),
    "needle": Cone((-2, 1, -3), (2, -1.5, 3), 0.001, 0.0005),
    "plate": Cone((0, 0, 0), (0.0001, 0.0002, 0.0003), 1.0, 0.9),
    "box": Box((-0.7, -0.9, -0.3), (0.8, 0.2, 1.1)),
    "disc": Disc((0.1, -0.2, 0.3), (0.3, 0.5, -0.7), 0.8),
    "level disc": Disc((0.25, 0.5, 0.75), (0, 0, 2), 0.5),
    "hexagon": Polygon(
        [(1, 0, 0), (0.5, 1, 0.25), (-0.5, 1, 0.75), (-1, 0, 1), (-0.5, -1, 0.75), (0.5, -1, 0.25)]
    ),
    "arrow": Polygon([(-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (0, -0.5, 0.5), (-1, 1, 0.5)]),
    "triangle": Triangle([(-0.9, 0.1, 0.3), (0.8, -0.3, 0.5), (0.2, 0.9, -0.6)]),
    "moving triangle": MovingTriangle(
        [(-0.9, 0.1, 0.3), (0.8, -0.3, 0.5), (0.2, 0.9, -0.6)],
        [(-0.4, 0.6, 0.1), (0.9, 0.3, -0.5), (-0.2, 0.9, 0.6)],
    ),
}  # fmt: skip
"""One item of every kind, and those that are hard."""
