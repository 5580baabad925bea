"""A tour through the extension in a real Blender window, by real clicks and keys where it counts.

    .venv/bin/python .ci/build_extension.py --platform linux-x64 --output build/window/extension
    .ci/blender_window.sh tests/window/tour.py build/window/tour [-- ZIP]

ZIP is the full one for Linux, by default the one that the first command makes. Of each station a
numbered screenshot is left in the output directory; what was measured is in figures.json there.
The picture of the README is made by the station `readme_picture`: to renew it,

    cp build/window/tour/accelscope_window.png tests/window/
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    HEADER,
    MODULE,
    build,
    changed,
    coloured,
    enable,
    install,
    note,
    open_wide_tab,
    over_viewport,
    part,
    reset,
    results,
    running,
    sample,
    session,
    settings,
    station,
    status,
    taken,
    trace,
)
from session import Steps

# ------------------------------------------------------------------------- arriving and building


@session.step
def install_zip() -> None:
    """The zip installs into a Blender nobody has used before."""
    install()


@session.step
def open_tab() -> Steps:
    """The tab is there."""
    yield from open_wide_tab()
    station("tab")
    assert status() == "Nothing has been built yet"


@session.step
def no_mesh() -> Steps:
    """Without a mesh Build is grey, and says why to who waits with the pointer over it."""
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    yield from session.find("accelscope.build(")
    assert not bpy.ops.accelscope.build.poll()
    yield 2.0
    station("no-mesh")


@session.step
def add_sample_scene() -> Steps:
    """A sample scene appears."""
    sample("suzanne")
    over_viewport()
    yield 1.0
    station("sample")


@session.step
def first_build() -> Steps:
    """The first build compiles, saying so, and shows the cells."""
    started = time.monotonic()
    yield from session.press("accelscope.build(")
    yield running
    yield lambda: running() is None or running().text.startswith("Compiling")
    station("compiling")
    yield lambda: running() is None and results().built
    note("first_build_seconds", round(time.monotonic() - started, 2))
    yield 1.0
    over_viewport()
    yield
    station("built")
    assert part("core.kernels").has_numba()
    yield lambda: status() == "Up to date"
    note("coloured_pixels", [coloured(taken["sample"]), coloured(taken["built"])])
    assert coloured(taken["built"]) > coloured(taken["sample"]) + 2000


# -------------------------------------------------------------------------------------- display


@session.step
def depth_range() -> Steps:
    """Typing a depth range shows fewer cells and uploads nothing."""
    overlay = part("addon.drawing.overlay")
    uploads = overlay.uploads()
    yield from session.enter("display.depth_max", "3")
    yield lambda: settings().display.depth_max == 3
    station("depth-0-to-3")
    assert changed(taken["built"], taken["depth-0-to-3"]) > 1000
    yield from session.enter("display.depth_min", "3")
    yield lambda: settings().display.depth_min == 3
    station("depth-3")
    x, y = yield from session.find("display.depth_max", across=0.55)
    yield from session.drag((x, y), (x + 60, y))
    yield lambda: settings().display.depth_max > 3
    station("depth-slid")
    assert overlay.uploads() == uploads


@session.step
def leaves_and_empty() -> Steps:
    """The two check boxes."""
    display = settings().display
    display.depth_min, display.depth_max = 0, 100
    yield from session.press("display.leaves_only")
    yield lambda: display.leaves_only
    station("leaves-only")
    yield from session.press("display.hide_empty")
    yield lambda: not display.hide_empty
    yield from session.press("display.hide_empty")
    yield from session.press("display.leaves_only")


@session.step
def lines() -> Steps:
    """Opacity and line width."""
    display = settings().display
    yield from session.enter("display.opacity", "1")
    yield from session.enter("display.line_width", "3")
    display.depth_max = 8
    yield 0.5
    station("opaque-wide")
    display.colour_by = "count"
    display.leaves_only = True
    display.depth_max = 100
    yield 0.5
    station("by-count")
    for name in ("opacity", "line_width", "colour_by", "leaves_only"):
        reset(display, name)


@session.step
def planes_and_empty_leaves() -> Steps:
    """A kd-tree: its planes, its empty leaves, and the steps of its building."""
    overlay = part("addon.drawing.overlay")
    settings().structure = "kdtree"
    yield from build()
    display = settings().display
    display.depth_max = 4
    yield from session.press("display.planes")
    yield lambda: display.planes
    over_viewport()
    yield 0.5
    station("planes")
    display.planes = False
    display.depth_max = 100
    display.leaves_only = True
    yield from session.press("display.tint_empty")
    yield lambda: display.tint_empty
    over_viewport()
    yield 0.5
    station("tinted")
    display.tint_empty = False
    uploads = overlay.uploads()
    display.colour_by = "order"
    yield 0.5
    station("by-order")
    assert overlay.uploads() == uploads
    for name in ("depth_max", "planes", "tint_empty", "colour_by", "leaves_only"):
        reset(display, name)
    settings().structure = "bvh"
    yield from build()


@session.step
def hierarchies_in_steps() -> Steps:
    """Hierarchies: planes, and the steps of the building, from above and from below."""
    display = settings().display
    for builder, has_planes in (("lbvh", True), ("ploc", False), ("binned_sah", True)):
        settings().structures.bvh.builder = builder
        yield from build()
        assert (results().cells.planes is not None) == has_planes
        if has_planes:
            display.depth_max, display.planes = 4, True
            yield 0.5
            station(f"{builder}-planes")
            display.depth_max, display.planes = 100, False
        display.leaves_only = has_planes  # from below, leaves are all blue
        display.colour_by = "order"
        yield 0.5
        station(f"{builder}-by-order")
        for name in ("depth_max", "planes", "colour_by", "leaves_only"):
            reset(display, name)
    reset(settings().structures.bvh, "builder")


@session.step
def show() -> Steps:
    """The check box in the header hides all cells: the picture is the one before the build."""
    yield from session.press("display.show", across=HEADER)
    over_viewport()
    yield 0.5
    station("hidden")
    assert changed(taken["sample"], taken["hidden"]) == 0
    yield from session.press("display.show", across=HEADER)


# ----------------------------------------------------------------------------------------- rays


@session.step
def trace_camera() -> Steps:
    """Camera rays, and their figures."""
    yield from trace()
    yield 1.0
    station("camera-traced")
    assert results().record["trace"]["hits"] > 0
    note("camera_rays_per_second", round(results().record["trace"]["rays_per_second"]))


@session.step
def trace_random_lines() -> Steps:
    """Random lines, chosen in the menu."""
    settings().workload = "random_lines"
    yield 0.5
    yield from trace()
    yield 1.0
    station("random-lines-traced")
    assert results().traced.workload.name == "random_lines"


def lesson() -> Any:
    """Return what is shown of a lesson."""
    return part("addon.results.lesson_view").current


def shown(knob: str, value: float) -> bool:
    """Say whether the lesson on the ray is shown with a knob at some value."""
    found = lesson().settings
    return running() is None and found is not None and getattr(found, knob, None) == value


@session.step
def step_ray() -> Steps:
    """One ray is stepped, and its path is seen over the cells."""
    display, knobs = settings().display, settings().lessons.ray
    display.leaves_only, display.opacity = True, 0.1
    hit = int(np.flatnonzero(results().traced.hits.primitive >= 0)[3])
    before = session.screenshot("before-the-ray")
    yield from session.press("accelscope.step_ray(")
    yield lambda: running() is None and lesson().picture is not None
    settings().teaching.hide_cells = False
    yield from session.enter("lessons.ray.ray", str(hit))
    yield lambda: shown("ray", hit)
    knobs.whole = True
    over_viewport()
    yield 0.5
    station("stepped")
    assert changed(before, taken["stepped"]) > 200
    before.unlink()
    miss = int(np.flatnonzero(results().traced.hits.primitive < 0)[3])
    knobs.ray = miss
    yield lambda: shown("ray", miss)
    over_viewport()
    yield 0.5
    station("stepped-miss")


@session.step
def event_by_event() -> Steps:
    """The recorded ray again, event by event."""
    knobs = settings().lessons.ray
    knobs.whole = False
    hit = int(np.flatnonzero(results().traced.hits.primitive >= 0)[3])
    knobs.ray = hit
    yield lambda: shown("ray", hit)
    middle = lesson().play.ends["event"] // 2
    yield from session.enter("lessons.ray.event", str(middle))
    yield lambda: shown("event", middle)
    over_viewport()
    yield 0.5
    station("event")


@session.step
def cone() -> Steps:
    """A cone around the ray, what it meets, and both baked."""
    knobs = settings().lessons.ray
    knobs.whole = True
    knobs.cone = 0.7
    yield lambda: running() is None and lesson().played_with.cone > 0.0
    over_viewport()
    yield 0.5
    station("cone")
    assert "degrees around" in lesson().picture.caption
    yield from session.press("accelscope.bake(")
    name = lesson().lesson.label
    yield lambda: running() is None and name in bpy.data.objects
    for made in [each for each in bpy.data.objects if each.name.endswith((name, "Cells"))]:
        bpy.data.objects.remove(made)
    knobs.cone = 0.0
    yield lambda: running() is None and lesson().played_with.cone == 0.0
    bpy.ops.accelscope.end_lesson()


@session.step
def statistics() -> Steps:
    """The figures, at the end of the tab."""
    yield from session.find("accelscope.export(")
    yield 0.5
    station("statistics")


@session.step
def second_viewport() -> Steps:
    """A second viewport draws the same cells without another upload."""
    overlay = part("addon.drawing.overlay")
    uploads = overlay.uploads()
    known = set(session.window.screen.areas)
    bpy.ops.screen.area_split(direction="VERTICAL", factor=0.45)
    yield 2.0
    station("second-viewport")
    assert overlay.uploads() == uploads
    (added,) = set(session.window.screen.areas) - known
    with bpy.context.temp_override(area=added):
        bpy.ops.screen.area_close()
    yield 1.0


# ------------------------------------------------------------------------- what may go out of date


@session.step
def move_and_undo() -> Steps:
    """Moving the object makes the status say so; undo makes it up to date again."""
    settings().display.property_unset("leaves_only")
    settings().display.property_unset("opacity")
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.ed.undo_push(message="Select")
    over_viewport()
    yield 0.5
    session.key("g", "x", "1", "Return")
    yield lambda: status().startswith("Out of date")
    yield from session.find("accelscope.build(")
    over_viewport()
    yield 1.0
    station("moved")
    note("status_moved", status())
    session.key("ctrl+z")
    yield lambda: status() == "Up to date"
    yield 0.5
    station("moved-back")


@session.step
def delete_and_undo() -> Steps:
    """Deleting the object leaves the cells, and the status says so."""
    over_viewport()
    yield
    session.key("Delete")
    yield lambda: status().startswith("Out of date")
    yield 0.5
    station("deleted")
    note("status_deleted", status())
    session.key("ctrl+z")
    yield lambda: status() == "Up to date"


@session.step
def refused() -> Steps:
    """A grid of 10^12 cells is refused with its memory, and the BVH stays."""
    built = results().built
    settings().structure = "grid"
    yield 0.5
    station("grid-settings")
    settings().structures.grid.resolution = (10_000, 10_000, 10_000)
    yield from session.press("accelscope.build(")
    yield lambda: running() is None
    yield 1.0
    station("refused")
    assert results().built is built
    settings().structures.grid.property_unset("resolution")
    over_viewport()
    session.key("Escape")
    yield


@session.step
def tetra() -> Steps:
    """The other structure over another scene."""
    sample("tetra")
    yield from build()
    over_viewport()
    yield 1.0
    station("tetra-grid")
    settings().structure = "bvh"
    yield from build()
    settings().display.depth_max = 6
    settings().display.line_width = 2.0
    over_viewport()
    yield 1.0
    station("tetra-bvh")
    settings().display.property_unset("line_width")
    reset(settings().display, "depth_max")


@session.step
def readme_picture() -> Steps:
    """The picture of the README: cells over Suzanne, and what they cost."""
    sample("suzanne")
    settings().structures.bvh.max_leaf_size = 4
    settings().workload = "random_lines"
    settings().display.depth_max = 7
    settings().display.line_width = 1.5
    settings().display.opacity = 0.8
    yield from build()
    yield from trace()
    yield from session.find("accelscope.export(")
    over_viewport()
    session.area().spaces[0].show_region_hud = False  # what the last operator could do otherwise
    bpy.context.preferences.system.viewport_aa = "8"
    yield 10.0
    picture = station("readme")
    bpy.context.preferences.system.viewport_aa = "FXAA"
    small = session.output / "accelscope_window.png"
    command = ["convert", str(picture), "-strip", "+dither", "-colors", "200", f"png8:{small}"]
    subprocess.run(command, check=True, timeout=60)
    assert small.stat().st_size < 300_000


@session.step
def disable() -> Steps:
    """Disabling the extension leaves nothing: no cells, no tab, no properties."""
    for name in ("depth_max", "line_width", "opacity"):
        reset(settings().display, name)
    yield from session.press("display.show", across=HEADER)
    over_viewport()
    yield 0.5
    hidden = session.screenshot("without-cells")
    yield from session.press("display.show", across=HEADER)
    over_viewport()
    yield 0.5
    station("before-disabling")
    assert changed(hidden, taken["before-disabling"]) > 2000
    bpy.ops.preferences.addon_disable(module=MODULE)
    yield 1.0
    station("disabled")
    assert changed(hidden, taken["disabled"]) == 0
    hidden.unlink()
    assert not hasattr(bpy.types.Scene, "accelscope")
    assert session.region("UI").active_panel_category != "AccelScope"
    enable()
    yield from open_wide_tab()
    yield from build()
    over_viewport()
    yield 0.5
    station("enabled-again")
    assert changed(taken["before-disabling"], taken["enabled-again"]) == 0


session.run()
