"""Procedural spheres: an intersection shader puts one into the box of every primitive.

Boxes that are no cubes hold an ellipsoid: where the box is made a cube of side 2, it is the unit
sphere. Of the two t at which the ray crosses it, both are reported, and the system takes the nearer
one within the ray's interval: so a ray may start inside.
"""

from __future__ import annotations

import math

from ..language import *

ENTRY, EXIT = 0, 1


@struct
class Payload:
    color: float3


@struct
class Attributes:
    normal: float3


@function
def middle_and_half(box):
    """Return the middle of a box, and half of its sides."""
    middle = (0.5 * (box[0] + box[3]), 0.5 * (box[1] + box[4]), 0.5 * (box[2] + box[5]))
    return middle, (0.5 * (box[3] - box[0]), 0.5 * (box[4] - box[1]), 0.5 * (box[5] - box[2]))


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin, ray.direction = launch.camera_position, launch.camera_direction
    ray.t_max = 1e30
    payload = Payload()
    trace_ray(scene, 0, 0xFF, 0, 1, 0, ray, payload)
    output.color = (payload.color[0], payload.color[1], payload.color[2], 1.0)


def intersection(ray, attributes: Attributes):
    middle, half = middle_and_half(ray.box)
    o, d = subtract(ray.object_origin, middle), ray.object_direction
    o = (o[0] / half[0], o[1] / half[1], o[2] / half[2])
    d = (d[0] / half[0], d[1] / half[1], d[2] / half[2])
    # |o + t d| = 1 is a t^2 + 2 b t + c = 0.
    a, b, c = dot(d, d), dot(o, d), dot(o, o) - 1.0
    discriminant = b * b - a * c
    if discriminant < 0.0:
        return
    root = math.sqrt(discriminant)
    for kind in range(2):
        t = (-b - root) / a if kind == ENTRY else (-b + root) / a
        x, y, z = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
        attributes.normal = (x / half[0], y / half[1], z / half[2])
        report_hit(ray, t, kind, attributes)


def closest_hit(payload: Payload, attributes: Attributes, ray, scene):
    shade(payload, attributes, ray, scene)


@function
def shade(payload, attributes, ray, scene):
    """Light the side that the ray comes from by the first light."""
    normal = moved_normal(ray.world_to_object, attributes.normal)
    if dot(normal, ray.world_direction) > 0.0:
        normal = scale(normal, -1.0)
    point_to_light = normalize(subtract(light_position(scene, 0), ray.world_origin))
    light = 0.25 + 0.75 * max(dot(normal, point_to_light), 0.0)
    payload.color = scale(ray.color, light)


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
    label="A sphere in the box of every procedural primitive",
)
