"""Masks: three rays for each pixel, and each sees other instances.

Red is what has bit 0 of its mask, green bit 1, blue bit 2. A scene without instances is one whose
mask has all bits: it is grey.
"""

from __future__ import annotations

from ..language import *


@struct
class Payload:
    brightness: float


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin, ray.direction = launch.camera_position, launch.camera_direction
    ray.t_max = 1e30
    red, green, blue = Payload(), Payload(), Payload()
    trace_ray(scene, 0, 1, 0, 0, 0, ray, red)
    trace_ray(scene, 0, 2, 0, 0, 0, ray, green)
    trace_ray(scene, 0, 4, 0, 0, 0, ray, blue)
    output.color = (red.brightness, green.brightness, blue.brightness, 1.0)


def closest_hit(payload: Payload, attributes, ray, scene):
    payload.brightness = 0.2 + 0.8 * abs(dot(surface_normal(ray), normalize(ray.world_direction)))


def miss(payload: Payload, ray, scene):
    payload.brightness = 0.05


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[HitGroup(closest_hit=closest_hit)],
    miss=[miss],
    label="What rays of three masks see, as red, green and blue",
)
