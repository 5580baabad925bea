"""An exception anywhere in a job ends it: one line, working buttons, the previous result.

Faults are put into every place that is run while a comparison over the timeline goes on. Blender's
events are pretended, since there are none without a window.
"""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")
ESC = SimpleNamespace(type="ESC", value="PRESS")


class Fault(Exception):
    """What nobody expects."""


def fail(*_: Any, **__: Any) -> None:
    raise Fault("a fault\nover two lines")


@pytest.fixture
def operator(bpy: Any, jobs: Any, current: Any) -> Any:
    """The comparison over four frames of a moving cube; a result is there already."""
    from accelscope.operators.compare_over_timeline import ACCELSCOPE_OT_compare_over_timeline

    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    for frame in (1, 4):
        cube.scale.x = frame
        cube.keyframe_insert("scale", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 4
    bpy.context.scene.frame_set(2)
    bpy.ops.accelscope.build()
    own = vars(ACCELSCOPE_OT_compare_over_timeline)

    class Pretended(jobs.JobOperator):
        """The operator's own functions; Blender alone can make a real one."""

        job_text = own["job_text"]
        prepare, tick = own["prepare"], own["tick"]
        finish, give_up = own["finish"], own["give_up"]

        def __init__(self) -> None:
            self.reports: list[tuple[set[str], str]] = []

        def report(self, kind: set[str], text: str) -> None:
            self.reports.append((kind, text))

    return Pretended()


def run(operator: Any, context: Any, seconds: float = 60.0) -> set[str]:
    """Start the operator and let time pass until it has ended."""
    outcome = operator.invoke(context, None)
    end = time.monotonic() + seconds
    while outcome == {"RUNNING_MODAL"} or outcome == {"PASS_THROUGH"}:
        assert time.monotonic() < end
        outcome = operator.modal(context, TIMER)
        time.sleep(0.01)
    return outcome


@pytest.fixture
def is_clean(bpy: Any, jobs: Any, manager: SimpleNamespace, current: Any, operator: Any) -> Any:
    """Check that everything is as it was before the job."""
    from accelscope.addon.from_blender import watching

    before = current.built, current.cells, current.record, current.snapshot

    def check() -> None:
        assert jobs.running() is None
        assert manager.timers == []
        for job in jobs._abandoned:
            job.wait(60.0)
            assert job.is_finished
        for verb in ("build", "refit", "trace", "compare_over_timeline", "clear"):
            assert getattr(bpy.ops.accelscope, verb).poll(), verb
        assert before == (current.built, current.cells, current.record, current.snapshot)
        assert watching.watched == [current.snapshot.look]
        assert current.status(bpy.context).text == "Up to date"
        assert bpy.context.scene.frame_current == 2
        assert bpy.ops.accelscope.compare_over_timeline() == {"FINISHED"}

    return check


def check_report(operator: Any, text: str = "Fault: a fault over two lines") -> None:
    ((kind, line),) = operator.reports
    assert kind == {"ERROR"}
    assert text in line
    assert "\n" not in line


def test_without_a_fault(operator: Any, jobs: Any, context: Any, manager: Any) -> None:
    assert run(operator, context) == {"FINISHED"}
    ((kind, text),) = operator.reports
    assert kind == {"INFO"}
    assert text.startswith("Frames 1 to 4: SAH")
    assert jobs.running() is None
    assert manager.timers == []


@pytest.mark.parametrize(
    "place",
    [
        "accelscope.addon.from_blender.extraction.collect",  # in prepare, and then in a tick
        "accelscope.addon.from_blender.timeline.Look.at",
        "accelscope.addon.from_blender.timeline.Frames.serve",
        "accelscope.core.evaluation.records.animation.animate",
        # In the thread, while it waits for frames.
        "accelscope.core.evaluation.records.animation.build",
        "accelscope.core.evaluation.records.animation.growth",
        "accelscope.addon.results.outcome.Outcome.of",
        "accelscope.addon.drawing.overlay.set_cells",
    ],
)
def test_a_fault_in(
    operator: Any, context: Any, is_clean: Any, monkeypatch: pytest.MonkeyPatch, place: str,
    current: Any, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    with monkeypatch.context() as patch:
        patch.setattr(place, fail)
        assert run(operator, context) == {"CANCELLED"}
    check_report(operator)
    assert "raise Fault" in capsys.readouterr().err
    if place.endswith("growth"):
        # What was found had been stored by then, as a whole.
        assert len(current.timeline) == 8
        return
    is_clean()


def test_a_fault_in_the_third_frame(
    operator: Any, context: Any, is_clean: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.addon.from_blender import extraction

    real, calls = extraction.collect, []

    def collect(*arguments: Any) -> Any:
        calls.append(1)
        return fail() if len(calls) == 4 else real(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(extraction, "collect", collect)
        assert run(operator, context) == {"CANCELLED"}
    check_report(operator)
    is_clean()


@pytest.mark.parametrize("name", ["event_timer_add", "modal_handler_add"])
def test_a_fault_of_the_window_manager(
    operator: Any, context: Any, is_clean: Any, manager: SimpleNamespace, name: str
) -> None:
    setattr(manager, name, fail)
    assert run(operator, context) == {"CANCELLED"}
    check_report(operator)
    is_clean()


def test_a_fault_when_the_timer_is_removed(
    operator: Any, context: Any, jobs: Any, manager: SimpleNamespace
) -> None:
    manager.event_timer_remove = fail
    assert run(operator, context) == {"FINISHED"}
    assert jobs.running() is None


@pytest.mark.parametrize("end", ["esc", "blender", "error"])
def test_a_fault_while_cleaning_up(
    operator: Any, context: Any, jobs: Any, end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("accelscope.addon.from_blender.timeline.Frames.restore", fail)
        if end == "error":
            patch.setattr("accelscope.core.evaluation.records.animation.animate", fail)
            assert run(operator, context) == {"CANCELLED"}
            check_report(operator)
        else:
            assert operator.invoke(context, None) == {"RUNNING_MODAL"}
            if end == "esc":
                assert operator.modal(context, ESC) == {"CANCELLED"}
                assert operator.reports == [({"INFO"}, "Cancelled; the previous result stays")]
            else:
                operator.cancel(context)
    assert jobs.running() is None


def test_no_memory(
    operator: Any, context: Any, is_clean: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_memory(*_: Any, **__: Any) -> None:
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr("accelscope.core.evaluation.records.animation.animate", no_memory)
        assert run(operator, context) == {"CANCELLED"}
    check_report(operator, "out of memory; use a smaller scene")
    is_clean()


# -------------------------------------------------------------------- edits during a comparison


@pytest.mark.parametrize("frame", [1, 2, 3, 4])
def test_an_edit_during_the_comparison_ends_it(
    bpy: Any, operator: Any, context: Any, current: Any, jobs: Any, frame: int
) -> None:
    before = current.built

    def edit() -> None:
        if bpy.context.scene.frame_current == frame and not edited:
            edited.append(frame)
            bpy.data.objects["Cube"].location.x = 1.0
            bpy.context.view_layer.update()

    edited: list[int] = []
    outcome = operator.invoke(context, None)
    while outcome in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
        outcome = operator.modal(context, TIMER)
        if jobs.running():
            edit()
        time.sleep(0.005)
    assert edited == [frame]
    assert outcome == {"CANCELLED"}
    check_report(operator, f"Cube has moved in frame {frame} while frames were compared")
    assert current.built is before
    assert current.status(bpy.context).text == "Out of date: Cube has moved"


def test_an_edit_just_before_the_next_frame(
    bpy: Any, operator: Any, context: Any, current: Any
) -> None:
    """Of the frames after it nobody could tell, but Blender has not evaluated it yet either."""
    cube, before = bpy.data.objects["Cube"], current.built
    outcome = operator.invoke(context, None)
    while outcome in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
        cube.location.x = 1.0 if bpy.context.scene.frame_current == 1 else 0.0
        outcome = operator.modal(context, TIMER)
        time.sleep(0.005)
    assert outcome == {"CANCELLED"}
    check_report(operator, "while frames were compared; start it again")
    assert current.built is before


def test_an_edit_of_frames_that_were_taken(
    bpy: Any, operator: Any, context: Any, current: Any
) -> None:
    """In frame 3 a new keyframe for frame 1: nothing is to be seen in frame 3."""
    cube, before = bpy.data.objects["Cube"], current.built
    cube.location.x = 0.0
    cube.keyframe_insert("location", frame=3)
    cube.keyframe_insert("location", frame=4)
    bpy.context.scene.frame_set(2)
    outcome, is_edited = operator.invoke(context, None), False
    while outcome in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
        if bpy.context.scene.frame_current == 3 and not is_edited:
            cube.location.x = 1.0
            cube.keyframe_insert("location", frame=1)
            cube.location.x = 0.0
            is_edited = True
        outcome = operator.modal(context, TIMER)
        time.sleep(0.005)
    assert is_edited
    assert outcome == {"CANCELLED"}
    check_report(operator, "Cube has moved in frame 1 while frames were compared")
    assert current.built is before


def test_looking_around_during_the_comparison_does_no_harm(
    bpy: Any, operator: Any, context: Any, current: Any
) -> None:
    cube = bpy.data.objects["Cube"]
    outcome = operator.invoke(context, None)
    while outcome in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
        cube.select_set(not cube.select_get())
        cube.data.update_tag()
        bpy.context.view_layer.update()
        outcome = operator.modal(context, TIMER)
        time.sleep(0.005)
    assert outcome == {"FINISHED"}, operator.reports
    assert current.status(bpy.context).text == "Up to date"
