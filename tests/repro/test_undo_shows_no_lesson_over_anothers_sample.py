"""Undo brings back the sample of the lesson before: the one that came after it is not shown there.

The list may name the later one already: a choice is a step of its own before the lesson is taught.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def view(bpy: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """What is shown after two lessons, each chosen and taught in steps of its own."""
    from accelscope.addon.results import lesson_view

    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.ed.undo_push(message="start")
    monkeypatch.setattr(lesson_view, "ask", lambda *_, **__: None)
    for name in ("sah_decision", "split_plane"):
        bpy.context.scene.accelscope.teaching.lesson = name
        bpy.ops.ed.undo_push(message="chosen")
        assert bpy.ops.accelscope.teach() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="taught")
    yield lesson_view.current
    lesson_view.current.clear()


def polygons(scene: Any) -> list[int]:
    return [len(obj.data.polygons) for obj in scene.objects if obj.type == "MESH"]


def test_the_lesson_goes_with_its_sample(bpy: Any, view: Any) -> None:
    later = polygons(bpy.context.scene)
    assert later == [len(view.subject.scene)]
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert scene.accelscope.teaching.lesson == "split_plane"
    assert polygons(scene) != later
    assert view.lesson is None
    # It is taught anew from there, and ended.
    bpy.ops.accelscope.teach()
    assert polygons(bpy.context.scene) == later
    bpy.ops.accelscope.end_lesson()
    assert [each.name for each in bpy.data.scenes] == ["Scene"]


def test_it_stays_with_its_sample(bpy: Any, view: Any) -> None:
    bpy.context.scene.frame_end = 99
    bpy.ops.ed.undo_push(message="frames")
    bpy.ops.ed.undo()
    assert view.lesson.name == "split_plane"
    assert view.is_in(bpy.context.scene)


def test_a_mesh_that_a_lesson_was_about_is_watched_no_more(bpy: Any, current: Any) -> None:
    from accelscope.addon.from_blender import watching
    from accelscope.addon.results import lesson_view

    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    bpy.ops.ed.undo_push(message="start")
    bpy.context.scene.accelscope.teaching.lesson = "ray"
    bpy.ops.ed.undo_push(message="chosen")
    bpy.ops.accelscope.teach(subject="MESH")
    bpy.ops.ed.undo_push(message="taught")
    assert len(watching.watched) == 1
    bpy.ops.ed.undo()
    assert lesson_view.current.lesson is not None
    bpy.ops.ed.undo()
    assert lesson_view.current.lesson is None
    assert current.lesson_look is None
    assert watching.watched == []
