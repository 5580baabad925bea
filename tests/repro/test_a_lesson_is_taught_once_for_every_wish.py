"""Naming the lesson that is taught now is no wish for another: it is prepared once, not again."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def prepared(bpy: Any, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The subjects of all lessons that are prepared."""
    from accelscope.operators.teach import ACCELSCOPE_OT_teach as Operator

    subjects: list[str] = []
    prepare = Operator.prepare

    def note(self: Any, context: Any) -> Any:
        subjects.append(self.subject)
        return prepare(self, context)

    monkeypatch.setattr(Operator, "prepare", note)
    return subjects


def test_the_next_lesson_on_a_sample(bpy: Any, view: Any, prepared: list[str]) -> None:
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    bpy.ops.accelscope.teach()
    teaching = bpy.context.scene.accelscope.teaching
    teaching.lesson = "split_plane"
    assert prepared == ["SAMPLE", "SAMPLE"]
    assert (view.lesson.name, teaching.lesson) == ("split_plane", "split_plane")
    bpy.ops.accelscope.step_lesson(by=-1)
    assert len(prepared) == 3
    assert view.lesson.name == teaching.lesson


def test_the_next_lesson_on_the_users_mesh(bpy: Any, view: Any, prepared: list[str]) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    teaching = bpy.context.scene.accelscope.teaching
    teaching.lesson = "sah_decision"
    bpy.ops.accelscope.teach(subject="MESH")
    teaching.lesson = "ray"
    assert prepared == ["MESH", "MESH"]
    assert (view.lesson.name, view.is_own) == ("ray", True)


@pytest.mark.parametrize("before", ["sah_decision", "ray"])
def test_a_ray_that_is_stepped_during_a_lesson(
    bpy: Any, root: Any, view: Any, current: Any, prepared: list[str], before: str
) -> None:
    """About what was built, and never about something else first."""
    bpy.ops.mesh.primitive_monkey_add()
    root.workload, root.workloads.random_lines.count = "random_lines", 5
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.trace()
    root.teaching.lesson = before
    bpy.ops.accelscope.teach(subject="MESH")
    assert bpy.ops.accelscope.step_ray() == {"FINISHED"}
    assert prepared == ["MESH", "BUILT"]
    assert (view.lesson.name, root.teaching.lesson) == ("ray", "ray")
    assert view.subject.rays is current.traced.rays


def test_a_ray_that_cannot_be_stepped_leaves_the_list_as_it_is(
    bpy: Any, root: Any, view: Any, current: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.core.errors import InputError
    from accelscope.operators.teach import ACCELSCOPE_OT_teach as Operator

    bpy.ops.mesh.primitive_monkey_add()
    root.workload, root.workloads.random_lines.count = "random_lines", 5
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.trace()
    root.teaching.lesson = "sah_decision"

    def refuse(self: Any, context: Any) -> Any:
        raise InputError("not now")

    monkeypatch.setattr(Operator, "prepare", refuse)
    bpy.ops.accelscope.step_ray()
    assert root.teaching.lesson == "sah_decision"
    assert view.lesson is None
