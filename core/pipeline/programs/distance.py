"""The hit distance of the lecture's payload as a picture: the nearer, the brighter."""

from __future__ import annotations

from ..language import *


@struct
class Payload:
    hit_distance: float


def ray_generation(scene, launch, output):
    ray = RayDesc()
    ray.origin, ray.direction = launch.camera_position, launch.camera_direction
    ray.t_max = 100000.0
    payload = Payload()
    trace_ray(scene, 0, 0xFF, 0, 1, 0, ray, payload)
    square = (payload.hit_distance / scene.diagonal) * (payload.hit_distance / scene.diagonal)
    grey = 1.0 / (1.0 + square * square)
    output.color = (grey, grey, grey, 1.0)


def closest_hit(payload: Payload, attributes, ray, scene):
    payload.hit_distance = ray.t_current


def miss(payload: Payload, ray, scene):
    payload.hit_distance = ray.t_current  # where the ray ends


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[HitGroup(closest_hit=closest_hit)],
    miss=[miss],
    label="The distance of the hit, as RayTCurrent tells it",
)
