"""Lessons in Blender: taught in a scene of their own, their knobs, films, and the way back."""

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
from accelscope.core.lessons.slides import SLIDES
from accelscope.core.settings import setting

NAMES = list(lessons())


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
def view(bpy: Any) -> Any:
    """What is shown of a lesson."""
    from accelscope.addon.results import lesson_view

    yield lesson_view.current
    lesson_view.current.clear()


@pytest.fixture
def knobs(bpy: Any, example: Any) -> Any:
    """The knobs of the example while it is taught."""
    assert bpy.ops.accelscope.teach() == {"FINISHED"}
    return bpy.context.scene.accelscope_example


# ------------------------------------------------------------------------------ settings


@pytest.mark.parametrize("name", NAMES)
def test_a_lesson_has_its_knobs_in_blender(root: Any, name: str) -> None:
    from accelscope.addon.settings import generated

    lesson = lessons()[name]
    group = getattr(root.lessons, name)
    assert generated.read(group, lesson.Settings, name) == lesson.Settings()


def test_lessons_are_listed_by_slide(root: Any) -> None:
    items = root.teaching.bl_rna.properties["lesson"].enum_items
    assert [item.identifier for item in items] == NAMES
    places = [SLIDES.index(lessons()[item.identifier].slide) for item in items]
    assert places == sorted(places)


# ------------------------------------------------------------------------------ teaching


def everything(bpy: Any) -> list[str]:
    """Return the names of all data of the file that lessons could leave behind."""
    kinds = ("scenes", "objects", "meshes", "collections", "cameras", "lights", "texts", "images")
    return [f"{kind} {each.name}" for kind in kinds for each in getattr(bpy.data, kind)]


def test_a_lesson_has_a_scene_of_its_own_and_leaves_the_file_as_it_was(bpy: Any, view: Any) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    home, before = bpy.context.scene, everything(bpy)
    selected = [obj.name for obj in bpy.context.selected_objects]
    home.accelscope.teaching.lesson = "levels"
    assert bpy.ops.accelscope.teach() == {"FINISHED"}
    assert bpy.context.scene != home
    assert view.is_in(bpy.context.scene)
    assert not view.is_in(home)
    names = [obj.name for obj in bpy.context.scene.objects if obj.type == "MESH"]
    assert len(names) == 1
    assert "Suzanne" not in names
    assert len(home.objects) == 1
    # What the lesson is about is the sample itself, not what Blender makes of it.
    assert view.subject.structures[0].scene is view.subject.scene
    bpy.ops.accelscope.read_source()
    assert bpy.data.texts[0].as_string().startswith('"""')
    bpy.ops.accelscope.teach()  # once more: nothing is there twice
    assert len([obj for obj in bpy.context.scene.objects if obj.type == "MESH"]) == 1
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert bpy.context.scene == home
    assert everything(bpy) == before
    assert [obj.name for obj in bpy.context.selected_objects] == selected
    assert view.lesson is None


def test_viewports_are_left_as_they_were(bpy: Any, view: Any) -> None:
    from accelscope.addon.drawing.viewport import largest

    space = largest(bpy.context.window).spaces.active
    space.shading.type, space.overlay.show_floor = "WIREFRAME", True
    space.region_3d.view_location = (1, 2, 3)
    bpy.ops.accelscope.teach()
    assert space.shading.type == "SOLID"
    assert not space.overlay.show_floor
    bpy.ops.accelscope.end_lesson()
    assert (space.shading.type, space.overlay.show_floor) == ("WIREFRAME", True)
    assert tuple(space.region_3d.view_location) == (1, 2, 3)


def test_what_the_user_adds_to_the_scene_of_a_lesson_is_kept(bpy: Any, view: Any) -> None:
    bpy.ops.accelscope.teach()
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    bpy.ops.accelscope.end_lesson()
    assert cube.name in bpy.data.objects
    assert [scene.name for scene in cube.users_scene] == ["AccelScope Lesson"]
    assert len(bpy.data.scenes) == 2


def test_a_file_saved_during_a_lesson_can_end_it(bpy: Any, view: Any, tmp_path: Any) -> None:
    bpy.ops.accelscope.teach()
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert view.lesson is None
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]


def test_a_lesson_on_the_users_mesh(bpy: Any, view: Any, current: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.mesh.primitive_monkey_add()
    scene = bpy.context.scene
    scene.accelscope.teaching.lesson = "levels"
    assert bpy.ops.accelscope.use_my_mesh() == {"FINISHED"}
    assert bpy.context.scene == scene
    assert view.is_own
    # The monkey alone is selected.
    assert len(view.subject.scene) == 968
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.accelscope.use_my_mesh()
    assert len(view.subject.scene) == 980


def test_what_was_built_is_what_the_lesson_is_about_if_it_suits(
    bpy: Any, root: Any, view: Any, current: Any
) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.accelscope.build()
    root.teaching.lesson = "levels"
    built = current.built.structure
    bpy.ops.accelscope.use_my_mesh()
    assert view.subject.structures[0] is built
    root.structure = "grid"
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.use_my_mesh()
    assert view.subject.structures[0].name == "bvh"
    root.structure = "bvh"
    bpy.ops.accelscope.build()
    bpy.context.object.location.x = 3.0
    bpy.ops.accelscope.use_my_mesh()
    assert view.subject.structures[0] is not current.built.structure
    assert view.subject.scene.lower[0] > 1.0


def test_a_lesson_on_the_users_mesh_is_shown_over_its_scene(bpy: Any, view: Any) -> None:
    """Though the window has come to another while it was prepared; over none if that is gone."""
    from accelscope.core.progress import SILENT
    from accelscope.operators.teach import ACCELSCOPE_OT_teach as Operator

    bpy.ops.mesh.primitive_cube_add()
    home, asked = bpy.context.scene, SimpleNamespace(subject="MESH", lesson="levels")
    asked.give_up = lambda: None
    result = Operator.prepare(asked, bpy.context)(SILENT)
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    assert Operator.finish(asked, bpy.context, result) == view.lesson.label
    assert view.is_in(home)
    assert not view.is_in(bpy.context.scene)
    view.clear()
    bpy.data.scenes.remove(home)
    assert Operator.finish(asked, bpy.context, result) == ""
    assert view.lesson is None


def test_a_lesson_says_when_the_mesh_is_another(
    bpy: Any, root: Any, view: Any, current: Any
) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    root.teaching.lesson = "levels"
    bpy.ops.accelscope.use_my_mesh()
    assert current.lesson_change(bpy.context) == ""
    bpy.context.object.location.x = 3.0
    look = current.lesson_look
    look.compare(bpy.context.evaluated_depsgraph_get())
    assert current.lesson_change(bpy.context) == "Suzanne has moved"
    bpy.ops.accelscope.use_my_mesh()
    assert current.lesson_change(bpy.context) == ""
    bpy.ops.accelscope.end_lesson()
    assert current.lesson_look is None


def test_without_a_mesh_there_is_one_line(bpy: Any, view: Any) -> None:
    from accelscope.addon import jobs
    from accelscope.addon.results import lesson_view

    with pytest.raises(RuntimeError, match="no mesh"):
        bpy.ops.accelscope.teach(subject="MESH")
    assert "no mesh" in jobs.refusal(lesson_view.TEACH)
    assert jobs.refusal("ACCELSCOPE_OT_build") == ""
    assert view.lesson is None


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


def test_a_draft_is_shown_until_the_play_is_finished(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed
) -> None:
    example.go.clear()
    example.has_draft = True
    knobs.kind = "other"
    windowed.tick()
    (operator,), job = windowed.begun, jobs.running()
    assert example.offered.wait(60.0)
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
    assert view.picture.caption == "1 draft of other"
    knobs.count = 3  # a knob that plays nothing anew
    assert view.picture.caption == "3 draft of other"
    assert (jobs.running(), windowed.timers) == (job, [])
    example.go.set()
    job.wait(60.0)
    assert operator.modal(context, TIMER) == {"FINISHED"}
    assert view.picture.caption == "3 other"


def test_a_draft_stays_after_esc_and_the_next_knob_plays_all(
    view: Any, example: Any, knobs: Any, jobs: Any, context: Any, windowed: Windowed
) -> None:
    example.go.clear()
    example.has_draft = True
    knobs.kind = "other"
    windowed.tick()
    (operator,), job = windowed.begun, jobs.running()
    assert example.offered.wait(60.0)
    assert operator.modal(context, TIMER) == {"PASS_THROUGH"}
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


def test_next_teaches_the_next(
    bpy: Any, root: Any, view: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.addon.results import lesson_view

    asked: list[tuple[str, str]] = []
    monkeypatch.setattr(
        lesson_view, "ask", lambda operator, scene, subject: asked.append((operator, subject))
    )
    place = NAMES.index("levels")
    root.teaching.lesson = NAMES[place - 1]
    assert asked == []  # none is taught yet
    bpy.ops.accelscope.step_lesson(by=1)
    bpy.ops.accelscope.teach()
    assert view.lesson.name == "levels"
    bpy.ops.accelscope.step_lesson(by=1)
    assert asked == [("teach", "SAMPLE")]
    bpy.ops.accelscope.end_lesson()
    # The user's scene goes on from there.
    assert bpy.context.scene.accelscope.teaching.lesson == NAMES[place + 1]


def test_undo_shows_what_it_brings_back(bpy: Any, view: Any, knobs: Any) -> None:
    from accelscope.addon.results import lesson_view

    knobs.count = 3
    view.settings = None  # as if it were another's
    lesson_view._after_undo()
    assert view.settings.count == 3
    view.owner = 0
    lesson_view._after_undo()
    assert view.lesson is None


def test_sources_of_lessons_are_there(bpy: Any) -> None:
    from accelscope.addon.to_blender.source_text import path_of

    for lesson in lessons().values():
        assert path_of(lesson.source).is_file(), lesson.name
