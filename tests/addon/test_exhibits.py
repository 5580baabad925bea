"""Exhibits in the viewport: chosen, drawn frame by frame, made on demand."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest


@pytest.fixture
def group(bpy: Any, root: Any) -> Any:
    """The settings of exhibits, over a monkey with a BVH."""
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.accelscope.build()
    return root.exhibits


@pytest.fixture
def layers(bpy: Any) -> Any:
    from accelscope.addon.drawing import overlay

    return overlay._overlay.layers


def make_exhibit(count: int = 3, made: list[int] | None = None, name: str = "example") -> Any:
    """Return an exhibit whose frame i has i + 1 lines; it notes which frames were made."""
    from accelscope.core.lessons.exhibit import Exhibit, Frame
    from accelscope.core.progress import SILENT, Progress

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        if made is not None:
            made.append(number)
        lines = np.zeros((number + 1, 2, 3))
        lines[:, 1] = number + 1.0
        return Frame(lines, np.ones((number + 1, 4)), f"caption {number}")

    return Exhibit(name, name.title(), "For example", count, frame)


def test_nothing_is_shown_until_asked_for(group: Any, layers: Any, current: Any) -> None:
    assert current.showcase.exhibits[0].name == "levels"
    assert layers == {}
    assert current.showcase.shown is None
    group.show = True
    assert len(layers["exhibit"].segments) == 12
    assert current.showcase.frame_shown.caption.startswith("Level 0 of")
    group.show = False
    assert layers == {}


def test_frames_follow_the_slider_and_the_buttons(
    bpy: Any, group: Any, layers: Any, current: Any
) -> None:
    made: list[int] = []
    current.showcase.exhibits = [make_exhibit(made=made)]
    assert bpy.ops.accelscope.step_frame(by=1) == {"FINISHED"}
    assert (group.show, group.frame, len(layers["exhibit"].segments)) == (True, 1, 2)
    bpy.ops.accelscope.step_frame(by=1)
    bpy.ops.accelscope.step_frame(by=1)
    assert group.frame == 2
    for _ in range(3):
        bpy.ops.accelscope.step_frame(by=-1)
    assert (group.frame, len(layers["exhibit"].segments)) == (0, 1)
    group.frame = 99
    assert current.showcase.shown == ("example", 2)
    bpy.ops.accelscope.step_frame(by=-1)
    assert group.frame == 1
    # Each was made once.
    assert made == [1, 2, 0]


def test_choosing_in_the_list(bpy: Any, group: Any, layers: Any, current: Any) -> None:
    current.showcase.exhibits = [make_exhibit(name=name) for name in ("one", "two", "three")]
    assert group.exhibit == "one"
    group.frame = 2
    group.exhibit = "two"
    assert (group.show, group.chosen, group.frame) == (True, "two", 0)
    assert current.showcase.shown == ("two", 0)
    with pytest.raises(TypeError):
        group.exhibit = "four"


def test_the_choice_outlives_the_structure(
    bpy: Any, group: Any, layers: Any, root: Any, current: Any
) -> None:
    group.exhibit = "levels"
    group.frame = 4
    root.structures.bvh.max_leaf_size = 1
    bpy.ops.accelscope.build()
    assert current.showcase.shown == ("levels", 4)
    assert len(layers["exhibit"].segments) > 12
    root.structure = "naive"
    bpy.ops.accelscope.build()
    assert layers == {}
    assert group.exhibit == ""
    assert not bpy.ops.accelscope.show_frame.poll()
    assert not bpy.ops.accelscope.step_frame.poll()
    root.structure = "bvh"
    bpy.ops.accelscope.build()
    assert current.showcase.shown == ("levels", 4)
    bpy.ops.accelscope.clear()
    assert layers == {}
    assert current.showcase.exhibits == []


def test_cells_are_hidden_while_an_exhibit_is_shown(group: Any, root: Any, layers: Any) -> None:
    from accelscope.addon.drawing import overlay

    assert not overlay._overlay.cells_hidden
    group.show = True
    assert overlay._overlay.cells_hidden
    assert "hidden" in overlay.shown_text(root.display)
    group.alone = False
    assert not overlay._overlay.cells_hidden
    group.alone = True
    group.show = False
    assert not overlay._overlay.cells_hidden


def test_ray_and_exhibit_do_not_push_each_other_out(
    bpy: Any, group: Any, root: Any, layers: Any
) -> None:
    root.workload = "random_lines"
    root.workloads.random_lines.count = 50
    bpy.ops.accelscope.trace()
    bpy.ops.accelscope.step_ray()
    group.show = True
    assert set(layers) == {"ray", "exhibit"}
    root.ray_index = 1
    bpy.ops.accelscope.step_ray()
    assert set(layers) == {"ray", "exhibit"}
    group.show = False
    assert set(layers) == {"ray"}


def test_few_frames_are_kept(group: Any, current: Any, monkeypatch: Any) -> None:
    from accelscope.addon.results import showcase

    monkeypatch.setattr(showcase, "MOST_KEPT", 2)
    made: list[int] = []
    current.showcase.exhibits = [make_exhibit(made=made)]
    group.show = True
    for number in (1, 2, 1, 0):
        group.frame = number
    assert made == [0, 1, 2, 0]
    assert len(current.showcase.frames) == 2


def test_a_frame_that_takes_long_is_a_job(
    bpy: Any, group: Any, current: Any, layers: Any, monkeypatch: Any
) -> None:
    """What the panel does while another thread works: the last frame stays, then the new comes."""
    from accelscope.addon import jobs
    from accelscope.operators.show_frame import ACCELSCOPE_OT_show_frame as Operator

    go = threading.Event()
    example = make_exhibit()
    slow = type(example)(
        "slow", "Slow", "Waits", 3, lambda number, progress: (go.wait(10), example.frame(number))[1]
    )
    current.showcase.exhibits = [slow]
    started = []
    monkeypatch.setattr(
        type(current),
        "show_exhibit",
        lambda self, context: started.append(self.showcase.draw(group)),
    )
    group.show = True
    assert started == [False]
    work = Operator.prepare(None, bpy.context)
    job = jobs.Job(work, "slow")
    group.frame = 2
    assert current.showcase.shown is None
    assert not job.is_finished
    go.set()
    job.wait(10)
    assert Operator.finish(None, bpy.context, job.result) == ""
    # Meanwhile another frame is wanted: the one made is kept.
    assert list(current.showcase.frames) == [("slow", 0)]
    assert started == [False, False, False]
    group.frame = 0
    assert started[-1] is True
    assert current.showcase.shown == ("slow", 0)


def test_view_exhibit_needs_a_frame(bpy: Any, group: Any) -> None:
    assert not bpy.ops.accelscope.view_exhibit.poll()
    group.show = True
    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(area=area):
        assert bpy.ops.accelscope.view_exhibit.poll()


@pytest.mark.parametrize("perspective", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("turned", [(1.0, 0.0, 0.0, 0.0), (0.7, 0.5, 0.2, -0.4)])
def test_the_view_shows_the_points(bpy: Any, perspective: str, turned: tuple[float, ...]) -> None:
    from accelscope.addon.drawing.viewport import look_at, slopes_of
    from mathutils import Quaternion, Vector

    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    space = area.spaces.active
    view = space.region_3d
    view.view_perspective = perspective
    view.view_rotation = Quaternion(turned).normalized()
    points = np.random.default_rng(1).normal(size=(30, 3)) * [9, 2, 1] + [40, -7, 3]
    look_at(area, points)
    eye = view.view_location + view.view_rotation @ Vector((0, 0, view.view_distance))
    relative = [view.view_rotation.inverted() @ (Vector(point) - eye) for point in points]
    slopes = slopes_of(area, space.lens)
    shares = []
    for place in relative:
        assert place.z < 0
        unit = -place.z if perspective == "PERSP" else view.view_distance
        for value, (low, high) in zip((place.x, place.y), slopes, strict=False):
            shares.append(value / unit / (high if value > 0 else low))
    assert max(map(abs, shares)) <= 1.0 + 1e-4
    assert max(shares) == pytest.approx(1.0, abs=1e-3)
    assert min(shares) == pytest.approx(-1.0, abs=1e-3)
