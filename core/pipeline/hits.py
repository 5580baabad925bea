"""What becomes of a candidate: is it opaque, what does its any hit shader say, does it count.

Here is also what shaders are told of a primitive: the system values.
"""

from __future__ import annotations

from ..errors import InputError
from ..kernels import inlined, inner, whole
from .records import call_at, words_of
from .stage import (
    ACCEPTED,
    ANY,
    ANY_HIT,
    COMMITTED,
    CONTRIBUTION,
    DEPTH,
    ENDED,
    FLAGS,
    ID,
    IGNORED,
    PAYLOAD_OF_ANY,
    PENDING,
    attributes_of,
    count_call,
    geometry_and_index,
    material_at,
    tell,
)  # fmt: skip
from .system import (
    GEOMETRY_FLAG_OPAQUE,
    IGNORE_HIT,
    INSTANCE_FLAG_FORCE_NON_OPAQUE,
    INSTANCE_FLAG_FORCE_OPAQUE,
    RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH,
    RAY_FLAG_CULL_NON_OPAQUE,
    RAY_FLAG_CULL_OPAQUE,
    RAY_FLAG_FORCE_NON_OPAQUE,
    RAY_FLAG_FORCE_OPAQUE,
)  # fmt: skip

CULLS_OPACITY = RAY_FLAG_CULL_OPAQUE | RAY_FLAG_CULL_NON_OPAQUE


@inlined
def into_instance(frame, t):
    """Move t into the interval of the instance's box, as an instance does with what is in it."""
    t = frame.enter if frame.enter > t else t
    return frame.leave if frame.leave < t else t


@inlined
def is_tie(frame, t, number):
    """Say whether a candidate lies where the hit so far does, and has a lower number."""
    return t == frame.t_best and number < frame.number


@inlined
def record_of(stage, frame, geometry):
    """Return the index of the hit group: contribution + multiplier * geometry + instance's."""
    of_instance = stage.instances[frame.entered, CONTRIBUTION]
    return frame.contribution + frame.multiplier * geometry + of_instance


@inner
def is_declared_opaque(stage, frame, number):
    """Say whether geometry and instance are opaque, before the ray is asked."""
    flags = stage.instances[frame.entered, FLAGS]
    if (flags & INSTANCE_FLAG_FORCE_OPAQUE) != 0:
        return True
    if (flags & INSTANCE_FLAG_FORCE_NON_OPAQUE) != 0:
        return False
    geometry, _ = geometry_and_index(stage, frame.entered, number)
    return (stage.geometry_flags[geometry % len(stage.geometry_flags)] & GEOMETRY_FLAG_OPAQUE) != 0


@inner
def is_opaque(stage, frame, number):
    """Say whether no any hit shader is asked: the ray's flags go before the instance's."""
    if (frame.flags & RAY_FLAG_FORCE_OPAQUE) != 0:
        return True
    if (frame.flags & RAY_FLAG_FORCE_NON_OPAQUE) != 0:
        return False
    return is_declared_opaque(stage, frame, number)


@inlined
def is_culled_by_opacity(stage, frame, number):
    """Say whether the ray culls what is opaque, or what is not."""
    if (frame.flags & CULLS_OPACITY) == 0:
        return False
    culls = (frame.flags & RAY_FLAG_CULL_OPAQUE) != 0
    return is_declared_opaque(stage, frame, number) == culls


@inner
def ask(stage, frame, t, kind, table, record):
    """Call an any hit shader, and return its verdict."""
    depth = stage.now[DEPTH]
    if stage.payloads[depth - 1, 1] != table[record, PAYLOAD_OF_ANY]:
        raise InputError(
            "trace_ray was given a payload of another struct than any hit takes; is the hit group "
            "of its index one of another class of rays?"
        )
    frame.t_current, frame.hit_kind = t, kind
    count_call(stage, frame, ANY_HIT)
    tell(stage, ANY_HIT, depth, frame.contribution, frame.entered, frame.candidate, t)
    verdict = call_at(
        table[record, ANY],
        (stage.payloads[depth - 1, 0], attributes_of(stage, depth - 1, PENDING), words_of(frame)),
    )
    if verdict == IGNORE_HIT:
        tell(stage, IGNORED, depth, frame.contribution, frame.entered, frame.candidate, t)
    return verdict


@inner
def commit(stage, frame, t, kind, ends):
    """Let the candidate be the hit that counts."""
    depth = stage.now[DEPTH]
    frame.t_best, frame.kind = t, kind
    frame.number, frame.slot, frame.instance = frame.candidate, frame.candidate_slot, frame.entered
    for word in range(stage.attributes.shape[1]):
        stage.attributes[2 * depth - 2 + COMMITTED, word] = stage.attributes[
            2 * depth - 2 + PENDING, word
        ]
    tell(stage, ACCEPTED, depth, frame.contribution, frame.entered, frame.candidate, t)
    if ends or (frame.flags & RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH) != 0:
        frame.has_ended = whole(1)
        tell(stage, ENDED, depth, frame.contribution, frame.entered, frame.candidate, t)


@inner
def describe(stage, frame, ray, instance, number):
    """Write the system values of a primitive; `ray` is in its instance's space."""
    frame.object_origin = (ray.ox, ray.oy, ray.oz)
    frame.object_direction = (ray.dx, ray.dy, ray.dz)
    describe_item(stage, frame, instance, number)


@inner
def describe_item(stage, frame, instance, number):
    """Write those that are not the ray's."""
    frame.instance_index = instance
    frame.instance_id = stage.instances[instance, ID]
    frame.geometry_index, frame.primitive_index = geometry_and_index(stage, instance, number)
    frame.object_to_world = twelve(stage.to_world, instance)
    frame.world_to_object = twelve(stage.to_object, instance)
    material = stage.materials[material_at(stage, instance, number)]
    frame.color = (material[0], material[1], material[2])
    frame.specular, frame.transmission = material[3], material[4]


@inlined
def twelve(rows, index):
    """Return a row of twelve numbers."""
    return (
        rows[index, 0], rows[index, 1], rows[index, 2], rows[index, 3],
        rows[index, 4], rows[index, 5], rows[index, 6], rows[index, 7],
        rows[index, 8], rows[index, 9], rows[index, 10], rows[index, 11],
    )  # fmt: skip


@inlined
def vertices_of(corners, index):
    """Return the coordinates of the three corners of a triangle."""
    return (
        corners[index, 0, 0], corners[index, 0, 1], corners[index, 0, 2],
        corners[index, 1, 0], corners[index, 1, 1], corners[index, 1, 2],
        corners[index, 2, 0], corners[index, 2, 1], corners[index, 2, 2],
    )  # fmt: skip
