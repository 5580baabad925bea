"""Mirrors: a closest hit shader that traces on, until a payload says that it is deep enough."""

from __future__ import annotations

from ..language import *

PRIMARY, REFLECTED, RAY_TYPES = 0, 1, 2

DEEPEST = 6

LEAST_MIRRORED = 0.4
"""Of a material that mirrors less, or nothing at all: else there were nothing to see."""


@struct
class Payload:
    color: float3
    depth: int


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin, ray.direction = launch.camera_position, launch.camera_direction
    ray.t_max = 1e30
    payload = Payload()
    trace_ray(scene, 0, 0xFF, PRIMARY, RAY_TYPES, 0, ray, payload)
    output.color = (payload.color[0], payload.color[1], payload.color[2], 1.0)


def closest_hit(payload: Payload, attributes, ray, scene):
    normal = surface_normal(ray)
    if dot(normal, ray.world_direction) > 0.0:
        normal = scale(normal, -1.0)
    facing = -dot(normal, normalize(ray.world_direction))
    payload.color = scale(ray.color, 0.2 + 0.8 * facing)
    if payload.depth + 1 < DEEPEST:
        mirrored = RayDesc()
        point = along(ray.world_origin, ray.world_direction, ray.t_current)
        mirrored.origin = add(point, scale(normal, 1e-9 * scene.diagonal))
        mirrored.direction = reflect(ray.world_direction, normal)
        mirrored.t_max = 1e30
        seen = Payload()
        seen.depth = payload.depth + 1
        trace_ray(scene, 0, 0xFF, REFLECTED, RAY_TYPES, 0, mirrored, seen)
        payload.color = mix(payload.color, seen.color, max(ray.specular, LEAST_MIRRORED))


def miss(payload: Payload, ray, scene):
    """Take a sky that is brighter above."""
    up = 0.5 + 0.5 * normalize(ray.world_direction)[2]
    payload.color = mix((0.25, 0.3, 0.4), (0.75, 0.85, 1.0), up)


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[HitGroup(closest_hit=closest_hit), HitGroup(closest_hit=closest_hit)],
    miss=[miss],
    max_recursion_depth=DEEPEST,
    ray_types=("primary", "reflected"),
    label="Mirrors by recursion, six rays deep",
)
