"""README's five minutes, word by word, in a factory Blender: default cube, default settings.

Run like tour.py. The docstring of a step is what the README says there, which
tests/test_readme.py compares.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    CHECK_BOX,
    HEADER,
    REFIT,
    build,
    changed,
    coloured,
    install,
    open_panel,
    open_wide_tab,
    over_viewport,
    results,
    running,
    session,
    settings,
    station,
    status,
    taken,
    trace,
)
from session import Steps

SLIDER = 0.78
"""Where the slider behind a number is, as a share of the sidebar's width."""


def add_sample(name: str) -> None:
    """Choose a sample in the list of the button, as a click on its line does."""
    bpy.ops.accelscope.add_sample_scene("EXEC_DEFAULT", True, sample=name)


def seen(name: str) -> Steps:
    """Take the pointer away and a picture."""
    over_viewport()
    yield 0.5
    station(name)


@session.step
def install_zip() -> None:
    """Install from Disk"""
    install()
    assert [obj.name for obj in bpy.data.objects if obj.type == "MESH"] == ["Cube"]


@session.step
def open_tab() -> Steps:
    """and open the tab **AccelScope**."""
    yield from open_wide_tab()


@session.step
def sample() -> Steps:
    """*Add Sample Scene*, choose Suzanne: other meshes are hidden (*Alt H* brings them back)."""
    add_sample("suzanne")
    assert bpy.data.objects["Cube"].hide_get()
    yield from seen("sample")
    over_viewport()
    session.key("alt+h")
    yield lambda: not bpy.data.objects["Cube"].hide_get()
    session.key("ctrl+z")
    yield lambda: bpy.data.objects["Cube"].hide_get()
    bpy.ops.object.select_all(action="DESELECT")


@session.step
def first_build() -> Steps:
    """Choose *BVH* and press **Build**. The cells appear over the mesh, coloured by depth."""
    assert settings().structure == "bvh"
    yield from build()
    yield from seen("built")
    assert results().built.structure.scene.object_names == ("suzanne",)
    yield lambda: status() == "Up to date"
    assert coloured(taken["built"]) > coloured(taken["sample"]) + 2000


@session.step
def levels() -> Steps:
    """*Display*: drag the slider behind *Max* to see level after level, or show leaves only."""
    deepest = int(results().cells.depth.max())
    display = settings().display
    assert display.depth_max == deepest
    x, y = yield from session.find("display.depth_max_share", across=SLIDER)
    sidebar = session.region("UI")
    yield from session.drag((x, y), (x - 0.12 * sidebar.width, y))
    yield lambda: 0 < display.depth_max < deepest
    yield from session.drag((x, y), (x - 0.6 * sidebar.width, y))
    yield lambda: display.depth_max == 0
    yield from seen("level-0")
    assert changed(taken["built"], taken["level-0"]) > 1000
    yield from session.drag((x, y), (x + 0.6 * sidebar.width, y))
    yield lambda: display.depth_max == deepest
    yield from session.press("display.leaves_only")
    yield lambda: display.leaves_only
    yield from seen("leaves-only")
    yield from session.press("display.leaves_only")


@session.step
def rays() -> Steps:
    """*Rays*: choose *Camera* or *Random Lines* and press **Trace**. *Statistics* now shows"""
    for workload in ("camera", "random_lines"):
        settings().workload = workload
        yield from trace()
        assert results().record["trace"]["N_IT"] > 0.0


@session.step
def step_ray() -> Steps:
    """*Step Ray* shows one of those rays: the cells it visits, in order, and where it hits;"""
    hit = int(np.flatnonzero(results().traced.hits.primitive >= 0)[0])
    yield from session.enter("ray_index", str(hit))
    yield from session.press("accelscope.step_ray(")
    yield from seen("stepped")


@session.step
def events() -> Steps:
    """*Event* goes through its walk one event at a time."""
    yield from session.press("step_events", across=CHECK_BOX)
    last = len(results().steps) - 1
    x, y = yield from session.find("event_share", across=SLIDER)
    sidebar = session.region("UI")
    yield from session.drag((x, y), (x + 0.6 * sidebar.width, y))
    yield lambda: settings().event == last
    yield from session.enter("event", "9999")
    yield lambda: settings().event == last
    yield from session.enter("event", "2")
    yield lambda: settings().event == 2
    yield from seen("event")
    settings().step_events = False


@session.step
def exhibits() -> Steps:
    """*Exhibits* shows what the structure has to tell, frame by frame:"""
    yield from open_panel("exhibits.show")
    yield from session.press("exhibits.show", across=HEADER)
    group, showcase = settings().exhibits, results().showcase
    group.frame = 10_000
    assert group.frame == showcase.chosen(group).count - 1
    group.frame = 5
    yield lambda: running() is None and showcase.shown == showcase.wanted(group)
    yield from seen("exhibit")
    yield from session.press("exhibits.show", across=HEADER)
    yield from open_panel("exhibits.show")


@session.step
def split_plane() -> Steps:
    """*Split Plane* is the lecture's slide with a slider:"""
    add_sample("sah_example")
    yield from build()
    yield from open_panel("split_plane.show")
    yield from session.press("split_plane.show", across=HEADER)
    yield lambda: running() is None and results().split_view.rows
    figures = dict(results().split_view.rows)
    assert int(figures["N_L"]) + int(figures["N_R"]) == 76
    yield from seen("split-plane")
    yield from session.press("split_plane.show", across=HEADER)
    yield from open_panel("split_plane.show")


@session.step
def refit() -> Steps:
    """*Refit* lets a BVH follow a mesh that was deformed;"""
    add_sample("suzanne")
    yield from build()
    before = results().built
    head = bpy.context.view_layer.objects.active
    head.scale = 1.0, 1.0, 1.5
    yield lambda: status().startswith("Out of date")
    yield from session.press("accelscope.refit(", across=REFIT)
    yield lambda: running() is None and results().built is not before
    yield lambda: status() == "Up to date"


@session.step
def kd_tree() -> Steps:
    """Choose *kd-Tree*: the status says what is out of date. **Build** again and compare."""
    settings().structure = "kdtree"
    yield lambda: status().startswith("Out of date")
    yield from build()


@session.step
def planes_and_replay() -> Steps:
    """*Tint Empty* the empty leaves, *Replay* the building step by step; *Show Links*"""
    display = settings().display
    display.depth_max = 4
    yield from session.press("display.planes")
    yield from session.press("display.tint_empty")
    yield lambda: display.planes and display.tint_empty
    yield from seen("planes-and-empty")
    display.planes = display.tint_empty = False
    display.depth_max = 1000
    yield from session.press("display.replay", across=CHECK_BOX)
    x, y = yield from session.find("display.step_share", across=SLIDER)
    sidebar = session.region("UI")
    yield from session.drag((x, y), (x + 0.6 * sidebar.width, y))
    yield lambda: display.step == int(results().cells.extra["order"].max())
    yield from session.drag((x, y), (x - 0.1 * sidebar.width, y))
    yield from seen("replay")
    display.replay = False
    yield from session.press("accelscope.show_links(")
    yield lambda: results().linked_leaf >= 0
    yield from seen("links")


@session.step
def bake() -> Steps:
    """*Bake to Meshes* makes objects of the cells,"""
    yield from session.press("accelscope.bake(")
    yield lambda: "AccelScope" in bpy.data.collections
    assert len(bpy.data.collections["AccelScope"].objects) == 1


session.run()
