"""The lecture's example: barycentric coordinates as colours. Beside it stand the slides' lines."""

from __future__ import annotations

from ..language import *


@struct
class Payload:
    color: float4
    hit_distance: float


@struct
class Attributes:
    barys: float2


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin = launch.camera_position
    ray.direction = launch.camera_direction
    ray.t_min = 0.0
    ray.t_max = 100000.0
    payload = Payload()
    trace_ray(scene, 0, 0xFF, 0, 1, 0, ray, payload)
    output.color = payload.color


def closest_hit(payload: Payload, attr: Attributes, ray, scene):
    payload.color = (attr.barys[0], attr.barys[1], 1.0 - attr.barys[0] - attr.barys[1], 1.0)
    payload.hit_distance = ray.t_current


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[HitGroup(closest_hit=closest_hit)],
    label="Barycentric coordinates as colours",
)
