"""What a lesson on a mesh of one file kept an eye on is forgotten when another is loaded."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


def test_nothing_is_watched_after_loading(bpy: Any) -> None:
    from accelscope.addon.from_blender import watching
    from accelscope.addon.results import session

    bpy.ops.mesh.primitive_cube_add()
    bpy.context.scene.accelscope.teaching.lesson = "levels"
    assert bpy.ops.accelscope.teach(subject="MESH") == {"FINISHED"}
    assert len(watching.watched) == 1
    bpy.ops.wm.read_homefile(use_empty=True)
    assert session.current.lesson_look is None
    assert watching.watched == []
