"""The lecture's example: barycentric coordinates as colours. Behind each line is the slide's."""

from __future__ import annotations

from ..language import *


@struct  # struct
class Payload:  # Payload {
    color: float4  # float4 color;
    hit_distance: float  # float hitDistance; };


@struct  # struct
class Attributes:  # Attributes {
    barys: float2  # float2 barys; };


def ray_generation(scene, launch, output):  # [shader("raygeneration")] void RayGenMain() {
    # uint2 launchIndex = DispatchRaysIndex(); is launch.index, and output is its pixel
    ray = RayDesc()  # RayDesc ray;
    ray.origin = launch.camera_position  # ray.Origin = SceneConstants.cameraPosition;
    ray.direction = launch.camera_direction  # ray.Direction = computeRayDirection(launchIndex);
    ray.t_min = 0.0  # ray.TMin = 0;
    ray.t_max = 100000.0  # ray.TMax = 100000;
    payload = Payload()  # Payload payload;
    trace_ray(  # TraceRay(
        scene, 0, 0xFF, 0,  # scene, 0 /*flags*/, 0xFF /*mask*/, 0 /*hit group offset*/,
        1, 0,  # 1 /*hit group index multiplier*/, 0 /*miss shader index*/,
        ray, payload,  # ray, payload
    )  # );  # fmt: skip
    output.color = payload.color  # outputTexture[launchIndex.xy] = payload.color; }


def closest_hit(  # [shader("closesthit")] void ClosestHitMain(
    payload: Payload,  # inout Payload payload,
    attr: Attributes, ray, scene,  # in Attributes attr) {
):  # fmt: skip
    payload.color = (  # payload.color = float4(
        attr.barys[0], attr.barys[1],  # attr.barys.x, attr.barys.y,
        1.0 - attr.barys[0] - attr.barys[1], 1.0,  # 1 - attr.barys.x - attr.barys.y, 1
    )  # );  # fmt: skip
    payload.hit_distance = ray.t_current  # payload.hitDistance = RayTCurrent(); }


PROGRAM = Program(
    ray_generation=ray_generation,
    hit_groups=[HitGroup(closest_hit=closest_hit)],
    label="Barycentric coordinates as colours",
)
