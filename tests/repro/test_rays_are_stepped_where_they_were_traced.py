"""Step Ray shows a ray over the scene that was built over, never over another of the file."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def traced(bpy: Any, root: Any) -> Any:
    """The scene that was built over and traced in."""
    bpy.ops.mesh.primitive_monkey_add()
    root.workload, root.workloads.random_lines.count = "random_lines", 5
    root.teaching.lesson = "sah_decision"
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.trace()
    assert bpy.ops.accelscope.step_ray.poll()
    return bpy.context.scene


def test_another_scene_of_the_file(bpy: Any, traced: Any) -> None:
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    assert not bpy.ops.accelscope.step_ray.poll()
    bpy.context.window.scene = traced
    assert bpy.ops.accelscope.step_ray.poll()


def test_the_scene_of_a_lesson(bpy: Any, traced: Any) -> None:
    from accelscope.addon.results import lesson_view

    bpy.ops.accelscope.teach()
    assert bpy.context.scene != traced
    assert not bpy.ops.accelscope.step_ray.poll()
    bpy.ops.accelscope.end_lesson()
    assert bpy.ops.accelscope.step_ray() == {"FINISHED"}
    assert lesson_view.current.is_in(traced)


def test_what_was_built_elsewhere_is_not_what_is_taught_here(
    bpy: Any, traced: Any, current: Any
) -> None:
    """Whoever calls Teach by its name gets the mesh of the scene."""
    from accelscope.addon.results import lesson_view

    bpy.context.window.scene = bpy.data.scenes.new("Other")
    bpy.ops.mesh.primitive_cube_add()
    assert bpy.ops.accelscope.teach(subject="BUILT") == {"FINISHED"}
    view = lesson_view.current
    assert view.is_in(bpy.context.scene)
    assert len(view.subject.scene) == 12
