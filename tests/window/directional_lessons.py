"""Lessons of directional techniques in a real Blender window; run it as directional.py.

Each is taught as it begins, in the dark theme, and at other knobs in the light one; then on what
the user has: a monkey under a lamp and before a camera of their own. The pictures are there to be
looked at.
"""

from __future__ import annotations

import sys
from math import radians
from pathlib import Path

import bpy
from mathutils import Euler

sys.path.insert(0, str(Path(__file__).parent))
from guide import install, open_wide_tab, over_viewport, session, settings, station
from session import Steps
from taught import film, in_view, shown, use_theme

LESSONS = {
    "directional_cube": {"division": "uniform"},
    "raster_insertion": {"dilation": 2, "shown": "missed"},
    "light_buffer": {"ray": 40, "full_occlusion": False},
    "ray_coherence": {"other": 2},
    "coherence_lists": {"ray": 250},
    "ray_classification": {"cell": 40},
    "image_directory": {"division": "uniform"},
    "shafts": {"max_starts": 4, "number": 3},
    "ray_space": {"max_list_size": 1, "cell": 5},
    "ray_space_time": {"dimensions": "5"},
    "less_rays_recursion": {"threshold": 0.2, "tree": 5},
    "less_rays_samples": {"contrast": 0.3, "samples": "8"},
}
"""The lessons, and knobs that change their picture."""

ONLY = sys.argv[sys.argv.index("--") + 2 :] if "--" in sys.argv else []
"""Names of lessons to be looked at alone, behind the zip."""

CHOSEN = [name for name in LESSONS if not ONLY or name in ONLY]


def user_scene() -> None:
    """A monkey on a floor, one lamp and one camera, in the place of what a new file has."""
    for obj in list(bpy.context.scene.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.mesh.primitive_plane_add(size=6.0, location=(0.0, 0.0, -1.0))
    bpy.ops.mesh.primitive_monkey_add(rotation=(0.0, 0.0, 0.6))
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location = (-2.2, -1.6, 2.0)
    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    eye.location, eye.rotation_euler = (4.5, -4.5, 2.0), Euler((1.28, 0.0, radians(45)))
    for obj in (lamp, eye):
        bpy.context.collection.objects.link(obj)
    bpy.context.scene.camera = eye


@session.step
def install_zip() -> Steps:
    """A Blender nobody has used, with a scene of the user's own."""
    install()
    user_scene()
    yield from open_wide_tab()


@session.step
def go_through_all() -> Steps:
    """Each lesson by its own sample: as it begins, in the dark; at other knobs, in the light."""
    for name in CHOSEN:
        settings().teaching.lesson = name
        yield 0.5
        if bpy.context.window.scene.name == "Scene":
            yield from session.press("accelscope.teach(")
        yield lambda name=name: shown(name)
        over_viewport()
        yield 0.5
        in_view()
        station(name)
        for knob, value in LESSONS[name].items():
            setattr(getattr(settings().lessons, name), knob, value)
        use_theme(light=True)
        yield 1.0
        yield lambda name=name: shown(name)
        bpy.ops.accelscope.view_lesson()
        yield 0.5
        station(f"{name}-light")
        use_theme(light=False)
        film().go_to(bpy.context.window.scene, 0)
        yield lambda name=name: shown(name)


@session.step
def on_what_the_user_has() -> Steps:
    """The same on the user's own objects."""
    bpy.ops.accelscope.end_lesson()
    yield lambda: bpy.context.window.scene.name == "Scene"
    for obj in bpy.context.scene.objects:
        obj.select_set(obj.type == "MESH")
    for name in CHOSEN:
        settings().teaching.lesson = name
        yield 0.5
        yield from session.press("accelscope.use_my_mesh(", across=0.7)
        yield lambda name=name: shown(name)
        over_viewport()
        yield 0.7
        station(f"{name}-mine")
        bpy.ops.accelscope.end_lesson()
        yield lambda: bpy.context.window.scene.name == "Scene"


session.run()
