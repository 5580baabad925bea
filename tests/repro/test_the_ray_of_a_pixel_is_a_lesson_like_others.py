"""The lesson that Step This Ray goes to outlives undo over its sample, and has its own film."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def home(bpy: Any) -> Any:
    """The user's scene, in which the lesson on a heat map is chosen."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_monkey_add()
    scene.accelscope.teaching.lesson = "heat_map"
    scene.accelscope.lessons.heat_map.width = 16
    bpy.ops.ed.undo_push(message="start")
    return scene


@pytest.mark.parametrize("subject", ["SAMPLE", "MESH"])
def test_undo_of_something_else_leaves_it(bpy: Any, home: Any, view: Any, subject: str) -> None:
    bpy.ops.accelscope.teach(subject=subject)
    bpy.ops.ed.undo_push(message="taught")
    assert bpy.ops.accelscope.step_this_ray() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="stepped")
    bpy.context.scene.frame_end = 99
    bpy.ops.ed.undo_push(message="frames")
    bpy.ops.ed.undo()
    assert bpy.context.scene.frame_end != 99
    assert view.lesson is not None
    assert view.lesson.name == "ray"
    assert view.is_in(bpy.context.scene)
    # Before it there is the heat map, of which the ray is none.
    bpy.ops.ed.undo()
    assert view.lesson is None


def test_a_ray_does_not_stay_over_the_sample_of_another(bpy: Any, home: Any, view: Any) -> None:
    bpy.ops.accelscope.teach()
    bpy.ops.accelscope.step_this_ray()
    bpy.ops.ed.undo_push(message="stepped")
    bpy.ops.accelscope.teach()
    own = len(view.subject.scene)
    bpy.ops.ed.undo_push(message="taught on its own sample")
    bpy.ops.ed.undo()
    meshes = [obj.data for obj in bpy.context.scene.objects if obj.type == "MESH"]
    assert sum(len(mesh.polygons) for mesh in meshes) != own
    assert view.lesson is None


def test_its_film_is_on_the_timeline_if_there_was_one(bpy: Any, home: Any, view: Any) -> None:
    from accelscope.addon.results import film

    bpy.ops.accelscope.teach(subject="MESH")
    before = home.frame_start, home.frame_end
    bpy.ops.accelscope.film_on_timeline()
    frames = home.frame_end
    bpy.ops.accelscope.step_this_ray()
    assert len(film.values()) != frames
    assert home.frame_end == home.frame_start + len(film.values()) - 1
    bpy.ops.accelscope.end_lesson()
    assert (home.frame_start, home.frame_end) == before
