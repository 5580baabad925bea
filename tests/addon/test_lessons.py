"""Lessons in Blender: taught in a scene of their own, or on the user's mesh, and the way back."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from accelscope.core.lessons import lessons
from accelscope.core.lessons.slides import SLIDES

NAMES = list(lessons())


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


def test_sources_of_lessons_are_there(bpy: Any) -> None:
    from accelscope.addon.to_blender.source_text import path_of

    for lesson in lessons().values():
        assert path_of(lesson.source).is_file(), lesson.name
