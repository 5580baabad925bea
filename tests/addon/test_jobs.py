"""Work in a thread: progress, cancellation, errors. Blender's events are pretended."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest
from accelscope.core.errors import InputError
from accelscope.core.progress import SILENT, Progress

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")
ESC = SimpleNamespace(type="ESC", value="PRESS")
MOUSE = SimpleNamespace(type="MOUSEMOVE", value="NOTHING")


def make_operator(jobs: Any, work: Any) -> Any:
    class Operator(jobs.JobOperator):
        def __init__(self) -> None:
            self.reports: list[tuple[set[str], str]] = []
            self.stored: Any = "previous"
            self.gave_up = False

        def report(self, kind: set[str], text: str) -> None:
            self.reports.append((kind, text))

        def prepare(self, context: Any) -> Any:
            return work

        def finish(self, context: Any, result: Any) -> str:
            self.stored = result
            return "done"

        def give_up(self) -> None:
            self.gave_up = True

    return Operator()


def run_modal(operator: Any, context: Any, seconds: float = 60.0) -> set[str]:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        outcome = operator.modal(context, TIMER)
        if outcome != {"PASS_THROUGH"}:
            return outcome
        time.sleep(0.01)
    raise TimeoutError


def test_the_last_draft_is_taken_once(jobs: Any, context: Any) -> None:
    offered, release = threading.Event(), threading.Event()

    def work(progress: Progress) -> str:
        progress.offer("coarse")
        progress.offer("finer")
        offered.set()
        release.wait(60)
        return "finest"

    operator = make_operator(jobs, work)
    shown: list[Any] = []
    operator.tick = lambda context: shown.append(operator._job.take_draft())
    assert operator.invoke(context, TIMER) == {"RUNNING_MODAL"}
    assert offered.wait(60)
    for _ in range(2):
        assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    assert shown == ["finer", None]
    release.set()
    assert run_modal(operator, context) == {"FINISHED"}
    assert operator.stored == "finest"


def test_work_runs_in_a_thread_and_is_stored(jobs: Any, context: Any) -> None:
    release = threading.Event()

    def work(progress: Progress) -> str:
        progress.report(1, 4, "Half way")
        assert threading.current_thread() is not threading.main_thread()
        release.wait(60)
        return "new"

    operator = make_operator(jobs, work)
    assert operator.invoke(context, None) == {"RUNNING_MODAL"}
    job = jobs.running()
    while job.text != "Half way":
        time.sleep(0.01)
    assert job.factor == 0.25
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    assert operator.modal(context, MOUSE) == {"PASS_THROUGH"}
    assert operator.stored == "previous"
    release.set()
    assert run_modal(operator, context) == {"FINISHED"}
    assert operator.stored == "new"
    assert operator.reports == [({"INFO"}, "done")]
    assert jobs.running() is None


@pytest.mark.parametrize("listens", [True, False])
def test_esc_ends_the_operator_whatever_the_thread_does(
    jobs: Any, context: Any, listens: bool
) -> None:
    # A compiler does not listen: then the operator ends and the thread is left to itself.
    begun, compiled, stopped = threading.Event(), threading.Event(), threading.Event()

    def work(progress: Progress) -> str:
        begun.set()
        try:
            while not compiled.wait(0.01):
                if listens:
                    progress.report(0, 1, "Building")
        finally:
            stopped.set()
        return "new"

    operator = make_operator(jobs, work)
    operator.invoke(context, None)
    assert begun.wait(60)
    # Waiting for a thread that does not listen would never end.
    assert operator.modal(context, ESC) == {"CANCELLED"}
    assert jobs.running() is None
    if listens:
        assert stopped.wait(60)
    else:
        assert not stopped.is_set()
        compiled.set()
    assert operator.stored == "previous"
    assert operator.gave_up
    assert operator.reports == [({"INFO"}, "Cancelled; the previous result stays")]
    assert stopped.wait(60)
    assert operator.stored == "previous"


def test_cancel_from_elsewhere_ends_at_the_next_tick(jobs: Any, context: Any) -> None:
    operator = make_operator(jobs, lambda progress: time.sleep(0.3))
    operator.invoke(context, None)
    jobs.cancel()
    assert operator.modal(context, TIMER) == {"CANCELLED"}


def test_loading_a_file_forgets_the_job(jobs: Any, context: Any) -> None:
    operator = make_operator(jobs, lambda progress: time.sleep(0.3))
    operator.invoke(context, None)
    jobs.abandon()
    assert jobs.running() is None
    assert operator.modal(context, TIMER) == {"CANCELLED"}
    assert operator.stored == "previous"


def test_input_error_is_reported(jobs: Any, context: Any) -> None:
    def work(progress: Progress) -> None:
        raise InputError("too large; use less")

    operator = make_operator(jobs, work)
    operator.invoke(context, None)
    assert run_modal(operator, context) == {"CANCELLED"}
    assert operator.reports == [({"ERROR"}, "too large; use less")]
    assert operator.gave_up
    assert operator.stored == "previous"


def test_defect_keeps_its_traceback(jobs: Any, context: Any, capsys: Any) -> None:
    def work(progress: Progress) -> None:
        raise ZeroDivisionError("a defect")

    operator = make_operator(jobs, work)
    operator.invoke(context, None)
    assert run_modal(operator, context) == {"CANCELLED"}
    assert jobs.running() is None
    assert operator.gave_up
    ((kind, text),) = operator.reports
    assert kind == {"ERROR"}
    assert "ZeroDivisionError: a defect" in text
    assert "\n" not in text
    assert "in work\n" in capsys.readouterr().err


def test_scripts_wait_for_the_result(jobs: Any, context: Any) -> None:
    seen = []
    operator = make_operator(jobs, lambda progress: seen.append(progress) or "new")
    assert operator.execute(context) == {"FINISHED"}
    assert operator.stored == "new"
    assert seen == [SILENT]


def test_cancelled_build_leaves_the_previous_structure(
    bpy: Any, jobs: Any, context: Any, current: Any
) -> None:
    from accelscope.addon.from_blender import watching
    from accelscope.operators.build import ACCELSCOPE_OT_build

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=400, y_subdivisions=400)
    bpy.ops.accelscope.build()
    before = (current.built, current.cells, current.record, current.snapshot)
    bpy.context.scene.accelscope.structures.bvh.max_leaf_size = 1
    work = ACCELSCOPE_OT_build.prepare(None, bpy.context)
    reports = []

    class Counting(jobs.Job):
        """Is cancelled at its second report, and counts all."""

        def report(self, done: float, total: float, text: str) -> None:
            reports.append((done, total))
            if len(reports) == 2:
                self.cancel()
            super().report(done, total, text)

    job = Counting(work, "Building")
    job.wait(30)
    assert job.is_finished
    assert type(job.error).__name__ == "Cancelled"
    assert len(reports) == 2
    assert reports[-1][0] < reports[-1][1]
    ACCELSCOPE_OT_build.give_up(None)
    assert before == (current.built, current.cells, current.record, current.snapshot)
    assert watching.watched == [current.snapshot.look]
