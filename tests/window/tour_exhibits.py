"""A tour through the exhibits in a real Blender window; see tour.py for how to run it.

Each exhibit of each builder is shown once: one of its frames, with all of it in view.
"""

from __future__ import annotations

import dataclasses
import sys
import threading
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    HEADER,
    REFIT,
    build,
    changed,
    install,
    note,
    open_panel,
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
    taken,
)
from session import Steps

NUMBER = 0.48
"""Where the number of the frame is, as a share of the sidebar's width; its slider is behind it."""

PREVIOUS, NEXT = 0.82, 0.88
"""Where the buttons behind the frame are, as shares of the sidebar's width."""


SECOND = 47
"""How far the second line of an open list is below its button, in pixels."""


def group() -> Any:
    """Return what the panel of exhibits shows."""
    return settings().exhibits


def items(group: Any, name: str) -> list[str]:
    """Return the identifiers of a choice."""
    return [item.identifier for item in group.bl_rna.properties[name].enum_items]


def drawn() -> bool:
    """Say whether the frame that the panel asks for is drawn."""
    showcase = results().showcase
    return running() is None and showcase.shown == showcase.wanted(group())


def seen(name: str) -> Steps:
    """Wait until the frame that the panel asks for is drawn, and take a screenshot."""
    yield drawn
    over_viewport()
    yield 0.5
    station(name)


def in_view() -> None:
    """Assert that all that is drawn is where nothing covers the viewport."""
    overlay, region = part("addon.drawing.overlay"), session.region()
    view = session.area().spaces[0].region_3d
    points = overlay.points_of((overlay.EXHIBIT, overlay.PLANE))
    places = np.array([location_3d_to_region_2d(region, view, point) for point in points])
    places += [region.x, region.y]
    low, high = places.min(axis=0), places.max(axis=0)
    toolbar, sidebar = session.region("TOOLS"), session.region("UI")
    top = min(session.region(name).y for name in ("HEADER", "TOOL_HEADER"))
    assert toolbar.x + toolbar.width < low[0], (low, high)
    assert high[0] < sidebar.x, (low, high)
    assert region.y < low[1], (low, high)
    assert high[1] < top, (low, high)


@session.step
def install_zip() -> None:
    """The zip installs into a Blender nobody has used before."""
    install()


@session.step
def open_tab() -> Steps:
    """The panel of exhibits is there, and is closed."""
    yield from open_wide_tab()
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    sample("suzanne")
    yield from build()
    over_viewport()
    yield 0.5
    station("built")


@session.step
def show() -> Steps:
    """The check box in the header shows the first exhibit, and hides the cells."""
    yield from open_panel("exhibits.show")
    yield from session.press("exhibits.show", across=HEADER)
    assert group().show
    yield from session.find("accelscope.view_exhibit(")
    yield from seen("levels-0")
    assert results().showcase.shown == ("levels", 0)
    assert changed(taken["built"], taken["levels-0"]) > 2000


@session.step
def step_frames() -> Steps:
    """The buttons step through the frames, the field takes a number and can be dragged."""
    x, y = yield from session.find("step_frame(by=1)", across=NEXT)
    session.click(x, y)
    yield 0.3
    assert group().frame == 1
    session.click(x, y)
    yield 0.3
    yield from session.press("step_frame(by=-1)", across=PREVIOUS)
    assert group().frame == 1
    yield from session.enter("exhibits.frame", "4", across=NUMBER)
    assert group().frame == 4
    yield from seen("levels-4")
    assert changed(taken["levels-0"], taken["levels-4"]) > 2000
    x, y = yield from session.find("exhibits.frame", across=NUMBER)
    yield from session.drag((x, y), (x + 60, y))
    assert group().frame > 4
    yield from seen("levels-dragged")


@session.step
def with_cells() -> Steps:
    """The cells can stay."""
    yield from session.press("exhibits.alone")
    assert not group().alone
    yield from seen("with-cells")
    group().alone = True


@session.step
def slow_frame() -> Steps:
    """A long frame is a job: the one before stays, Esc stops it, a button tries again."""
    showcase = results().showcase
    levels = showcase.exhibits[0]

    made, computed = [], threading.Event()

    def frame(number: int, progress: Any) -> Any:
        computed.wait(120.0)
        made.append(number)
        return levels.frame(number, progress)

    showcase.exhibits = [
        dataclasses.replace(levels, name="slow", label="Slow", frame=frame), *showcase.exhibits[1:]
    ]  # fmt: skip
    before = showcase.shown
    group().frame = 2
    # Nobody has waited for it.
    assert not made
    yield running
    assert showcase.shown == before
    station("slow-frame")
    over_viewport()
    pressed = time.monotonic()
    session.key("Escape")
    yield lambda: running() is None
    note("escape_seconds", round(time.monotonic() - pressed, 2))
    assert not made
    yield 0.5
    station("slow-frame-stopped")
    computed.set()
    yield lambda: made == [2]
    computed.clear()
    assert showcase.shown == before
    yield from session.press("accelscope.show_frame(")
    yield running
    computed.set()
    yield from seen("slow-frame-made")
    assert showcase.shown == ("slow", 2)
    group().chosen = ""


def slowed(exhibit: Any) -> Any:
    """Return an exhibit whose frames take a second more."""

    def frame(number: int, progress: Any) -> Any:
        time.sleep(1.0)
        return exhibit.frame(number, progress)

    return dataclasses.replace(exhibit, frame=frame)


@session.step
def choose() -> Steps:
    """The list of exhibits drops down, and another one is chosen."""
    bpy.ops.accelscope.build()
    yield drawn
    before = group().exhibit
    # A frame that takes its time becomes a job: not in the middle of what the list does.
    exhibits = results().showcase.exhibits
    exhibits[1] = slowed(exhibits[1])
    x, y = yield from session.find("exhibits.exhibit")
    session.click(x, y)
    yield 2.0
    station("list")
    session.move(x, y - SECOND)
    yield 0.5
    session.click(x, y - SECOND)
    yield lambda: group().exhibit != before
    yield from seen("chosen")


@session.step
def every_exhibit() -> Steps:
    """Each exhibit of each builder and optimiser, once, all of it in view."""
    known: set[str] = set()
    bvh = settings().structures.bvh
    for setting in ("builder", "optimise"):
        for choice in items(bvh, setting):
            setattr(bvh, setting, choice)
            # Not by the button: the panel of exhibits is to stay in sight.
            bpy.ops.accelscope.build()
            for exhibit in results().showcase.exhibits:
                if exhibit.name in known:
                    continue
                known.add(exhibit.name)
                started = time.monotonic()
                group().exhibit = exhibit.name
                for number in exhibit.on_page[1:2] or [exhibit.count // 2]:
                    group().frame = number
                    yield drawn
                    bpy.ops.accelscope.view_exhibit()
                    yield from seen(f"{choice}-{exhibit.name}-{number}")
                    in_view()
                note(f"seconds {exhibit.name}", round(time.monotonic() - started, 2))
        bvh.property_unset(setting)
    group().show = False


@session.step
def split_plane() -> Steps:
    """The slide "SAH decision": the plane follows the slider, and the figures follow the plane."""
    sample("sah_example")
    bpy.ops.accelscope.build()
    group = settings().split_plane
    settings().display.show = False
    yield from open_panel("split_plane.show")
    yield from session.press("split_plane.show", across=HEADER)
    assert group.show
    x, y = yield from session.find("split_plane.position")
    yield from session.drag((x, y), (x + 40, y))
    assert group.position > 0.5
    over_viewport()
    yield 0.5
    station("split-plane-dragged")
    group.position = 71 / 81 + 1e-5
    yield 0.5
    station("split-plane-III")
    assert dict(results().split_view.rows)["N_L"] == "12"
    assert changed(taken["split-plane-dragged"], taken["split-plane-III"]) > 500
    group.show = False
    settings().display.show = True
    sample("suzanne")


@session.step
def timeline() -> Steps:
    """A head that is stretched over five frames: refitted by a click, compared by another."""
    scene, head = bpy.context.scene, bpy.context.view_layer.objects.active
    head.shape_key_add(name="Basis")
    stretched = head.shape_key_add(name="Stretched")
    for vertex, point in zip(head.data.vertices, stretched.data, strict=True):
        # The left half to the left, and the more the farther it is.
        point.co.x = vertex.co.x * (4.0 if vertex.co.x > 0.0 else 1.0)
    scene.frame_start, scene.frame_end = 1, 5
    for frame, value in ((1, 0.0), (5, 1.0)):
        stretched.value = value
        stretched.keyframe_insert("value", frame=frame)
    scene.frame_set(1)
    yield from build()
    before = results().built
    scene.frame_set(5)
    yield from session.press("accelscope.refit(", across=REFIT)
    yield lambda: running() is None and results().built is not before
    roots = [built.structure.cells().boxes[0] for built in (before, results().built)]
    assert roots[1][3] > 3.9 * roots[0][3]
    over_viewport()
    yield 0.5
    station("refitted")
    scene.frame_set(1)
    yield from session.press("accelscope.compare_over_timeline(")
    yield lambda: running() is None and len(results().timeline) > 0
    assert scene.frame_current == 1
    group().show, group().exhibit, group().frame = True, "refit_over_timeline", 4
    yield drawn
    bpy.ops.accelscope.view_exhibit()
    yield from seen("compared-over-timeline")
    in_view()
    group().show = False
    scene.frame_end = 250
    sample("suzanne")


@session.step
def every_volume() -> Steps:
    """One level of volumes that are no boxes along the axes; of k-DOPs the closest."""
    bvh = settings().structures.bvh
    display = settings().display
    display.depth_min = display.depth_max = 3
    for volume in ("sphere", "smallest_sphere", "obb", "kdop26"):
        bvh.volume = volume
        bpy.ops.accelscope.build()
        over_viewport()
        yield 0.5
        station(f"volume-{volume}")
    bvh.property_unset("volume")
    reset(display, "depth_min")
    reset(display, "depth_max")


session.run()
