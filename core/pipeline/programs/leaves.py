"""Cut-out leaves: an any hit shader ignores what of each triangle is no leaf.

What is cut out is decided for every candidate, in no promised order, and for shadow rays as well:
their any hit shader ends the search at the first leaf.
"""

from __future__ import annotations

from ..language import *

PRIMARY, SHADOW, RAY_TYPES = 0, 1, 2


@struct
class Payload:
    color: float3


@struct
class Shadow:
    is_lit: int


@function
def is_leaf(u, v):
    """Say whether a point of a triangle belongs to the leaf: an oval with a gap along its vein."""
    w = 1.0 - u - v
    is_oval = 27.0 * u * v * w > 0.35
    is_vein = abs(u - v) < 0.02
    return is_oval and not is_vein


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin, ray.direction = launch.camera_position, launch.camera_direction
    ray.t_max = 1e30
    payload = Payload()
    trace_ray(scene, 0, 0xFF, PRIMARY, RAY_TYPES, 0, ray, payload)
    output.color = (payload.color[0], payload.color[1], payload.color[2], 1.0)


def any_hit(payload: Payload, attributes: BuiltInTriangleIntersectionAttributes, ray):
    u, v = attributes.barycentrics
    return ACCEPT_HIT if is_leaf(u, v) else IGNORE_HIT


def any_hit_of_shadow(shadow: Shadow, attributes: BuiltInTriangleIntersectionAttributes, ray):
    u, v = attributes.barycentrics
    return ACCEPT_HIT_AND_END_SEARCH if is_leaf(u, v) else IGNORE_HIT


def closest_hit(payload: Payload, attributes, ray, scene):
    normal = surface_normal(ray)
    if dot(normal, ray.world_direction) > 0.0:
        normal = scale(normal, -1.0)
    point = along(ray.world_origin, ray.world_direction, ray.t_current)
    to_light = subtract(light_position(scene, 0), point)
    shadow_ray = RayDesc()
    shadow_ray.origin = add(point, scale(normal, 1e-9 * scene.diagonal))
    shadow_ray.direction = to_light
    shadow_ray.t_max = 1.0
    shadow = Shadow()
    trace_ray(
        scene, RAY_FLAG_SKIP_CLOSEST_HIT_SHADER, 0xFF, SHADOW, RAY_TYPES, 1, shadow_ray, shadow
    )
    light = 0.3 + 0.7 * shadow.is_lit * abs(dot(normal, normalize(to_light)))
    tint = 0.7 + 0.3 * ((ray.primitive_index * 7 % 10) / 10.0)
    payload.color = (0.35 * tint * light, 0.75 * tint * light, 0.2 * light)


def miss(payload: Payload, ray, scene):
    payload.color = (0.85, 0.9, 0.95)


def miss_shadow(shadow: Shadow, ray, scene):
    shadow.is_lit = 1


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[
        HitGroup(closest_hit=closest_hit, any_hit=any_hit), HitGroup(any_hit=any_hit_of_shadow)
    ],
    miss=[miss, miss_shadow],
    max_recursion_depth=2,
    ray_types=("primary", "shadow"),
    label="Leaves cut out of triangles by any hit shaders",
)  # fmt: skip
