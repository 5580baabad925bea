"""Hard shadows: from every hit a ray to each light, and what it meets is nobody's business.

A shadow ray ends at the first hit and calls no closest hit shader: if anything is in its way,
nothing is called at all. Only where it reaches the light is its miss shader called, and says so.
"""

from __future__ import annotations

from ..language import *

PRIMARY, SHADOW, RAY_TYPES = 0, 1, 2

AMBIENT = 0.15


@struct
class Payload:
    color: float3


@struct
class Shadow:
    is_lit: int


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
    point = along(ray.world_origin, ray.world_direction, ray.t_current)
    light = AMBIENT
    for index in range(scene.lights):
        shadow_ray = RayDesc()
        # Off the face, which would otherwise be in its own way.
        shadow_ray.origin = add(point, scale(normal, 1e-9 * scene.diagonal))
        to_light = subtract(light_position(scene, index), shadow_ray.origin)
        shadow_ray.direction = to_light
        shadow_ray.t_max = 1.0
        cosine = dot(normal, normalize(to_light))
        if cosine > 0.0:
            shadow = Shadow()
            trace_ray(
                scene, RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH | RAY_FLAG_SKIP_CLOSEST_HIT_SHADER,
                0xFF, SHADOW, RAY_TYPES, 1, shadow_ray, shadow,
            )  # fmt: skip
            light += shadow.is_lit * cosine * (1.0 - AMBIENT) / scene.lights
    payload.color = scale(ray.color, light)


def miss(payload: Payload, ray, scene):
    payload.color = scene.background


def miss_shadow(shadow: Shadow, ray, scene):
    shadow.is_lit = 1


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[HitGroup(closest_hit=closest_hit), HitGroup()],
    miss=[miss, miss_shadow],
    max_recursion_depth=2,
    ray_types=("primary", "shadow"),
    label="Hard shadows by rays that end at the first hit",
)
