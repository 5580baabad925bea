"""The film of a lesson leaves the timeline of the scene it was put on, and no other, as it was."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def film(bpy: Any) -> Iterator[Any]:
    """The film, and in the scene a mesh and a timeline of the user's own."""
    from accelscope.addon.results import film, lesson_view

    bpy.ops.mesh.primitive_cube_add()
    scene = bpy.context.scene
    scene.accelscope.teaching.lesson = "levels"
    scene.frame_start, scene.frame_end = 3, 77
    scene.frame_set(5)
    bpy.ops.ed.undo_push(message="start")
    yield film
    lesson_view.current.clear()


def frames(scene: Any) -> tuple[int, int, int]:
    return scene.frame_start, scene.frame_end, scene.frame_current


def bind(bpy: Any) -> None:
    """Teach a lesson on the user's mesh, and put its film on the timeline."""
    assert bpy.ops.accelscope.teach(subject="MESH") == {"FINISHED"}
    bpy.ops.ed.undo_push(message="taught")
    assert bpy.ops.accelscope.film_on_timeline() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="bound")
    assert bpy.context.scene.frame_end < 77


def test_undo_takes_the_film_off(bpy: Any, film: Any) -> None:
    bind(bpy)
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert frames(scene) == (3, 77, 5)
    assert not film.is_on_timeline(scene)
    # What is done to the timeline from now on is the user's.
    scene.frame_end = 50
    bpy.ops.accelscope.end_lesson()
    assert scene.frame_end == 50


def test_redo_puts_it_on_again(bpy: Any, film: Any) -> None:
    bind(bpy)
    bound = frames(bpy.context.scene)
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    assert film.is_on_timeline(bpy.context.scene)
    assert frames(bpy.context.scene) == bound
    bpy.ops.accelscope.end_lesson()
    assert frames(bpy.context.scene) == (3, 77, 5)


def test_a_lesson_that_undo_does_not_bring_back_has_no_film_there(bpy: Any, film: Any) -> None:
    bind(bpy)
    bpy.ops.accelscope.end_lesson()
    bpy.ops.ed.undo_push(message="ended")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert not film.is_on_timeline(scene)
    assert frames(scene) == (3, 77, 5)


def test_a_lesson_in_another_scene_leaves_both_timelines(bpy: Any, film: Any) -> None:
    first = bpy.context.scene
    bind(bpy)
    other = bpy.data.scenes.new("Other")
    other.frame_end = 120
    bpy.context.window.scene = other
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.accelscope.teach(subject="MESH")
    assert (frames(first), frames(other)) == ((3, 77, 5), (1, 120, 1))
    bpy.ops.accelscope.end_lesson()
    assert (frames(first), frames(other)) == ((3, 77, 5), (1, 120, 1))


def test_a_sample_is_taught_after_the_users_mesh(bpy: Any, film: Any) -> None:
    home = bpy.context.scene
    bind(bpy)
    bpy.ops.accelscope.teach(subject="SAMPLE")
    assert bpy.context.scene != home
    assert not film.is_on_timeline(bpy.context.scene)
    assert frames(home) == (3, 77, 5)


def test_the_next_lesson_in_the_same_scene_has_its_film_there(bpy: Any, film: Any) -> None:
    bind(bpy)
    scene = bpy.context.scene
    scene.accelscope.teaching.lesson = "ray"
    assert film.is_on_timeline(scene)
    assert scene.frame_end == 3 + len(film.values()) - 1
    bpy.ops.accelscope.end_lesson()
    assert frames(scene) == (3, 77, 5)


def test_a_file_that_was_saved_meanwhile(bpy: Any, film: Any, tmp_path: Path) -> None:
    bind(bpy)
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert frames(bpy.context.scene) == (3, 77, 5)
    assert not film.is_on_timeline(bpy.context.scene)
