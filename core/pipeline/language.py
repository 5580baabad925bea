"""What a program is written in: HLSL's shaders for DXR, in Python.

A program is a file with a function for each shader and a ``PROGRAM`` that names them. Its shaders
have the parameters that are listed in :data:`.shaders.PARAMETERS`, in that order; those that are
payload or attributes say of which record by an annotation. Functions that shaders call are
decorated with :func:`function`. Vectors are tuples (:mod:`.vectors`), records are
:mod:`.records`, system values are fields of `ray`, `launch` and `scene` (:mod:`.system`).
"""

from __future__ import annotations

from ..kernels import inner, whole
from .candidates import report
from .program import HitGroup, Program
from .records import (
    call_at,
    copy_record,
    float2,
    float2x3,
    float3,
    float3x3,
    float3x4,
    float4,
    int2,
    number_of,
    record_at,
    struct,
    uint,
    words_from,
    words_of,
)  # fmt: skip
from .stage import DEPTH, PENDING, attributes_of, stage_at
from .system import (
    ACCEPT_HIT,
    ACCEPT_HIT_AND_END_SEARCH,
    HIT_KIND_TRIANGLE_BACK_FACE,
    HIT_KIND_TRIANGLE_FRONT_FACE,
    IGNORE_HIT,
    RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH,
    RAY_FLAG_CULL_BACK_FACING_TRIANGLES,
    RAY_FLAG_CULL_FRONT_FACING_TRIANGLES,
    RAY_FLAG_CULL_NON_OPAQUE,
    RAY_FLAG_CULL_OPAQUE,
    RAY_FLAG_FORCE_NON_OPAQUE,
    RAY_FLAG_FORCE_OPAQUE,
    RAY_FLAG_NONE,
    RAY_FLAG_SKIP_CLOSEST_HIT_SHADER,
    RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES,
    RAY_FLAG_SKIP_TRIANGLES,
    BuiltInTriangleIntersectionAttributes,
    Light,
    Ray,
    RayDesc,
)  # fmt: skip
from .vectors import (
    add,
    along,
    cross,
    dot,
    mix,
    moved_normal,
    normalize,
    reflect,
    scale,
    subtract,
)  # fmt: skip

__all__ = [
    "ACCEPT_HIT", "ACCEPT_HIT_AND_END_SEARCH", "HIT_KIND_TRIANGLE_BACK_FACE",
    "HIT_KIND_TRIANGLE_FRONT_FACE", "IGNORE_HIT", "RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH",
    "RAY_FLAG_CULL_BACK_FACING_TRIANGLES", "RAY_FLAG_CULL_FRONT_FACING_TRIANGLES",
    "RAY_FLAG_CULL_NON_OPAQUE", "RAY_FLAG_CULL_OPAQUE", "RAY_FLAG_FORCE_NON_OPAQUE",
    "RAY_FLAG_FORCE_OPAQUE", "RAY_FLAG_NONE", "RAY_FLAG_SKIP_CLOSEST_HIT_SHADER",
    "RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES", "RAY_FLAG_SKIP_TRIANGLES",
    "BuiltInTriangleIntersectionAttributes", "HitGroup", "Program", "RayDesc",
    "add", "along", "cross", "dot", "float2", "float2x3", "float3", "float3x3", "float3x4",
    "float4", "function", "int2", "light_position", "mix", "moved_normal", "normalize",
    "reflect", "report_hit", "scale", "struct", "subtract", "surface_normal", "trace_ray", "uint",
]  # fmt: skip

function = inner
"""Decorates what shaders call and is no shader itself."""


@inner
def trace_ray(scene, flags, mask, contribution, multiplier, miss, ray, payload):
    """Trace a ray, and call the shaders for what it meets: HLSL's ``TraceRay``.

    Parameters
    ----------
    scene : Scene
        As the shader was given it.
    flags : int
        RAY_FLAG_..., joined by |.
    mask : int
        InstanceInclusionMask: instances with no bit in common are not met.
    contribution, multiplier : int
        The index of the hit group is contribution + multiplier * geometry_index + what the
        instance contributes. The contribution is the class of the ray, too, by which calls are
        counted.
    miss : int
        Index of the miss shader.
    ray : RayDesc
    payload : record
    """
    call_at(
        scene.trace,
        (
            scene.bundle, whole(flags), whole(mask), whole(contribution), whole(multiplier),
            whole(miss), words_of(ray), words_of(payload), number_of(payload),
        ),
    )  # fmt: skip


@inner
def report_hit(ray, t, hit_kind, attributes):
    """Offer a hit of a procedural primitive, and say whether it counts: HLSL's ``ReportHit``.

    Parameters
    ----------
    ray : Ray
        As the intersection shader was given it.
    t : float
    hit_kind : int
        From 0 to 127.
    attributes : record
        As the intersection shader was given it, filled in.
    """
    stage = stage_at(ray.stage)
    copy_record(attributes, attributes_of(stage, stage.now[DEPTH] - 1, PENDING))
    return report(stage, record_at(Ray, words_of(ray)), t + 0.0, whole(hit_kind))


@inner
def light_position(scene, index):
    """Return where a light is; a sun is a point far away."""
    return record_at(Light, words_from(scene.light_rows, index, 3)).position


@inner
def surface_normal(ray):
    """Return the unit normal of the triangle that was hit, in world space, towards its front."""
    v = ray.vertices
    one = (v[3] - v[0], v[4] - v[1], v[5] - v[2])
    two = (v[6] - v[0], v[7] - v[1], v[8] - v[2])
    return moved_normal(ray.world_to_object, cross(one, two))
