"""Texts that Read the Source has opened go when the lesson ends, whatever it is about."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


@pytest.mark.parametrize("subject", ["SAMPLE", "MESH"])
def test_texts_go_when_the_lesson_ends(bpy: Any, subject: str) -> None:
    bpy.ops.mesh.primitive_cube_add()
    kept = bpy.data.texts.new("core/mine.py")
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    bpy.ops.accelscope.teach(subject=subject)
    bpy.ops.accelscope.read_source()
    bpy.context.scene.accelscope.teaching.lesson = "ray"
    bpy.ops.accelscope.read_source()
    assert len(bpy.data.texts) == 3
    bpy.ops.accelscope.end_lesson()
    assert list(bpy.data.texts) == [kept]


def test_texts_go_on_the_way_to_the_users_mesh(bpy: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    bpy.ops.accelscope.teach()
    bpy.ops.accelscope.read_source()
    bpy.ops.accelscope.use_my_mesh()
    assert len(bpy.data.texts) == 0
    bpy.ops.accelscope.read_source()
    bpy.ops.accelscope.end_lesson()
    assert len(bpy.data.texts) == 0
