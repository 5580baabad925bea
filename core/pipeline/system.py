"""What shaders are given beside payload and attributes: DXR's system values and resources.

Names are those of HLSL's intrinsics in lower case: ``RayTCurrent()`` is ``ray.t_current``,
``DispatchRaysIndex()`` is ``launch.index``.
"""

from __future__ import annotations

from .records import float2, float2x3, float3, float3x3, float3x4, float4, int2, struct

# ---------------------------------------------------------------- flags, as the specification's

RAY_FLAG_NONE = 0x0
RAY_FLAG_FORCE_OPAQUE = 0x1
RAY_FLAG_FORCE_NON_OPAQUE = 0x2
RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH = 0x4
RAY_FLAG_SKIP_CLOSEST_HIT_SHADER = 0x8
RAY_FLAG_CULL_BACK_FACING_TRIANGLES = 0x10
RAY_FLAG_CULL_FRONT_FACING_TRIANGLES = 0x20
RAY_FLAG_CULL_OPAQUE = 0x40
RAY_FLAG_CULL_NON_OPAQUE = 0x80
RAY_FLAG_SKIP_TRIANGLES = 0x100
RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES = 0x200

INSTANCE_FLAG_TRIANGLE_CULL_DISABLE = 0x1
INSTANCE_FLAG_TRIANGLE_FRONT_COUNTERCLOCKWISE = 0x2
INSTANCE_FLAG_FORCE_OPAQUE = 0x4
INSTANCE_FLAG_FORCE_NON_OPAQUE = 0x8

GEOMETRY_FLAG_OPAQUE = 0x1

HIT_KIND_TRIANGLE_FRONT_FACE = 254
HIT_KIND_TRIANGLE_BACK_FACE = 255

MOST_RECURSION = 31
"""How deep a program may declare its rays to recurse."""

# ----------------------------------------------------------------------- verdicts of any hit

ACCEPT_HIT = 0
"""The hit counts: it ends the ray's interval from now on."""
IGNORE_HIT = 1
"""HLSL's ``IgnoreHit()``: the search goes on as if there were nothing."""
ACCEPT_HIT_AND_END_SEARCH = 2
"""HLSL's ``AcceptHitAndEndSearch()``: it counts, and nothing else is searched for."""

# ----------------------------------------------------------------------------------- records


@struct
class RayDesc:
    """A ray to be traced; t is measured in lengths of the direction."""

    origin: float3
    t_min: float
    direction: float3
    t_max: float


@struct
class BuiltInTriangleIntersectionAttributes:
    """What the built-in intersection of a triangle reports: weights of its corners 1 and 2."""

    barycentrics: float2


@struct
class Launch:
    """DispatchRaysIndex and DispatchRaysDimensions, and the camera's ray through the pixel."""

    index: int2
    dimensions: int2
    camera_position: float3
    camera_direction: float3


@struct
class Output:
    """The pixel of the output texture: red, green, blue and alpha, as they are shown."""

    color: float4


@struct
class Scene:
    """What is traced against, and constants.

    `lights` of them there are, see :func:`.language.light_position`; `diagonal` is that of the box
    around the scene; `background` is what rays see that hit nothing.
    """

    lights: int
    diagonal: float
    background: float3
    # Not for shaders: where the lights lie, what is traced against, and what traces.
    light_rows: int
    bundle: int
    trace: int


@struct
class Light:
    """A light, as a point."""

    position: float3


@struct
class Ray:
    """The system values of a ray under way, in the words of HLSL.

    `t_current` is the t of the candidate in an any hit shader, of the hit in a closest hit shader,
    otherwise where the ray's interval ends now. Those of instance, geometry, primitive and object
    space have no meaning in a miss shader. `vertices` are those of the triangle and `box` is that
    of the procedural primitive, in object space. `color`, `specular` and `transmission` are of the
    material: the local arguments of a shader record.
    """

    launch_index: int2
    flags: int
    t_min: float
    t_current: float
    world_origin: float3
    world_direction: float3
    object_origin: float3
    object_direction: float3
    object_to_world: float3x4
    world_to_object: float3x4
    instance_index: int
    instance_id: int
    geometry_index: int
    primitive_index: int
    hit_kind: int
    vertices: float3x3
    box: float2x3
    color: float3
    specular: float
    transmission: float
    # Not for shaders, from here on. Of the call:
    stage: int
    mask: int
    t_max: float
    contribution: int
    multiplier: int
    # Of the hit that counts so far; `number` is NONE before the first.
    t_best: float
    number: int
    slot: int
    instance: int
    kind: int
    has_ended: int
    # Of the candidate:
    entered: int
    enter: float
    leave: float
    candidate: int
    candidate_slot: int
