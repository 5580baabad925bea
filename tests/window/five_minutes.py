"""README's five minutes, word by word, in a factory Blender: default cube, default settings.

Run like tour.py. The docstrings of the steps are what the README says there, all of it, which
tests/test_readme.py compares. What *Export* writes is left in the output directory, and
test_window.py holds its figures against those of the same triangles outside Blender.
"""

from __future__ import annotations

import csv
import json
import shutil
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    REFIT,
    build,
    changed,
    coloured,
    install,
    open_wide_tab,
    over_viewport,
    part,
    results,
    running,
    session,
    settings,
    station,
    status,
    taken,
    trace,
)
from session import Steps, Wait

SLIDER = 0.78
"""Where the slider behind a number is, as a share of the sidebar's width."""
ALONE = 0.7
"""Where a field is that has its line for itself."""
NEXT, END = 0.86, 0.25
"""Where the arrow to the next lesson is, and the button that ends one."""
EXPORT = {"JSON": 0.3, "CSV": 0.75}
"""Where the two buttons for export are, side by side, as a share of that width."""

# The lecture's planes, as shares of the example's width, a little to the right, since the sample
# in Blender has single precision; and what the slides print of them.
PLANES = {
    "9/81+1e-5": {"N_L": "8", "N_R": "68", "p_L": "0.28", "p_R": "0.91"},
    "33/81+1e-5": {"N_L": "12", "N_R": "64", "p_L": "0.52", "p_R": "0.67"},
    "71/81+1e-5": {"N_L": "12", "N_R": "64", "p_L": "0.90", "p_R": "0.29"},
}
COSTS = {"9/81+1e-5": 67.1, "33/81+1e-5": 52.1, "71/81+1e-5": 32.4}


def add_sample(name: str) -> None:
    """Choose a sample in the list of the button, as a click on its line does."""
    bpy.ops.accelscope.add_sample_scene("EXEC_DEFAULT", True, sample=name)


def lesson() -> Any:
    """Return what is shown of a lesson."""
    return part("addon.results.lesson_view").current


def taught(name: str) -> bool:
    """Say whether a lesson is shown, and nothing is on its way."""
    return running() is None and lesson().lesson is not None and lesson().lesson.name == name


def figures() -> dict[str, str]:
    """Return the figures of the lesson."""
    return {row.label: row.text for row in lesson().picture.rows}


def figures_of_plane(share: str) -> Generator[Wait, None, dict[str, str]]:
    """Type where the split plane is, and return what the panel says of it."""
    before = figures()
    yield from session.enter("split_plane.position", share, across=ALONE)
    yield lambda: figures() != before
    return figures()


def export(kind: str) -> Generator[Wait, None, Path]:
    """Press a button for export, and Return in the window for files; return what was written."""
    yield from session.press(f"accelscope.export(format='{kind}')", across=EXPORT[kind])
    yield lambda: any(area.type == "FILE_BROWSER" for area in session.window.screen.areas)
    yield 1.0
    browser = session.area("FILE_BROWSER")
    parameters = browser.spaces[0].params
    assert parameters.filename == f"Scene-kdtree.{kind.lower()}"
    path = Path(parameters.directory.decode()) / parameters.filename
    assert not path.exists()
    session.move(browser.x + 0.6 * browser.width, browser.y + 0.5 * browser.height)
    yield 0.5
    session.key("Return")
    yield path.exists
    yield lambda: all(area.type != "FILE_BROWSER" for area in session.window.screen.areas)
    return path


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
    """Press *N* in the 3D viewport and open the tab **AccelScope**."""
    view = session.area().spaces[0]
    assert not view.show_region_ui
    over_viewport()
    yield 0.5
    session.key("n")
    yield lambda: view.show_region_ui
    yield from open_wide_tab()


@session.step
def lessons() -> Steps:
    """*Lessons* lists what the lecture shows, in its order. **Teach** puts a lesson into the
    viewport, in a scene of its own; *Play* goes through it, the arrows beside the list go to the
    next one. *End Lesson* goes back to your scene.
    """
    names = list(part("core.lessons").lessons())
    assert settings().teaching.lesson == names[0]
    settings().teaching.lesson = names[6]
    yield from session.press("accelscope.teach(")
    yield lambda: taught(names[6])
    assert bpy.context.window.scene.name == "AccelScope Lesson"
    first = lesson().picture.caption
    yield from session.press("accelscope.play_film(")
    yield lambda: lesson().picture.caption != first
    yield from seen("lesson")
    yield from session.press("accelscope.step_lesson(", across=NEXT)
    yield lambda: taught(names[7])
    yield from seen("next-lesson")
    yield from session.press("accelscope.end_lesson(", across=END)
    yield lambda: bpy.context.window.scene.name == "Scene"
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]
    assert not bpy.data.objects["Cube"].hide_get()


@session.step
def sample() -> Steps:
    """*Add Sample Scene*, choose Suzanne: other meshes are hidden (*Alt H* brings them back). Or
    use meshes of your own.
    """
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
    before = results().built
    yield from session.press("accelscope.build(")
    yield lambda: running() is None and results().built is not before
    yield from seen("built")
    structure = results().built.structure
    assert structure.scene.object_names == ("suzanne",)
    assert structure.validate() == []
    figures = results().record["statistics"]
    assert figures["N_OIV"] == len(structure.scene) == results().record["scene"]["triangles"]
    # Of a binary tree.
    assert figures["N_V"] == figures["N_IN"] + 1 == int(results().cells.is_leaf.sum())
    yield lambda: status() == "Up to date"
    assert coloured(taken["built"]) > coloured(taken["sample"]) + 2000


@session.step
def cancel() -> Steps:
    """*Esc* cancels, and what was there before stays."""
    before = results().built, results().cells, results().record
    # What has not been compiled yet takes longer than a key.
    settings().structure = "kdtree"
    yield from session.press("accelscope.build(")
    yield lambda: running()
    job = running()
    session.key("Escape")
    yield lambda: running() is None
    assert job.is_cancelled
    yield lambda: job.is_finished
    assert (results().built, results().cells, results().record) == before
    settings().structure = "bvh"
    yield lambda: status() == "Up to date"


@session.step
def levels() -> Steps:
    """*Display*: drag the slider behind *Max* to see level after level, or show leaves only."""
    deepest = int(results().cells.depth.max())
    display = settings().display
    assert 0 < display.depth_max < deepest
    x, y = yield from session.find("display.depth_max_share", across=SLIDER)
    sidebar = session.region("UI")
    yield from session.drag((x, y), (x + 0.6 * sidebar.width, y))
    yield lambda: display.depth_max == deepest
    yield from seen("all-levels")
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
    """*Rays*: choose *Camera* or *Random Lines* and press **Trace**. *Statistics* now shows what a
    ray costs on average: steps (N_TS), leaves (N_ETS), triangle tests (N_IT).
    """
    for workload in ("camera", "random_lines"):
        settings().workload = workload
        yield from trace()
        found = results().record["trace"]
        assert 0 < found["hits"] <= results().record["rays"]["count"] == len(results().traced.rays)
        assert 0.0 < found["N_ETS"] < found["N_TS"]
        assert 0.0 < found["N_IT"] < 0.01 * len(results().built.structure.scene)
    # A line that ends at its hit visits no more than one that goes on.
    figures = results().record["statistics"]
    assert found["N_TS"] < figures["expected_inner"] + figures["expected_leaves"]
    assert found["N_ETS"] < figures["expected_leaves"]
    assert found["N_IT"] < figures["expected_tests"]


@session.step
def step_ray() -> Steps:
    """*Step Ray* shows one of those rays: the cells it visits, in order, and where it hits;"""
    traced = results().traced
    hit = int(np.flatnonzero(traced.hits.primitive >= 0)[0])
    yield from session.press("accelscope.step_ray(")
    yield lambda: taught("ray")
    yield from session.enter("lessons.ray.ray", str(hit))
    yield lambda: running() is None and lesson().settings.ray == hit
    tally = lesson().play.walk.steps.tally()
    assert tally == {name: int(traced.counters[name][hit]) for name in tally}
    assert tally["N_TS"] > 0
    yield from seen("stepped")


@session.step
def events() -> Steps:
    """*Event* goes through its walk one event at a time."""
    knobs, last = settings().lessons.ray, lesson().play.ends["event"]
    x, y = yield from session.find("event_share", across=SLIDER)
    sidebar = session.region("UI")
    yield from session.drag((x, y), (x + 0.6 * sidebar.width, y))
    yield lambda: knobs.event == last
    yield from session.enter("lessons.ray.event", "9999")
    yield lambda: knobs.event == last
    yield from session.enter("lessons.ray.event", "2")
    yield lambda: knobs.event == 2
    yield from seen("event")


@session.step
def end_lesson() -> Steps:
    """*End Lesson* brings all cells back."""
    yield from session.press("accelscope.end_lesson(", across=ALONE)
    yield lambda: lesson().lesson is None
    yield from seen("ended")
    # As before the lesson, which had hidden them and turned the view.
    assert changed(taken["event"], taken["ended"]) > 1000
    assert changed(taken["all-levels"], taken["ended"]) == 0


@session.step
def use_my_mesh() -> Steps:
    """*Use My Mesh* teaches a lesson about what you have built. *A Split Plane under a Slider* is
    the lecture's slide: N_L, N_R, p_L, p_R and Cost of any plane; its example is the sample
    *SAH Worked Example*.
    """
    add_sample("sah_example")
    yield from build()
    settings().teaching.lesson = "split_plane"
    yield from session.press("accelscope.use_my_mesh(")
    yield lambda: taught("split_plane")
    assert bpy.context.window.scene.name == "Scene"
    for share, printed in PLANES.items():
        found = yield from figures_of_plane(share)
        assert {name: found[name] for name in printed} == printed, (share, found)
        assert float(found["Cost(V -> {L, R})"]) == COSTS[share], (share, found)
        assert found["Cost(V)"] == "76.0"
    yield from seen("split-plane")
    x, y = yield from session.find("split_plane.position", across=ALONE)
    yield from session.drag((x, y), (x - 40, y))
    yield lambda: 0.0 < settings().lessons.split_plane.position < 71 / 81
    assert int(figures()["N_L"]) + int(figures()["N_R"]) == 76
    yield from session.press("accelscope.end_lesson(", across=ALONE)
    yield lambda: lesson().lesson is None


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
    assert results().record["method"] == "refit"
    old, new = before.structure.scene, results().built.structure.scene
    np.testing.assert_allclose(new.triangles, old.triangles * [1.0, 1.0, 1.5], atol=1e-6)
    yield lambda: status() == "Up to date"
    head.scale = 1.0, 1.0, 1.0


@session.step
def compare_over_timeline() -> Steps:
    """*Compare over Timeline* shows how much that costs."""
    scene = bpy.context.scene
    head = bpy.context.view_layer.objects.active
    for frame, height in ((1, 1.0), (4, 4.0)):
        head.scale.z = height
        head.keyframe_insert("scale", frame=frame)
    scene.frame_end = 4
    scene.frame_set(1)
    yield from session.press("accelscope.compare_over_timeline(")
    yield lambda: running() is None and results().timeline
    found = [(each["frame"], each["method"]) for each in results().timeline]
    assert found == [(frame, how) for frame in range(1, 5) for how in ("refit", "rebuild")]
    costs = [each["statistics"]["sah"] for each in results().timeline]
    refitted, rebuilt = costs[::2], costs[1::2]
    assert refitted[0] == rebuilt[0]
    assert refitted[-1] > rebuilt[-1]
    assert [moment.frame for moment in results().history] == [1, 2, 3, 4]
    yield lambda: status() == "Up to date"
    head.animation_data_clear()
    head.scale = 1.0, 1.0, 1.0


@session.step
def kd_tree() -> Steps:
    """Choose *kd-Tree*: the status says what is out of date. **Build** again and compare."""
    settings().structure = "kdtree"
    yield lambda: status().startswith("Out of date")
    yield from build()
    assert results().record["structure"]["name"] == "kdtree"
    assert results().built.structure.validate() == []


@session.step
def planes_and_steps() -> Steps:
    """Now *Planes* shows what cuts the cells, *Tint Empty* the empty leaves; *Use My Mesh* with
    the lesson *A Build, Step by Step* goes through the building.
    """
    display = settings().display
    display.depth_max = 4
    yield from session.press("display.planes")
    yield from session.press("display.tint_empty")
    yield lambda: display.planes and display.tint_empty
    yield from seen("planes-and-empty")
    display.planes = display.tint_empty = False
    display.depth_max = 1000
    settings().teaching.lesson = "replay"
    yield from session.press("accelscope.use_my_mesh(")
    yield lambda: taught("replay")
    assert lesson().subject.structures[0] is results().built.structure
    x, y = yield from session.find("replay.step_share", across=SLIDER)
    sidebar = session.region("UI")
    yield from session.drag((x, y), (x + 0.6 * sidebar.width, y))
    knobs = settings().lessons.replay
    yield lambda: knobs.step == int(results().cells.extra["order"].max())
    yield from session.drag((x, y), (x - 0.1 * sidebar.width, y))
    yield from seen("replay")
    yield from session.press("accelscope.end_lesson(", across=ALONE)
    yield lambda: lesson().lesson is None


@session.step
def bake() -> Steps:
    """*Bake to Meshes* makes objects of the cells,"""
    yield from session.press("accelscope.bake(")
    yield lambda: "AccelScope" in bpy.data.collections
    (baked,) = bpy.data.collections["AccelScope"].objects
    numbers = np.empty(len(baked.data.vertices), np.int32)
    baked.data.attributes["number"].data.foreach_get("value", numbers)
    shown = part("addon.drawing.selection").visible(results().cells, settings().display)
    assert set(numbers) == set(results().cells.numbers[shown])


@session.step
def write() -> Steps:
    """*Export* writes JSON or CSV."""
    # In this window: another one would come without a window manager to give it the keys.
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    for kind in ("JSON", "CSV"):
        path = yield from export(kind)
        shutil.copy(path, session.output / f"exported.{kind.lower()}")
    (record,) = json.loads((session.output / "exported.json").read_text())["records"]
    assert record == json.loads(json.dumps(results().record))
    with (session.output / "exported.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert float(row["statistics.sah"]) == record["statistics"]["sah"]


session.run()
