"""What one thread of a launch works with: shader tables, frames of the rays under way, counts.

A frame belongs to a call of TraceRay. Its :class:`.system.Ray` is what shaders see of the ray; the
hit that counts so far, and the candidate, have their attributes in words of their own. Frames are
stacked: a closest hit shader that traces a ray on has its own below.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..kernels import inlined, inner, whole
from .records import declared, record_at, words_at
from .system import MOST_RECURSION, Ray

STAGES = RAY_GENERATION, TRACE_RAY, INTERSECTION, ANY_HIT, CLOSEST_HIT, MISS = range(6)
"""What is called; calls are counted by it."""

STAGE_NAMES = (
    "ray_generation", "trace_ray", "intersection", "any_hit", "closest_hit", "miss",
)  # fmt: skip

MOST_TYPES = 8
"""Classes of rays that are counted apart; the last takes all that are beyond."""

MOST_ATTRIBUTES = 8
"""Words of attributes: twice the 32 bytes of the specification, for numbers of twice the size."""

# Columns of the tables of hit groups, and of miss shaders.
INTERSECT, ANY, CLOSEST, PAYLOAD_OF_ANY, PAYLOAD_OF_CLOSEST = range(5)
SHADER, PAYLOAD = range(2)

# Columns of the table of instances.
FIRST, ID, CONTRIBUTION, FLAGS = range(4)

# Places in `Stage.now`.
DEPTH, LIMIT, NUMBER, PIXEL, X, Y, ASKS_ANY_HIT = range(7)

COMMITTED, PENDING = range(2)
"""Of a frame, the attributes of the hit that counts, and of the one that is reported."""

NULL = 0
"""In the place of a shader: there is none."""

# States of a ray, beside the calls of shaders.
(
    CANDIDATE, REPORT, OUTSIDE, CULLED, IGNORED, ACCEPTED, ENDED, HIT_FOUND, NOTHING_FOUND,
    SKIPPED, RETURNED,
) = range(len(STAGES), len(STAGES) + 11)  # fmt: skip

STATE_NAMES = (
    *STAGE_NAMES, "candidate", "report_hit", "outside_interval", "culled", "ignored", "accepted",
    "search_ended", "hit", "no_hit", "closest_hit_skipped", "returned",
)  # fmt: skip


class Stage(NamedTuple):
    """Tables and scratch memory of one thread.

    Attributes
    ----------
    triangles, procedurals : (k, 5) int64
        Hit groups of triangles and of procedural primitives: addresses of shaders, and the kinds of
        their payloads. Record i of a table is row i modulo k: as long as the scene needs it.
    misses : (m, 2) int64
    frames : (MOST_RECURSION + 1, Ray.size) float64
    attributes : (2 * (MOST_RECURSION + 1), MOST_ATTRIBUTES) float64
        Of each frame, COMMITTED and PENDING.
    payloads : (MOST_RECURSION + 1, 2) int64
        Of each frame, the payload's address and its kind.
    now : (7,) int64
    of_pixel : (len(STAGES),) int64
        Calls for the pixel that is being made.
    calls : (MOST_TYPES, len(STAGES)) int64
        Calls by the class of the ray.
    instances : (n, 4) int64
        Number of the first primitive, InstanceID, contribution to the hit group index, flags.
    to_world, to_object : (n, 12) float64
    geometry_of, index_of : (n,) int32
        Of each primitive, the number of its geometry and its number in that; over instances, empty.
    geometry_first : (k,) int64
        Over instances that hold several geometries, the number of the first primitive of each.
    geometry_flags : (g,) int64
    material_of : (n,) int32
        Of each primitive; over instances of each, or of each run of one material.
    material_first : (k,) int64
    turned : (n,) uint8
        Of each primitive, whether its corners run the other way round; empty if those of none do.
    materials : (m, 5) float64
        Red, green, blue, specular, transmission.
    places : (n,) int32
        Of each instance, its place in the geometry.
    scene : int
        Address of the :class:`.system.Scene` that shaders are given.
    states : list or (0,) int64
        In plain Python, what happens; see :func:`tell`.
    """

    triangles: Any
    procedurals: Any
    misses: Any
    frames: np.ndarray
    attributes: np.ndarray
    payloads: Any
    now: np.ndarray
    of_pixel: np.ndarray
    calls: np.ndarray
    instances: np.ndarray
    to_world: np.ndarray
    to_object: np.ndarray
    geometry_of: np.ndarray
    index_of: np.ndarray
    geometry_first: np.ndarray
    geometry_flags: np.ndarray
    material_of: np.ndarray
    material_first: np.ndarray
    turned: np.ndarray
    materials: np.ndarray
    places: np.ndarray
    scene: Any
    states: Any


def stage_at(address: Any) -> Any:
    """Return the stage at an address; in plain Python, what is given."""
    return address


def tell(
    stage: Stage, state: int, depth: int, ray_type: int, instance: int, primitive: int, t: float
) -> None:
    """Note what happens, in plain Python and where there is a list for it; compiled, do nothing.

    Of a ray that begins, where and whither is noted, too.
    """
    if isinstance(stage.states, list):
        ray: tuple[Any, ...] = ()
        if state == TRACE_RAY:
            frame = frame_of(stage, depth - 1)
            ray = frame.world_origin, frame.world_direction
        stage.states.append((state, depth, ray_type, instance, primitive, t, *ray))


@inlined
def frame_of(stage, depth):
    """Return the ray of a frame."""
    return record_at(Ray, words_at(stage.frames, depth))


@inlined
def attributes_of(stage, depth, which):
    """Return the words of attributes of a frame: COMMITTED or PENDING."""
    return words_at(stage.attributes, 2 * depth + which)


@inlined
def count_call(stage, ray, called):
    """Count the call of a shader for a ray."""
    stage.of_pixel[called] += 1
    stage.calls[min(ray.contribution, MOST_TYPES - 1), called] += 1


@inner
def run_of(first, number):
    """Return the run that a number lies in: the last that begins at it or before."""
    low, high = 0, len(first)
    while high - low > 1:
        middle = (low + high) // 2
        if first[middle] <= number:
            low = middle
        else:
            high = middle
    return low


@inner
def geometry_and_index(stage, instance, number):
    """Return the number of a primitive's geometry within its instance, and its number in that."""
    if len(stage.geometry_of) > 0:
        return whole(stage.geometry_of[number]), whole(stage.index_of[number])
    begin = stage.instances[instance, FIRST]
    if len(stage.geometry_first) == 0:
        return whole(0), number - begin
    run = run_of(stage.geometry_first, number)
    return run - run_of(stage.geometry_first, begin), number - stage.geometry_first[run]


@inner
def material_at(stage, instance, number):
    """Return the number of the material of a primitive."""
    if len(stage.material_first) > 0:
        return whole(stage.material_of[run_of(stage.material_first, number)])
    if len(stage.geometry_of) == 0:
        return whole(stage.material_of[instance])
    return whole(stage.material_of[number])


def make_frames() -> dict[str, np.ndarray]:
    """Return the scratch memory of a stage."""
    depth = MOST_RECURSION + 1
    return {
        "frames": np.zeros((depth, declared(Ray).size)),
        "attributes": np.zeros((2 * depth, MOST_ATTRIBUTES)),
        "now": np.zeros(7, np.int64),
        "of_pixel": np.zeros(len(STAGES), np.int64),
        "calls": np.zeros((MOST_TYPES, len(STAGES)), np.int64),
    }
