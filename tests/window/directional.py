"""Structures built from lamps and a camera, in a real Blender window: drawn there, and watched.

    .venv/bin/python .ci/build_extension.py --platform linux-x64 --output build/window/extension
    .ci/blender_window.sh tests/window/directional.py build/window/directional [-- ZIP]

Cells stand around a lamp, across a sun's rays, before the camera. When one of those is moved, the
panel says so by itself, and the cells fade; moved back, both is gone.
"""

from __future__ import annotations

import sys
from math import radians
from pathlib import Path

import bpy
from mathutils import Euler, Vector

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    build,
    install,
    open_wide_tab,
    results,
    session,
    settings,
    station,
    trace,
)
from session import Steps


def said() -> str:
    """Return what the panel says, which compares nothing itself."""
    return results().status(bpy.context, at_once=False).text


def place(data: bpy.types.ID, location: tuple, rotation: tuple = (0.0, 0.0, 0.0)) -> None:
    """Put a lamp or a camera into the scene."""
    obj = bpy.data.objects.new(data.name, data)
    obj.location, obj.rotation_euler = location, rotation
    bpy.context.collection.objects.link(obj)


def look_at(place: tuple, distance: float) -> None:
    """Look at a place from the front, left of the sidebar."""
    view = session.area().spaces[0].region_3d
    view.view_rotation = Euler((radians(72), 0.0, radians(28))).to_quaternion()
    view.view_distance = distance
    view.view_location = Vector(place) + view.view_rotation @ Vector((0.14 * distance, 0.0, 0.0))


def moved(name: str, axis: int, text: str, picture: str) -> Steps:
    """Move an object: the panel says what that is by itself, and that it is back."""
    obj = bpy.data.objects[name]
    obj.location[axis] += 0.5
    yield lambda: said() == f"Out of date: {text}"
    yield 1.0
    station(picture)
    obj.location[axis] -= 0.5
    yield lambda: said() == "Up to date"


@session.step
def prepare() -> Steps:
    """A monkey, a lamp, a camera."""
    install()
    yield from open_wide_tab()
    for obj in list(bpy.context.scene.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_monkey_add()
    place(bpy.data.lights.new("Lamp", "POINT"), (-2.0, -1.5, 1.0))
    place(bpy.data.cameras.new("Eye"), (3.5, -3.5, 1.0), (1.35, 0.0, 0.78))
    bpy.context.scene.camera = bpy.data.objects["Eye"]
    look_at((-1.0, -0.8, 0.4), 5.0)
    yield 1.0


@session.step
def around_the_lamp() -> Steps:
    """Cells of the light buffer stand around the lamp, in colours of their lists."""
    settings().structure = "light_buffer"
    settings().display.colour_by = "count"
    yield from build()
    yield 1.0
    station("light_buffer")
    settings().display.depth_min = settings().display.depth_max = 3
    yield 1.0
    station("light_buffer_level")
    settings().display.depth_min, settings().display.depth_max = 0, 100
    yield lambda: said() == "Up to date"


@session.step
def the_lamp_moves() -> Steps:
    """A light buffer is out of date when its lamp is moved."""
    yield from moved("Lamp", 2, "the lights were changed", "lamp_moved")


@session.step
def before_the_camera() -> Steps:
    """The cells of the picture stand before the camera."""
    settings().structure = "image_directory"
    yield from build()
    look_at((1.0, -1.0, 0.4), 7.0)
    yield 1.0
    station("image_directory")
    yield from moved("Eye", 0, "the camera was moved", "camera_moved")


@session.step
def both_in_routed() -> Steps:
    """Primary rays go to the one, shadow rays to the other."""
    settings().structure = "routed"
    routed = settings().structures.routed
    routed.primary, routed.shadow = "image_directory", "light_buffer"
    settings().workload = "camera"
    rays = settings().workloads.camera
    rays.width, rays.height, rays.shadows = 24, 24, True
    yield from build()
    yield from trace()
    look_at((0.5, -1.0, 0.4), 9.0)
    yield 1.0
    routes = results().record["trace"]["routes"]
    assert [routes[kind]["structure"] for kind in ("primary", "shadow")] == [
        "image_directory", "light_buffer",
    ]  # fmt: skip
    station("routed")


@session.step
def where_shadow_rays_go() -> Steps:
    """Cells of the cube in the lamp's sphere, of which shadow rays have made some."""
    routed = settings().structures.routed
    routed.primary, routed.shadow = "bvh", "ray_coherence"
    yield from build()
    yield from trace()
    yield 1.0
    assert results().record["trace"]["routes"]["shadow"]["structure"] == "ray_coherence"
    station("coherence")


@session.step
def across_a_sun() -> Steps:
    """The cells of a sun lie in a plane across its rays."""
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    place(bpy.data.lights.new("Sun", "SUN"), (0.0, 0.0, 3.0), (0.5, -0.4, 0.0))
    settings().structure = "light_buffer"
    yield from build()
    look_at((0.0, 0.0, 0.8), 9.0)
    yield 1.0
    station("sun")


@session.step
def without_rays() -> Steps:
    """Camera rays are refused in one line."""
    yield from session.press("accelscope.trace(")
    yield 2.0
    station("refused")


session.run()
