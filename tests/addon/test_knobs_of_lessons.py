"""The knobs of a lesson in Blender: pictures and plays that follow them, and films through them."""

from __future__ import annotations

import dataclasses
import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons import lessons
from accelscope.core.lessons.lesson import Play
from accelscope.core.lessons.picture import Image, Mark, Picture, Row
from accelscope.core.settings import setting


@dataclasses.dataclass(frozen=True)
class Knobs:
    """Of each kind one."""

    count: int = setting(1, "Count", "How many lines", minimum=0)
    kind: str = setting("plain", "Kind", "What is played", choices={
        "plain": "A", "other": "B", "third": "C",
    })  # fmt: skip


class Lines(Play):
    """As many lines as the knob says, at most three."""

    def __init__(self, kind: str) -> None:
        self.kind, self.ends = kind, {"count": 3}

    def picture(self, settings: Knobs) -> Picture:
        segments = np.zeros((settings.count, 2, 3))
        segments[:, 1] = 1.0 + np.arange(settings.count)[:, None]
        image = Image("map", np.full((2, 3, 3), 0.5))
        return Picture(
            f"{settings.count} {self.kind}", segments, np.ones((settings.count, 4)),
            marks=(Mark(np.zeros(3), "here"),), rows=(Row("N", str(settings.count), "Lines"),),
            images=(image,),
        )  # fmt: skip


class Example:
    """What becomes of a lesson that is played: how often, and what it does meanwhile."""

    def __init__(self) -> None:
        self.played: list[str] = []
        self.go = threading.Event()
        self.go.set()
        self.fault: Exception | None = None
        self.has_draft, self.offered = False, threading.Event()

    def play(self, subject: Any, settings: Knobs, progress: Any) -> Play:
        if self.has_draft:
            progress.offer(Lines(f"draft of {settings.kind}"))
            self.offered.set()
        while not self.go.wait(0.01):
            progress.report(0, 1, "Waiting")
        if self.fault:
            raise self.fault
        self.played.append(settings.kind)
        return Lines(settings.kind)


@pytest.fixture
def example(bpy: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A lesson that stands in the place of "levels", with knobs of its own."""
    from accelscope.addon.results import lesson_view
    from accelscope.addon.settings import generated, ranges

    made = Example()
    lesson = dataclasses.replace(
        lessons()["levels"], Settings=Knobs, play=made.play, film="count", replays=("kind",),
        structures=(), sample="tetra:size=1",
    )  # fmt: skip
    kind = generated.group_type(
        "example",
        ranges.range_properties(
            "count", lambda group: lesson_view.end_of("levels", "count"), label="Count",
            description="How many lines", default=1,
            update=lambda group, context: lesson_view.current.follow(group.id_data),
        )
        | {
            "kind": generated.property_of(
                dataclasses.fields(Knobs)[1],
                update=lambda group, context: lesson_view.current.follow(group.id_data),
            )
        },
    )  # fmt: skip
    bpy.utils.register_class(kind)
    bpy.types.Scene.accelscope_example = bpy.props.PointerProperty(type=kind)
    monkeypatch.setattr(lesson_view, "chosen", lambda scene: lesson)
    monkeypatch.setattr(lesson_view, "group_of", lambda scene, lesson: scene.accelscope_example)
    made.lesson = lesson
    yield made
    lesson_view.current.clear()
    del bpy.types.Scene.accelscope_example
    bpy.utils.unregister_class(kind)


@pytest.fixture
def knobs(bpy: Any, example: Any) -> Any:
    """The knobs of the example while it is taught."""
    assert bpy.ops.accelscope.teach() == {"FINISHED"}
    return bpy.context.scene.accelscope_example


# ------------------------------------------------------------------------------ knobs


def test_a_knob_changes_the_picture_without_playing(view: Any, example: Any, knobs: Any) -> None:
    assert view.picture.caption == "1 plain"
    knobs.count = 2
    assert view.picture.caption == "2 plain"
    knobs.count = 99
    assert (knobs.count, view.picture.caption) == (3, "3 plain")
    assert example.played == ["plain"]


def test_a_knob_that_decides_what_is_played_plays(view: Any, example: Any, knobs: Any) -> None:
    knobs.count = 2
    knobs.kind = "other"
    assert example.played == ["plain", "other"]
    assert view.picture.caption == "2 other"


def test_what_was_shown_stays_when_a_play_fails(view: Any, example: Any, knobs: Any) -> None:
    from accelscope.addon import jobs
    from accelscope.addon.results import lesson_view

    example.fault = InputError("there is nothing to see")
    knobs.kind = "other"
    assert view.picture.caption == "1 plain"
    assert jobs.refusal(lesson_view.PLAY) == "Not shown: there is nothing to see"
    example.fault = None
    knobs.kind = "plain"
    knobs.count = 2
    assert view.picture.caption == "2 plain"
    assert example.played == ["plain"]


def test_a_picture_that_fails_is_one_line(
    view: Any, knobs: Any, monkeypatch: Any, capsys: Any
) -> None:
    def fail(settings: Any) -> Picture:
        raise ValueError("broken")

    monkeypatch.setattr(view.play, "picture", fail)
    knobs.count = 2
    assert view.fault.startswith("Not shown: a defect of AccelScope (ValueError: broken)")
    assert view.picture.caption == "1 plain"
    assert "Traceback" in capsys.readouterr().err
    monkeypatch.undo()


class Windowed:
    """Blender with a window, as :mod:`lesson_view` sees it: jobs are started by a timer.

    Parameters
    ----------
    bpy : module
    begin : callable
        Starts the operator that plays; returns it.
    """

    def __init__(self, bpy: Any, begin: Any) -> None:
        self.timers: list[Any] = []
        self.begun: list[Any] = []
        timers = SimpleNamespace(
            is_registered=self.timers.__contains__, register=self.timers.append
        )
        self.app = SimpleNamespace(background=False, timers=timers)
        self.context, self.data, self._begin = bpy.context, bpy.data, begin
        self.ops = SimpleNamespace(accelscope=SimpleNamespace(play_lesson=self))

    def poll(self) -> bool:
        return True

    def __call__(self, how: str, is_undone: bool) -> None:
        assert (how, is_undone) == ("INVOKE_DEFAULT", True)
        self.begun.append(self._begin())

    def tick(self) -> None:
        """Call timers as Blender does: once more those that say when."""
        self.timers[:] = [each for each in self.timers if each() is not None]


@pytest.fixture
def windowed(
    bpy: Any, knobs: Any, jobs: Any, context: Any, monkeypatch: pytest.MonkeyPatch
) -> Windowed:
    """Blender with a window, in which the example is taught."""
    from accelscope.addon.results import lesson_view
    from accelscope.operators.play_lesson import ACCELSCOPE_OT_play_lesson as Real

    class Operator(jobs.JobOperator):
        prepare, tick, finish, give_up = Real.prepare, Real.tick, Real.finish, Real.give_up
        head_start, _has_draft = 0.0, False

        def report(self, kind: set[str], text: str) -> None:
            pass

    Operator.__name__ = Real.__name__  # by which a job is known

    def begin() -> Any:
        operator = Operator()
        assert operator.invoke(context, None) == {"RUNNING_MODAL"}
        return operator

    made = Windowed(bpy, begin)
    monkeypatch.setattr(lesson_view, "bpy", made)
    return made


TIMER = SimpleNamespace(type="TIMER", value="NOTHING")
ESC = SimpleNamespace(type="ESC", value="PRESS")


def test_a_play_under_way_is_cancelled_by_the_next(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed
) -> None:
    """Only what was asked for last is played: nothing comes of the play before."""
    example.go.clear()
    knobs.kind = "other"
    assert (jobs.running(), len(windowed.timers)) == (None, 1)
    windowed.tick()
    (first,), job = windowed.begun, jobs.running()
    assert job.by == first.__class__.__name__
    assert first.modal(context, TIMER) == {"PASS_THROUGH"}
    knobs.kind = "third"
    assert not job.is_cancelled  # Blender may be in the handler of a list
    windowed.tick()
    assert job.is_cancelled
    assert windowed.begun == [first]
    assert first.modal(context, TIMER) == {"CANCELLED"}
    windowed.tick()
    _, second = windowed.begun
    assert windowed.timers == []
    assert jobs.running() is not job
    assert view.picture.caption == "1 plain"
    job.wait(60.0)
    example.go.set()
    jobs.running().wait(60.0)
    assert second.modal(context, TIMER) == {"FINISHED"}
    assert view.picture.caption == "1 third"
    assert example.played == ["plain", "third"]
    assert context.window_manager.timers == []


def test_a_play_under_way_is_cancelled_by_esc(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed
) -> None:
    """The buttons work again at once, the thread ends soon, and what is shown stays."""
    example.go.clear()
    knobs.kind = "other"
    windowed.tick()
    (operator,), job = windowed.begun, jobs.running()
    assert operator.modal(context, ESC) == {"CANCELLED"}
    assert jobs.running() is None
    assert context.window_manager.timers == []
    job.wait(60.0)
    assert job.is_finished
    assert job.result is None
    assert view.picture.caption == "1 plain"
    assert example.played == ["plain"]


@pytest.fixture
def drafted(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed
) -> tuple[Any, Any]:
    """The operator of a play under way whose draft is shown, and its job."""
    example.go.clear()
    example.has_draft = True
    knobs.kind = "other"
    windowed.tick()
    (operator,), job = windowed.begun, jobs.running()
    assert example.offered.wait(60.0)
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    assert view.picture.caption == "1 draft of other"
    return operator, job


def test_a_draft_is_shown_until_the_play_is_finished(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed,
    drafted: tuple[Any, Any],
) -> None:  # fmt: skip
    operator, job = drafted
    knobs.count = 3  # a knob that plays nothing anew
    assert view.picture.caption == "3 draft of other"
    assert (jobs.running(), windowed.timers) == (job, [])
    example.go.set()
    job.wait(60.0)
    assert operator.modal(context, TIMER) == {"FINISHED"}
    assert view.picture.caption == "3 other"


@pytest.mark.parametrize("ends", ["whole", "esc"])
def test_a_lesson_is_taught_with_its_first_draft(
    bpy: Any, view: Any, example: Any, jobs: Any, context: Any, windowed: Windowed, ends: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """It can be seen at once; all of it is played then, and Esc leaves the draft."""
    from accelscope.addon.results import lesson_view
    from accelscope.operators.teach import ACCELSCOPE_OT_teach as Real

    class Teach(jobs.JobOperator):
        prepare, enough, finish, give_up = Real.prepare, Real.enough, Real.finish, Real.give_up
        head_start, lesson, subject = 0.0, "", "SAMPLE"

        def report(self, kind: set[str], text: str) -> None:
            pass

    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    example.go.clear()
    example.has_draft = True
    monkeypatch.setattr(type(context), "window", bpy.context.window)
    operator = Teach()
    assert operator.invoke(context, None) == {"RUNNING_MODAL"}
    job = jobs.running()
    assert example.offered.wait(60.0)
    assert operator.modal(context, TIMER) == {"FINISHED"}
    assert view.picture.caption == "1 draft of plain"
    job.wait(60.0)
    assert job.is_cancelled
    windowed.tick()
    (playing,), job = windowed.begun, jobs.running()
    assert job.by == lesson_view.PLAY
    if ends == "esc":
        assert playing.modal(context, ESC) == {"CANCELLED"}
        assert view.picture.caption == "1 draft of plain"
        return
    example.go.set()
    job.wait(60.0)
    assert playing.modal(context, TIMER) == {"FINISHED"}
    assert view.picture.caption == "1 plain"
    assert view.lesson is example.lesson
    assert context.window_manager.timers == []


def test_a_draft_stays_after_esc_and_the_next_knob_plays_all(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed,
    drafted: tuple[Any, Any],
) -> None:  # fmt: skip
    operator, job = drafted
    assert operator.modal(context, ESC) == {"CANCELLED"}
    job.wait(60.0)
    assert view.picture.caption == "1 draft of other"
    assert not view.fault
    example.go.set()
    knobs.count = 2
    windowed.tick()
    _, second = windowed.begun
    jobs.running().wait(60.0)
    while second.modal(context, TIMER) == {"PASS_THROUGH"}:
        pass
    assert view.picture.caption == "2 other"
    assert example.played == ["plain", "other"]


def test_a_play_of_what_is_gone_is_dropped(bpy: Any, view: Any, example: Any, knobs: Any) -> None:
    from accelscope.addon.results.lesson_view import Ready
    from accelscope.operators.play_lesson import ACCELSCOPE_OT_play_lesson as Operator

    other = dataclasses.replace(view.subject)
    late = Ready(view.lesson, other, Lines("late"), Knobs())
    assert Operator.finish(None, bpy.context, (late, None)) == ""
    assert view.play.kind == "plain"


# ------------------------------------------------------------------------------ film and image


def test_the_film_goes_by_steps_and_over_the_timeline(
    bpy: Any, view: Any, example: Any, knobs: Any
) -> None:
    from accelscope.addon.results import film

    scene = bpy.context.scene
    assert list(film.values()) == [0, 1, 2, 3]
    bpy.ops.accelscope.step_film(by=1)
    assert knobs.count == 2
    bpy.ops.accelscope.step_film(by=5)
    assert knobs.count == 3
    before = scene.frame_start, scene.frame_end, scene.frame_current
    bpy.ops.accelscope.film_on_timeline()
    assert (scene.frame_start, scene.frame_end, scene.frame_current) == (1, 4, 4)
    scene.frame_set(2)
    assert view.picture.caption == "1 plain"
    bpy.ops.accelscope.film_on_timeline()
    assert (scene.frame_start, scene.frame_end, scene.frame_current) == before
    scene.frame_set(4)
    assert knobs.count == 1


def test_the_film_plays_to_its_end(bpy: Any, view: Any, example: Any, knobs: Any) -> None:
    from accelscope.addon.results import film

    knobs.count = 3
    film.start(bpy.context.scene)
    shown = [knobs.count]
    while film._next() is not None:
        shown.append(knobs.count)
    assert shown == [0, 1, 2, 3]
    assert not film.is_playing()


def test_an_image_is_kept_on_demand(bpy: Any, view: Any, knobs: Any) -> None:
    assert len(bpy.data.images) == 0
    bpy.ops.accelscope.open_lesson_image()
    assert tuple(bpy.data.images["map"].size) == (3, 2)


def test_undo_shows_what_it_brings_back(bpy: Any, view: Any, knobs: Any) -> None:
    from accelscope.addon.results import lesson_view

    knobs.count = 3
    view.settings = None  # as if it were another's
    lesson_view._after_undo()
    assert view.settings.count == 3
    view.owner = 0
    lesson_view._after_undo()
    assert view.lesson is None
