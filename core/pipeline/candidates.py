"""Candidates of a ray: what the walk meets, and what the shaders of its hit group say to it.

The walk is that of every structure (:mod:`..contract.walk`); there is no other one for the
pipeline. What it walks over is a geometry of another kind: its items are those of the scene, and
its ``intersect`` asks the program. So an ignored hit is, for the walk, a miss.

In the order of the specification ("TraceRay control flow"): is the primitive culled; does the ray
hit it, by the built-in test of a triangle or the intersection shader of a procedural primitive; is
the hit within the ray's interval, TMin < t < TMax for a triangle and TMin <= t <= TMax for a
procedural primitive; is it opaque, or what does the any hit shader say. A hit that is accepted is
committed: TMax is its t from then on.

In which order candidates come is not promised, and differs between structures. Of two at the same t
the one of the lower number counts, as everywhere in this house: so all structures make the same
picture. Where a structure meets a primitive in two of its cells and has no mailbox, its any hit
shader may be called twice, as the specification allows.

When a search is ended from within, the item answers a hit at TMin: nothing is nearer, so the walk
throws away all that it has put aside.

Microsoft: DirectX Raytracing (DXR) Functional Spec, v1.31, 2025.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..contract.instances import Instances, of_mesh
from ..contract.leaf import test_items, test_leaf
from ..geometry.box import span_box
from ..geometry.geometry import intersect
from ..geometry.solids.mixed import MOVING_TRIANGLE, Mixed
from ..geometry.triangle import NO_HIT
from ..geometry.triangles import Triangles
from ..kernels import dispatched, implements, inner, whole
from ..structures.two_level.braided_walk import Braided
from .barycentrics import faced
from .hits import (
    CULLS_OPACITY,
    ask,
    commit,
    describe,
    into_instance,
    is_culled_by_opacity,
    is_opaque,
    is_tie,
    record_of,
    vertices_of,
)
from .records import call_at, words_of
from .stage import (
    ANY,
    ASKS_ANY_HIT,
    CANDIDATE,
    CULLED,
    DEPTH,
    FIRST,
    FLAGS,
    INTERSECT,
    INTERSECTION,
    NULL,
    OUTSIDE,
    PENDING,
    REPORT,
    attributes_of,
    count_call,
    frame_of,
    geometry_and_index,
    stage_at,
    tell,
)  # fmt: skip
from .system import (
    ACCEPT_HIT_AND_END_SEARCH,
    HIT_KIND_TRIANGLE_BACK_FACE,
    HIT_KIND_TRIANGLE_FRONT_FACE,
    IGNORE_HIT,
    INSTANCE_FLAG_TRIANGLE_CULL_DISABLE,
    INSTANCE_FLAG_TRIANGLE_FRONT_COUNTERCLOCKWISE,
    RAY_FLAG_CULL_BACK_FACING_TRIANGLES,
    RAY_FLAG_CULL_FRONT_FACING_TRIANGLES,
    RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES,
    RAY_FLAG_SKIP_TRIANGLES,
)  # fmt: skip

CULLS_FACES = RAY_FLAG_CULL_BACK_FACING_TRIANGLES | RAY_FLAG_CULL_FRONT_FACING_TRIANGLES

NONE = whole(-1)


class Shaded(NamedTuple):
    """Triangles or solids whose hits a program decides.

    Attributes
    ----------
    ids, reach
        As of every geometry.
    items : NamedTuple of arrays
        The geometry itself.
    stage : int
        Address of the :class:`.stage.Stage`; in plain Python, the stage.
    """

    ids: np.ndarray
    reach: np.ndarray
    items: Any
    stage: Any


class ShadedInstances(NamedTuple):
    """Instances, of meshes whose hits a program decides; see :class:`Shaded`."""

    ids: np.ndarray
    reach: np.ndarray
    items: Any
    stage: Any


class ShadedReferences(NamedTuple):
    """References into instances, of a re-braided top level; see :class:`Shaded`."""

    ids: np.ndarray
    reach: np.ndarray
    items: Any
    stage: Any


def shaded(geometry: Any, stage: Any) -> Shaded | ShadedInstances | ShadedReferences:
    """Return a geometry as one whose hits a program decides."""
    if isinstance(geometry, Braided):
        within = shaded(geometry.instances, stage).items
        return ShadedReferences(
            geometry.ids, geometry.reach, geometry._replace(instances=within), stage
        )
    if isinstance(geometry, Instances):
        inner_items = shaded(geometry.items, stage)
        return ShadedInstances(
            geometry.ids, geometry.reach, geometry._replace(items=inner_items), stage
        )
    return Shaded(geometry.ids, geometry.reach, geometry, stage)


implements(test_leaf, Shaded)(test_items)
implements(test_leaf, ShadedInstances)(test_items)
implements(test_leaf, ShadedReferences)(test_items)


@implements(of_mesh, Shaded)
def shaded_of_mesh(items, reach):
    """Exchange the reach."""
    return Shaded(items.ids, reach, of_mesh(items.items, reach), items.stage)


# --------------------------------------------------------------------------------- instances


@implements(intersect, ShadedInstances)
def intersect_shaded_instance(geometry, index, ray, limit, number, workspace, log):
    """Note which instance it is, and where the ray is in its box, and walk through its mesh."""
    items, stage = geometry.items, stage_at(geometry.stage)
    frame = frame_of(stage, stage.now[DEPTH] - 1)
    first = items.first[index]
    if frame.has_ended != 0:
        return NO_HIT, first
    frame.entered = whole(geometry.ids[index])
    frame.enter, frame.leave = span_box(items.boxes, index, ray, np.inf)
    return intersect(items, index, ray, limit, number, workspace, log)


@implements(intersect, ShadedReferences)
def intersect_shaded_reference(geometry, index, ray, limit, number, workspace, log):
    """Do the same for the instance that is referred to; the walk begins at a node of its mesh."""
    items, stage = geometry.items, stage_at(geometry.stage)
    frame = frame_of(stage, stage.now[DEPTH] - 1)
    instance = whole(geometry.ids[index])
    if frame.has_ended != 0:
        return NO_HIT, items.instances.first[instance]
    frame.entered = instance
    frame.enter, frame.leave = span_box(items.instances.boxes, instance, ray, np.inf)
    return intersect(items, index, ray, limit, number, workspace, log)


# ------------------------------------------------------------------------------------- items


@implements(intersect, Shaded)
def intersect_shaded(geometry, index, ray, limit, number, workspace, log):
    """Ask the program whether the ray hits an item."""
    stage = stage_at(geometry.stage)
    frame = frame_of(stage, stage.now[DEPTH] - 1)
    local = whole(geometry.ids[index])
    if frame.has_ended != 0:
        return NO_HIT, local
    t = meet(geometry.items, index, ray, number, workspace, log, stage, frame)
    return (ray.t_min if frame.has_ended != 0 else t), local


@dispatched
def meet(items, index, ray, number, workspace, log, stage, frame):
    """Return the t of an item that is hit and accepted, otherwise NO_HIT.

    Parameters
    ----------
    items : NamedTuple of arrays
        Decides the implementation.
    index : int
    ray : Ray
        In the space of the items.
    stage : Stage
    frame : system.Ray
        The same ray as shaders see it.
    """
    raise TypeError(f"no candidates among {type(items).__name__}")


@implements(meet, Triangles)
def meet_triangle(items, index, ray, number, workspace, log, stage, frame):
    """Test the triangle, and offer what is hit."""
    t, local = intersect(items, index, ray, frame.t_best, number, workspace, log)
    # Most are missed, or lie behind a hit.
    if t == NO_HIT or t > frame.t_best:
        return NO_HIT
    return offer_triangle(items.corners, index, ray, stage, frame, t, local)


@implements(meet, Mixed)
def meet_mixed(items, index, ray, number, workspace, log, stage, frame):
    """Test what is a triangle; of the rest take the box, and call the intersection shader."""
    local = whole(items.ids[index])
    if items.kinds[index] <= MOVING_TRIANGLE:
        t, _ = intersect(items, index, ray, frame.t_best, number, workspace, log)
        if t == NO_HIT or t > frame.t_best:
            return NO_HIT
        return offer_triangle(items.rows, index, ray, stage, frame, t, local)
    return meet_procedural(items.boxes, index, ray, stage, frame, local)


@inner
def offer_triangle(corners, index, ray, stage, frame, t, local):
    """Offer the hit of a triangle, unless it is culled, and return its t, or NO_HIT."""
    instance = frame.entered
    number = stage.instances[instance, FIRST] + local
    before = frame.t_best
    t = into_instance(frame, t)
    tell(stage, CANDIDATE, stage.now[DEPTH], frame.contribution, instance, number, t)
    if not frame.t_min < t or not (t < before or is_tie(frame, t, number)):
        tell(stage, OUTSIDE, stage.now[DEPTH], frame.contribution, instance, number, t)
        return NO_HIT
    is_front, weight_1, weight_2 = faced(corners, index, ray)
    flags = stage.instances[instance, FLAGS]
    if len(stage.turned) > 0 and stage.turned[number] != 0:
        is_front = not is_front
    kind = whole(HIT_KIND_TRIANGLE_FRONT_FACE if is_front else HIT_KIND_TRIANGLE_BACK_FACE)
    if (flags & INSTANCE_FLAG_TRIANGLE_FRONT_COUNTERCLOCKWISE) != 0:
        kind = HIT_KIND_TRIANGLE_FRONT_FACE + HIT_KIND_TRIANGLE_BACK_FACE - kind
    if (frame.flags & (CULLS_FACES | CULLS_OPACITY | RAY_FLAG_SKIP_TRIANGLES)) != 0:
        culls = (
            RAY_FLAG_CULL_FRONT_FACING_TRIANGLES if kind == HIT_KIND_TRIANGLE_FRONT_FACE
            else RAY_FLAG_CULL_BACK_FACING_TRIANGLES
        )  # fmt: skip
        is_culled = (frame.flags & culls) != 0
        is_culled = is_culled and (flags & INSTANCE_FLAG_TRIANGLE_CULL_DISABLE) == 0
        is_skipped = (frame.flags & RAY_FLAG_SKIP_TRIANGLES) != 0
        if is_culled or is_skipped or is_culled_by_opacity(stage, frame, number):
            tell(stage, CULLED, stage.now[DEPTH], frame.contribution, instance, number, t)
            return NO_HIT
    pending = 2 * (stage.now[DEPTH] - 1) + PENDING
    stage.attributes[pending, 0], stage.attributes[pending, 1] = weight_1, weight_2
    frame.candidate, frame.candidate_slot = number, index
    if stage.now[ASKS_ANY_HIT] != 0:
        geometry, _ = geometry_and_index(stage, instance, number)
        record = record_of(stage, frame, geometry) % len(stage.triangles)
        if stage.triangles[record, ANY] != NULL and not is_opaque(stage, frame, number):
            describe(stage, frame, ray, instance, number)
            frame.vertices = vertices_of(corners, index)
            verdict = ask(stage, frame, t, kind, stage.triangles, record)
            if verdict == IGNORE_HIT:
                return NO_HIT
            commit(stage, frame, t, kind, verdict == ACCEPT_HIT_AND_END_SEARCH)
            return t
    commit(stage, frame, t, kind, False)
    return t


@inner
def meet_procedural(boxes, index, ray, stage, frame, local):
    """Call the intersection shader of a procedural primitive whose box the ray meets."""
    enter, leave = span_box(boxes, index, ray, np.inf)
    if enter > leave or enter > frame.t_best:
        return NO_HIT
    instance = frame.entered
    number = stage.instances[instance, FIRST] + local
    depth = stage.now[DEPTH]
    tell(stage, CANDIDATE, depth, frame.contribution, instance, number, enter)
    is_skipped = (frame.flags & RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES) != 0
    if is_skipped or is_culled_by_opacity(stage, frame, number):
        tell(stage, CULLED, depth, frame.contribution, instance, number, enter)
        return NO_HIT
    geometry, _ = geometry_and_index(stage, instance, number)
    record = record_of(stage, frame, geometry) % len(stage.procedurals)
    describe(stage, frame, ray, instance, number)
    frame.box = (
        boxes[index, 0], boxes[index, 1], boxes[index, 2],
        boxes[index, 3], boxes[index, 4], boxes[index, 5],
    )  # fmt: skip
    frame.candidate, frame.candidate_slot = number, index
    # A hit is moved into the interval of the primitive's own box, as everywhere.
    outer_enter, outer_leave = frame.enter, frame.leave
    frame.enter, frame.leave = max(outer_enter, enter), min(outer_leave, leave)
    frame.t_current = frame.t_best
    before_t, before = frame.t_best, frame.number
    count_call(stage, frame, INTERSECTION)
    tell(stage, INTERSECTION, depth, frame.contribution, instance, number, enter)
    call_at(
        stage.procedurals[record, INTERSECT],
        (words_of(frame), attributes_of(stage, depth - 1, PENDING)),
    )
    frame.enter, frame.leave = outer_enter, outer_leave
    is_hit = frame.t_best < before_t or frame.number != before
    return frame.t_best if is_hit else NO_HIT


@inner
def report(stage, frame, t, kind):
    """Offer what an intersection shader reports, and say whether it is accepted."""
    depth, number, instance = stage.now[DEPTH], frame.candidate, frame.entered
    tell(stage, REPORT, depth, frame.contribution, instance, number, t)
    if frame.has_ended != 0:
        return False
    is_inside = frame.t_min <= t <= frame.t_best
    t = into_instance(frame, t)
    # At the t of a hit that counts the lower number goes before.
    is_inside = is_inside and (
        t < frame.t_best or (t == frame.t_best and not 0 <= frame.number < number)
    )
    if not is_inside:
        tell(stage, OUTSIDE, depth, frame.contribution, instance, number, t)
        return False
    geometry, _ = geometry_and_index(stage, instance, number)
    record = record_of(stage, frame, geometry) % len(stage.procedurals)
    verdict = whole(0)
    if stage.procedurals[record, ANY] != NULL and not is_opaque(stage, frame, number):
        verdict = ask(stage, frame, t, kind, stage.procedurals, record)
        frame.t_current = frame.t_best
        if verdict == IGNORE_HIT:
            return False
    commit(stage, frame, t, kind, verdict == ACCEPT_HIT_AND_END_SEARCH)
    frame.t_current = frame.t_best
    return True
