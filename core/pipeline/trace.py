"""TraceRay: one ray through the structure, and the shaders that are called for it.

How a walk calls functions that a user wrote
--------------------------------------------
Compiled, all shaders are called by address, from tables: that is what DXR's shader tables are. The
walk is compiled once for each kind of structure and geometry, whatever the program; a program is
compiled in fractions of a second for each of its shaders, whatever the structure. A type of its own
for every program was tried in thought and left: each would compile every walk anew (three to ten
seconds), and the index of what is compiled would name the files of users.

TraceRay itself is called by address, too. A closest hit shader that traces a ray on is therefore no
recursion that Numba knows of: what it makes of such in one kernel crashes when it is loaded from
its cache. The call goes down the thread's own stack; frames and payloads lie there or in the stage.
An exception that a shader raises comes back through all callers, by Numba's own convention.

One ray at a time is under way in a thread, and a shader that traces rays runs when its own ray's
walk is over: so one workspace is enough for all depths.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..contract.instances import moved_ray
from ..contract.walk import NOWHERE, walk
from ..errors import InputError
from ..geometry.rays import ANY as ANY_QUERY
from ..geometry.rays import CLOSEST as CLOSEST_QUERY
from ..geometry.rays import ray_along
from ..geometry.solids.mixed import MOVING_TRIANGLE, Mixed
from ..geometry.triangles import Triangles
from ..kernels import addressed, dispatched, implements, inner, kernel, whole
from .candidates import Shaded, ShadedInstances, ShadedReferences
from .hits import describe, record_of, vertices_of
from .records import call_at, record_at, words_at, words_of
from .stage import (
    CLOSEST,
    CLOSEST_HIT,
    COMMITTED,
    DEPTH,
    HIT_FOUND,
    LIMIT,
    MISS,
    NOTHING_FOUND,
    NULL,
    NUMBER,
    PAYLOAD,
    PAYLOAD_OF_CLOSEST,
    PIXEL,
    RAY_GENERATION,
    RETURNED,
    SHADER,
    SKIPPED,
    TRACE_RAY,
    X,
    Y,
    attributes_of,
    count_call,
    frame_of,
    stage_at,
    tell,
)  # fmt: skip
from .system import (
    RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH,
    RAY_FLAG_CULL_BACK_FACING_TRIANGLES,
    RAY_FLAG_CULL_FRONT_FACING_TRIANGLES,
    RAY_FLAG_CULL_NON_OPAQUE,
    RAY_FLAG_CULL_OPAQUE,
    RAY_FLAG_FORCE_NON_OPAQUE,
    RAY_FLAG_FORCE_OPAQUE,
    RAY_FLAG_SKIP_CLOSEST_HIT_SHADER,
    RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES,
    RAY_FLAG_SKIP_TRIANGLES,
    Launch,
    Output,
    RayDesc,
)  # fmt: skip

OPACITIES = (
    RAY_FLAG_FORCE_OPAQUE | RAY_FLAG_FORCE_NON_OPAQUE | RAY_FLAG_CULL_OPAQUE
    | RAY_FLAG_CULL_NON_OPAQUE
)  # fmt: skip
FACES = (
    RAY_FLAG_CULL_BACK_FACING_TRIANGLES | RAY_FLAG_CULL_FRONT_FACING_TRIANGLES
    | RAY_FLAG_SKIP_TRIANGLES
)  # fmt: skip
SKIPS = RAY_FLAG_SKIP_TRIANGLES | RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES


class Bundle(NamedTuple):
    """What a ray is traced through.

    Attributes
    ----------
    structure, geometry : NamedTuple of arrays
        The geometry is a :class:`.candidates.Shaded` or :class:`.candidates.ShadedInstances`.
    workspace : Workspace
    log : Log or NoLog
    """

    structure: Any
    geometry: Any
    workspace: Any
    log: Any


@inner
def is_at_most_one(flags):
    """Say whether no more than one bit is set."""
    return (flags & (flags - 1)) == 0


@addressed
def trace(bundle, flags, mask, contribution, multiplier, miss, desc, payload, payload_kind):
    """Trace a ray and call the shaders for it, as HLSL's ``TraceRay``; return 0.

    Parameters
    ----------
    bundle : pointer to Bundle
    flags, mask, contribution, multiplier, miss : int
        RayFlags, InstanceInclusionMask, RayContributionToHitGroupIndex,
        MultiplierForGeometryContributionToHitGroupIndex, MissShaderIndex.
    desc, payload : int
        Addresses of a :class:`.system.RayDesc` and of the payload.
    payload_kind : int
        Number of the payload's declaration.

    Raises
    ------
    InputError
        For what the specification calls undefined behaviour.
    """
    stage = stage_at(bundle.geometry.stage)
    now, asked = stage.now, record_at(RayDesc, desc)
    depth = now[DEPTH]
    if depth >= now[LIMIT]:
        raise InputError(
            "rays recurse deeper than the program declares; raise its max_recursion_depth (31 at "
            "most), or let a payload count how deep it is"
        )
    if not (
        is_at_most_one(flags & OPACITIES)
        and is_at_most_one(flags & FACES)
        and is_at_most_one(flags & SKIPS)
    ):
        raise InputError("trace_ray was given ray flags that exclude each other")
    ox, oy, oz = asked.origin
    dx, dy, dz = asked.direction
    if not (0.0 <= asked.t_min <= asked.t_max) or not (
        abs(ox) + abs(oy) + abs(oz) + abs(dx) + abs(dy) + abs(dz) < np.inf
    ):
        raise InputError("trace_ray was given a ray that is not finite, or not 0 <= t_min <= t_max")
    if contribution < 0 or multiplier < 0 or not 0 <= miss < len(stage.misses):
        raise InputError("trace_ray was given an index of a shader that the program does not have")
    dx, dy, dz = dx + 0.0, dy + 0.0, dz + 0.0  # not -0.0, whose inverse would be -inf
    now[DEPTH], now[NUMBER] = depth + 1, now[NUMBER] + 1
    stage.payloads[depth, 0], stage.payloads[depth, 1] = payload, payload_kind
    frame = frame_of(stage, depth)
    frame.launch_index = (now[X], now[Y])
    frame.flags, frame.mask = flags, mask
    frame.t_min, frame.t_current, frame.t_max = asked.t_min, asked.t_max, asked.t_max
    frame.world_origin, frame.world_direction = (ox, oy, oz), (dx, dy, dz)
    frame.contribution, frame.multiplier = contribution, multiplier
    frame.t_best, frame.number, frame.has_ended = asked.t_max, whole(-1), whole(0)
    frame.entered, frame.enter, frame.leave = whole(0), -np.inf, np.inf
    count_call(stage, frame, TRACE_RAY)
    tell(stage, TRACE_RAY, depth + 1, contribution, -1, -1, asked.t_max)

    query = ANY_QUERY if (flags & RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH) != 0 else CLOSEST_QUERY
    ray = ray_along(
        ox, oy, oz, dx, dy, dz, 1.0 / dx, 1.0 / dy, 1.0 / dz, bundle.geometry.reach,
        asked.t_min, asked.t_max, query, 0.0, mask & 255, -1, -1,
    )  # fmt: skip
    if may_meet(bundle.geometry, mask):
        found = walk(
            bundle.structure, bundle.geometry, ray, now[NUMBER], bundle.workspace, bundle.log
        )
        if found.primitive == NOWHERE:
            raise RuntimeError("the walk of a ray does not come to an end; please report it")
    frame.t_current = frame.t_best
    if frame.number < 0:
        tell(stage, NOTHING_FOUND, depth + 1, contribution, -1, -1, frame.t_best)
        call_miss(bundle, stage, frame, miss)
    else:
        number, t = frame.number, frame.t_best
        tell(stage, HIT_FOUND, depth + 1, contribution, frame.instance, number, t)
        call_closest_hit(bundle, stage, frame, ray)
    now[DEPTH] = depth
    tell(stage, RETURNED, depth + 1, contribution, -1, -1, frame.t_best)
    return 0


@inner
def call_miss(bundle, stage, frame, miss):
    """Call a miss shader, unless there is none in its place."""
    depth = stage.now[DEPTH]
    if stage.misses[miss, SHADER] == NULL:
        return
    if stage.payloads[depth - 1, 1] != stage.misses[miss, PAYLOAD]:
        raise InputError("trace_ray was given a payload of another struct than miss takes")
    count_call(stage, frame, MISS)
    tell(stage, MISS, depth, frame.contribution, -1, -1, frame.t_best)
    call_at(
        stage.misses[miss, SHADER], (stage.payloads[depth - 1, 0], words_of(frame), stage.scene)
    )


@inner
def call_closest_hit(bundle, stage, frame, ray):
    """Call the closest hit shader of what was hit, unless there is none or it is to be skipped."""
    depth, instance, number, t = stage.now[DEPTH], frame.instance, frame.number, frame.t_best
    if (frame.flags & RAY_FLAG_SKIP_CLOSEST_HIT_SHADER) != 0:
        tell(stage, SKIPPED, depth, frame.contribution, instance, number, t)
        return
    frame.entered = instance
    is_triangle = describe_hit(bundle.geometry, stage, frame, ray)
    table = stage.triangles if is_triangle else stage.procedurals
    record = record_of(stage, frame, frame.geometry_index) % len(table)
    if table[record, CLOSEST] == NULL:
        return
    if stage.payloads[depth - 1, 1] != table[record, PAYLOAD_OF_CLOSEST]:
        raise InputError(
            "trace_ray was given a payload of another struct than closest hit takes; is the hit "
            "group of its index one of another class of rays?"
        )
    frame.hit_kind = frame.kind
    count_call(stage, frame, CLOSEST_HIT)
    tell(stage, CLOSEST_HIT, depth, frame.contribution, instance, number, t)
    call_at(
        table[record, CLOSEST],
        (
            stage.payloads[depth - 1, 0], attributes_of(stage, depth - 1, COMMITTED),
            words_of(frame), stage.scene,
        ),
    )  # fmt: skip


@dispatched
def may_meet(geometry, mask):
    """Say whether a mask leaves anything to be met."""
    raise TypeError(f"no masks of {type(geometry).__name__}")


@implements(may_meet, Shaded)
def may_meet_all(geometry, mask):
    """Take all of it for one instance whose mask has all bits."""
    return (mask & 255) != 0


@implements(may_meet, ShadedReferences)
@implements(may_meet, ShadedInstances)
def may_meet_instances(geometry, mask):
    """Leave it to the instances."""
    return True


@dispatched
def describe_hit(geometry, stage, frame, ray):
    """Write the system values of what was hit, and say whether that is a triangle.

    Parameters
    ----------
    ray : Ray
        In the space of the geometry.
    """
    raise TypeError(f"no hits of {type(geometry).__name__}")


@implements(describe_hit, Shaded)
def describe_hit_item(geometry, stage, frame, ray):
    """Write those of an item."""
    describe(stage, frame, ray, frame.instance, frame.number)
    return describe_shape(geometry.items, frame)


@implements(describe_hit, ShadedInstances)
def describe_hit_within(geometry, stage, frame, ray):
    """Move the ray into the instance."""
    items, place = geometry.items, stage.places[frame.instance]
    within = moved_ray(items.to_object[place], ray, items.reaches[items.mesh[place]])
    return describe_hit(items.items, stage, frame, within)


@implements(describe_hit, ShadedReferences)
def describe_hit_referred_to(geometry, stage, frame, ray):
    """Move the ray into the instance; instances are in their own order."""
    items, instance = geometry.items.instances, frame.instance
    within = moved_ray(items.to_object[instance], ray, items.reaches[items.mesh[instance]])
    return describe_hit(items.items, stage, frame, within)


@dispatched
def describe_shape(items, frame):
    """Write where the vertices are or the box is, and say whether it is a triangle."""
    raise TypeError(f"no shapes among {type(items).__name__}")


@implements(describe_shape, Triangles)
def describe_triangle(items, frame):
    """Write the vertices."""
    frame.vertices = vertices_of(items.corners, frame.slot)
    return True


@implements(describe_shape, Mixed)
def describe_mixed(items, frame):
    """Write what the kind has."""
    if items.kinds[frame.slot] <= MOVING_TRIANGLE:
        frame.vertices = vertices_of(items.rows, frame.slot)
        return True
    boxes, slot = items.boxes, frame.slot
    frame.box = (
        boxes[slot, 0], boxes[slot, 1], boxes[slot, 2],
        boxes[slot, 3], boxes[slot, 4], boxes[slot, 5],
    )  # fmt: skip
    return False


# ---------------------------------------------------------------------------------- launches


@kernel
def dispatch_rays(
    stage_address, ray_generation, launch_words, output_words, origins, directions, width, height,
    first, last, colours, calls,
):  # fmt: skip
    """Call the ray generation shader for the pixels ``first <= i < last``, as ``DispatchRays``.

    Parameters
    ----------
    stage_address, ray_generation : int
    launch_words, output_words : (1, k) float64
        Room for a :class:`.system.Launch` and an :class:`.system.Output`.
    origins, directions : (n, 3) float64
        Of the camera's rays, row by row from the top left.
    width, height : int
    colours : (n, 4) float64
    calls : (n, len(STAGES)) int32
        What was called for each pixel.
    """
    stage = stage_at(stage_address)
    now = stage.now
    launch = record_at(Launch, words_at(launch_words, 0))
    output = record_at(Output, words_at(output_words, 0))
    for i in range(first, last):
        x, y = i % width, i // width
        now[DEPTH], now[PIXEL], now[X], now[Y] = 0, i, x, y
        for called in range(len(stage.of_pixel)):
            stage.of_pixel[called] = 0
        launch.index, launch.dimensions = (x, y), (width, height)
        launch.camera_position = (origins[i, 0], origins[i, 1], origins[i, 2])
        launch.camera_direction = (directions[i, 0], directions[i, 1], directions[i, 2])
        output.color = (0.0, 0.0, 0.0, 0.0)
        stage.of_pixel[RAY_GENERATION] += 1
        stage.calls[0, RAY_GENERATION] += 1
        tell(stage, RAY_GENERATION, 0, 0, -1, -1, 0.0)
        call_at(ray_generation, (stage.scene, words_of(launch), words_of(output)))
        colour = output.color
        colours[i, 0], colours[i, 1], colours[i, 2], colours[i, 3] = colour
        for called in range(len(stage.of_pixel)):
            calls[i, called] = stage.of_pixel[called]
