"""End Lesson ends the lesson of the scene that its window shows; that of another goes on.

One window stands for two here: it shows one scene, then the other.
"""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def window(bpy: Any) -> Any:
    """The window, with a mesh in its scene and a lesson chosen."""
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    return bpy.context.window


def names(bpy: Any) -> list[str]:
    return [scene.name for scene in bpy.data.scenes]


@pytest.fixture
def two(bpy: Any, window: Any, view: Any) -> tuple[Any, Any]:
    """The scenes of two lessons on samples; the second is taught."""
    window.scene.accelscope.teaching.lesson = "sah_decision"
    bpy.ops.accelscope.teach()
    first = window.scene
    window.scene = bpy.data.scenes.new("Second")
    window.scene.accelscope.teaching.lesson = "ray"
    bpy.ops.accelscope.teach()
    second = window.scene
    assert first != second
    assert view.is_in(second)
    return first, second


def test_the_one_that_is_not_shown_any_more(
    bpy: Any, window: Any, view: Any, two: tuple[Any, Any]
) -> None:
    first, second = two
    bpy.ops.accelscope.read_source()
    window.scene = first
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert window.scene.name == "Scene"
    assert view.lesson.name == "ray"
    assert view.is_in(second)
    assert len(bpy.data.texts) == 1
    window.scene = second
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert window.scene.name == "Second"
    assert view.lesson is None
    assert names(bpy) == ["Scene", "Second"]
    assert len(bpy.data.texts) == 0


def test_the_one_that_is_shown(bpy: Any, window: Any, view: Any, two: tuple[Any, Any]) -> None:
    first, _ = two
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert window.scene.name == "Second"
    assert view.lesson is None
    window.scene = first
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert names(bpy) == ["Scene", "Second"]


def test_a_scene_without_a_lesson_has_none_to_end(bpy: Any, window: Any, view: Any) -> None:
    bpy.ops.accelscope.teach()
    taught = window.scene
    window.scene = bpy.data.scenes["Scene"]
    assert not bpy.ops.accelscope.end_lesson.poll()
    window.scene = taught
    assert bpy.ops.accelscope.end_lesson.poll()


def test_one_on_the_users_mesh_goes_on(bpy: Any, window: Any, view: Any) -> None:
    """Though the scene of the other goes back to the same one, and has another lesson chosen."""
    home = window.scene
    bpy.ops.accelscope.teach()
    sample = window.scene
    window.scene = home
    home.accelscope.teaching.lesson = "ray"
    bpy.ops.accelscope.teach(subject="MESH")
    play = view.play
    window.scene = sample
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert window.scene == home
    assert view.is_in(home)
    assert view.play is play
    assert home.accelscope.teaching.lesson == "ray"


def test_a_lesson_whose_scene_is_gone_can_be_ended(bpy: Any, window: Any, view: Any) -> None:
    """The user has removed it by hand: viewports are as they were afterwards."""
    from accelscope.addon.drawing.viewport import largest

    overlay = largest(window).spaces.active.overlay
    overlay.show_floor = True
    bpy.ops.accelscope.teach()
    assert not overlay.show_floor
    bpy.data.scenes.remove(window.scene)
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert view.lesson is None
    assert overlay.show_floor
    assert not bpy.ops.accelscope.end_lesson.poll()
