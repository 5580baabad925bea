"""Procedural tori: an intersection shader finds where the ray enters the ring in a box.

The ring lies flat in the middle of the box and touches its four sides. Where the box is made a cube
of side 2, its surface is where f(x, y, z) = (sqrt(x^2 + y^2) - R)^2 + z^2 - r^2 is zero. Along a
ray that is a quartic: instead of solving it, t is stepped through the box until f has changed its
sign, and then halved down. What is so thin that no step falls into it is missed.
"""

from __future__ import annotations

import math

from ..language import *

RING, TUBE = 0.65, 0.35
"""R and r."""

STEPS, HALVINGS = 48, 52


@struct
class Payload:
    color: float3


@struct
class Attributes:
    normal: float3


@function
def height(o, d, t):
    """Return f at a place of the ray: negative inside of the ring."""
    x, y, z = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
    off = math.sqrt(x * x + y * y) - RING
    return off * off + z * z - TUBE * TUBE


@function
def entry(o, d, first, last):
    """Return the first t at which f changes its sign, or -1."""
    before, t = height(o, d, first), first
    for step in range(1, STEPS + 1):
        beyond = first + (last - first) * step / STEPS
        after = height(o, d, beyond)
        if (before < 0.0) != (after < 0.0):
            low, high = t, beyond
            for _ in range(HALVINGS):
                t = 0.5 * (low + high)
                if (height(o, d, t) < 0.0) == (before < 0.0):
                    low = t
                else:
                    high = t
            return high
        before, t = after, beyond
    return -1.0


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin, ray.direction = launch.camera_position, launch.camera_direction
    ray.t_max = 1e30
    payload = Payload()
    trace_ray(scene, 0, 0xFF, 0, 1, 0, ray, payload)
    output.color = (payload.color[0], payload.color[1], payload.color[2], 1.0)


def intersection(ray, attributes: Attributes):
    box = ray.box
    half = (0.5 * (box[3] - box[0]), 0.5 * (box[4] - box[1]), 0.5 * (box[5] - box[2]))
    middle = (0.5 * (box[0] + box[3]), 0.5 * (box[1] + box[4]), 0.5 * (box[2] + box[5]))
    o, d = subtract(ray.object_origin, middle), ray.object_direction
    o = (o[0] / half[0], o[1] / half[1], o[2] / half[2])
    d = (d[0] / half[0], d[1] / half[1], d[2] / half[2])
    # Where the ray is within the unit sphere, which holds the ring. Not where it ends
    # by now (ray.t_current): in another order of candidates, other steps would find another t.
    a, b, c = dot(d, d), dot(o, d), dot(o, o) - 1.0
    discriminant = b * b - a * c
    if discriminant <= 0.0:
        return
    root = math.sqrt(discriminant)
    first, last = max((-b - root) / a, ray.t_min), (-b + root) / a
    t = entry(o, d, first, last) if first < last else -1.0
    if t >= 0.0:
        x, y, z = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
        ring = math.sqrt(x * x + y * y)
        slope = (ring - RING) / ring
        attributes.normal = (slope * x / half[0], slope * y / half[1], z / half[2])
        report_hit(ray, t, 0, attributes)


def closest_hit(payload: Payload, attributes: Attributes, ray, scene):
    normal = moved_normal(ray.world_to_object, attributes.normal)
    if dot(normal, ray.world_direction) > 0.0:
        normal = scale(normal, -1.0)
    to_light = normalize(subtract(light_position(scene, 0), ray.world_origin))
    payload.color = scale(ray.color, 0.25 + 0.75 * max(dot(normal, to_light), 0.0))


def closest_hit_triangle(payload: Payload, attributes, ray, scene):
    payload.color = scale(ray.color, 0.4)


def miss(payload: Payload, ray, scene):
    payload.color = scene.background


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[
        HitGroup(closest_hit=closest_hit, intersection=intersection),
        HitGroup(closest_hit=closest_hit_triangle),
    ],
    miss=[miss],
    label="A torus in the box of every procedural primitive",
)
