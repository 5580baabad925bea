"""Scenes, single rays and programs for the tests of the pipeline."""

import numpy as np
from accelscope.core.geometry.geometry import EVERY_OBJECT
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Box
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.pipeline.language import (
    HitGroup,
    Program,
    RayDesc,
    float3,
    struct,
    trace_ray,
)
from accelscope.core.pipeline.launch import Pipeline
from accelscope.core.scene import Scene
from accelscope.core.structures import structure_named

HERE = np.eye(3, 4)


def triangle(z, flipped=False):
    """A large triangle at a height; seen from above (against z) its corners run ccw."""
    corners = np.array([[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]])
    return corners[::-1] if flipped else corners


def stack(*heights, flipped=False):
    """Triangles above each other, each an object."""
    corners = np.array([triangle(z, flipped) for z in heights])
    ids = np.arange(len(heights), dtype=np.int32)
    return Scene.from_triangles(
        corners, "stack", object_ids=ids, object_names=tuple(f"object {i}" for i in ids)
    )


def boxes(*heights):
    """Flat boxes of thickness 1 above each other: procedural primitives."""
    items = [Box((-4.0, -4.0, z - 0.5), (4.0, 4.0, z + 0.5)) for z in heights]
    return Scene.from_items(items, "boxes")


def placed(*heights, matrices=None, masks=EVERY_OBJECT, **columns):
    """Instances of one triangle at z = 0."""
    if matrices is None:
        matrices = np.array([np.column_stack([np.eye(3), [0.0, 0.0, z]]) for z in heights])
    mesh = all_triangles(np.array([triangle(0.0)]))
    geometry = instanced([mesh], np.zeros(len(matrices), int), matrices, masks, **columns)
    return Scene.from_instances(geometry, "placed")


def down(count=1, height=10.0, length=1.0):
    """Rays straight down from a height, a little beside the middle."""
    origins = np.tile([0.25, 0.5, height], (count, 1))
    return Rays.from_arrays(origins, np.tile([0.0, 0.0, -length], (count, 1)))


def pipeline(scene, program, structure="bvh", flags=(0,), **settings):
    kind = structure_named(structure)
    return Pipeline(kind.build(scene, kind.Settings(**settings)), program, flags)


def states(scene, program, rays=None, **options):
    """The states of a single ray, in plain Python, and the colour that came of it."""
    made = pipeline(scene, program, **options)
    found, _ = made.record(down() if rays is None else rays, 1, 1, 0)
    return found


def names(found):
    return [state.name for state in found]


def called(found, name):
    """The primitives for which there was a state of a name, in order."""
    return [state.primitive for state in found if state.name == name]


@struct
class Payload:
    value: float3


def tracing(flags=0, mask=0xFF, contribution=0, multiplier=1, miss=0, t_min=0.0, t_max=1e30):
    """A ray generation shader that traces one ray, and shows its payload."""

    def ray_generation(scene, launch, output):
        ray = RayDesc()
        ray.origin = launch.camera_position
        ray.direction = launch.camera_direction
        ray.t_min = t_min
        ray.t_max = t_max
        payload = Payload()
        trace_ray(scene, flags, mask, contribution, multiplier, miss, ray, payload)
        output.color = (payload.value[0], payload.value[1], payload.value[2], 1.0)

    return ray_generation


def closest_hit(payload: Payload, attributes, ray, scene):
    payload.value = (ray.t_current, 1.0 * ray.primitive_index, 1.0 * ray.hit_kind)


def miss(payload: Payload, ray, scene):
    payload.value = (-1.0, -1.0, ray.t_current)


def program(*groups, misses=(miss,), depth=1, **tracing_options):
    groups = groups or (HitGroup(closest_hit=closest_hit),)
    return Program(
        ray_generation=tracing(**tracing_options), hit_groups=groups, miss=misses,
        max_recursion_depth=depth,
    )  # fmt: skip
