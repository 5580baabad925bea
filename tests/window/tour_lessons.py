"""A tour through all lessons in a real Blender window, by clicks; see tour.py for how to run it.

Each is taught as it begins and as its film ends, in the dark theme, in the light one, and once in
large text; the pictures are there to be looked at.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import (
    region_2d_to_origin_3d,
    region_2d_to_vector_3d,
)
from mathutils import Euler

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    install,
    note,
    open_wide_tab,
    over_viewport,
    part,
    running,
    session,
    settings,
    station,
)
from session import Steps
from taught import film, in_view, shown, use_theme, view

ONLY = sys.argv[sys.argv.index("--") + 2 :] if "--" in sys.argv else []
"""Names of lessons to be looked at alone, behind the zip, while one of them is being made."""

NEXT = 0.86
"""Where the button of the next lesson is, as a share of the sidebar's width."""

PICK = 0.25
"""Where Pick Pixel is, left of Step This Ray."""

END = 0.25
"""Where End Lesson is, left of Use My Mesh."""


def names() -> list[str]:
    """Return the names of the lessons on this tour."""
    every = list(part("core.lessons").lessons())
    return [name for name in every if not ONLY or name in ONLY]


@session.step
def install_zip() -> None:
    """The zip installs into a Blender nobody has used before."""
    install()


@session.step
def teach_the_first() -> Steps:
    """The first thing in the tab is the list of lessons; Teach shows the one that is chosen."""
    yield from open_wide_tab()
    station("tab")
    settings().teaching.lesson = names()[0]
    begun = time.monotonic()
    yield from session.press("accelscope.teach(")
    if running() is not None:
        yield 3.0
        station("waiting")
    yield lambda: shown(names()[0])
    note("first lesson after installation, s", round(time.monotonic() - begun, 1))
    assert bpy.context.window.scene.name == "AccelScope Lesson"


@session.step
def go_through_all() -> Steps:
    """Each lesson is one click after the one before; its film is played to its end."""
    for number, name in enumerate(names()):
        if number:
            begun = time.monotonic()
            if ONLY:
                settings().teaching.lesson = name
            else:
                yield from session.press("accelscope.step_lesson(", across=NEXT)
            yield lambda name=name: shown(name)
            note(f"{name}, s", round(time.monotonic() - begun, 1))
        over_viewport()
        yield 0.3
        in_view()
        station(f"{name}")
        scene, last = bpy.context.window.scene, len(film().values()) - 1
        film().go_to(scene, (2 * last + 2) // 3)
        yield lambda name=name: shown(name)
        bpy.ops.accelscope.view_lesson()
        use_theme(light=True)
        settings().teaching.large_text = True
        yield 0.5
        station(f"{name}-light-large")
        film().go_to(scene, last)
        yield lambda name=name: shown(name)
        bpy.ops.accelscope.view_lesson()
        settings().teaching.large_text = False
        use_theme(light=False)
        yield 0.5
        station(f"{name}-last")


@session.step
def heat_map_of_the_view() -> Steps:
    """The rays of the heat map are those of the viewport; a click into the map chooses a pixel."""
    settings().teaching.lesson = "heat_map"
    yield lambda: shown("heat_map")
    area, region = session.area(), session.region()
    seen = area.spaces[0].region_3d
    seen.view_rotation = Euler((0.9, 0.0, -0.5)).to_quaternion()
    over_viewport()
    yield 0.5
    before = view().play
    yield from session.press("accelscope.use_this_view(")
    yield lambda: running() is None and view().play is not before
    rays, width, height = view().play.rays, view().play.width, view().play.height
    for row in (0, height - 1):
        number = row * width + width // 2
        place = 0.5 * region.width, region.height * (1.0 - (row + 0.5) / height)
        way = region_2d_to_vector_3d(region, seen, place)
        found = rays.directions[number] / np.linalg.norm(rays.directions[number])
        # Half a pixel beside the middle.
        assert np.linalg.norm(np.array(way) - found) < 0.01, (way, found)
        eye = region_2d_to_origin_3d(region, seen, place)
        np.testing.assert_allclose(eye, rays.origins[number], atol=1e-3)
    station("heat-map-of-the-view")
    yield from session.press("accelscope.pick_ray(", across=PICK)
    room = next(iter(part("addon.drawing.picture_overlay")._state.image_places.values()))
    x, y = 0.75 * room.left + 0.25 * room.right, 0.5 * (room.bottom + room.top)
    session.click(region.x + x, region.y + y)
    knobs = settings().lessons.heat_map
    yield lambda: abs(knobs.column - 0.25 * width) <= 2
    yield 0.5
    station("pixel")
    yield from session.press("accelscope.step_this_ray(", across=0.7)
    yield lambda: shown("ray")
    yield 0.5
    station("ray-of-the-pixel")


@session.step
def read_the_source() -> Steps:
    """The technique's file stands in a text editor of its own window."""
    yield from session.press("accelscope.read_source(")
    yield lambda: len(bpy.context.window_manager.windows) == 2
    yield 1.0
    opened = bpy.context.window_manager.windows[1]
    (editor,) = (area for area in opened.screen.areas if area.type == "TEXT_EDITOR")
    text = editor.spaces.active.text
    assert text.name.startswith("core/")
    assert text.as_string().startswith('"""')
    station("source")
    with bpy.context.temp_override(window=opened):
        bpy.ops.wm.window_close()
    yield lambda: len(bpy.context.window_manager.windows) == 1


@session.step
def undo() -> Steps:
    """Undo goes back to before the lesson was taught, and to the viewport as it was."""
    yield from session.press("accelscope.end_lesson(", across=END)
    yield lambda: bpy.context.window.scene.name == "Scene"
    space = session.area().spaces[0]
    assert space.overlay.show_floor
    settings().teaching.lesson = names()[0]
    yield from session.press("accelscope.teach(")
    yield lambda: shown(names()[0])
    assert not space.overlay.show_floor
    over_viewport()
    session.key("ctrl+z")
    yield lambda: bpy.context.window.scene.name == "Scene"
    assert view().lesson is None
    assert space.overlay.show_floor
    station("undone")
    settings().teaching.lesson = names()[0]
    yield from session.press("accelscope.teach(")
    yield lambda: shown(names()[0])


@session.step
def go_back() -> Steps:
    """End Lesson goes back to the user's scene, and leaves nothing behind."""
    yield from session.press("accelscope.end_lesson(", across=END)
    yield lambda: bpy.context.window.scene.name == "Scene"
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]
    assert [mesh.name for mesh in bpy.data.meshes] == ["Cube"]
    assert [obj.name for obj in bpy.context.window.scene.objects] == ["Cube", "Light", "Camera"]
    station("back")


session.run()
