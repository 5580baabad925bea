"""What a lesson on a mesh of one file kept an eye on is forgotten when another is loaded."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.bpy


def test_nothing_is_watched_after_loading(bpy: Any) -> None:
    from accelscope.addon.from_blender import watching
    from accelscope.addon.results import session

    bpy.ops.mesh.primitive_cube_add()
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    assert bpy.ops.accelscope.teach(subject="MESH") == {"FINISHED"}
    assert len(watching.watched) == 1
    bpy.ops.wm.read_homefile(use_empty=True)
    assert session.current.lesson_look is None
    assert watching.watched == []


@pytest.fixture
def overlay(bpy: Any) -> Any:
    """What is drawn in the largest viewport, whichever it is."""
    from accelscope.addon.drawing.viewport import largest

    def now() -> Any:
        return largest(bpy.context.window).spaces.active.overlay

    now().show_floor = True
    return now


@pytest.mark.parametrize("subject", ["SAMPLE", "MESH"])
@pytest.mark.parametrize("load_ui", [False, True])
def test_viewports_are_as_they_were(
    bpy: Any, overlay: Any, tmp_path: Any, load_ui: bool, subject: str
) -> None:
    """Of the file before, which may go on in this one, and of a file saved during a lesson."""
    from accelscope.addon.results import lesson_view

    bpy.ops.mesh.primitive_cube_add()
    bpy.context.scene.accelscope.teaching.lesson = "sah_decision"
    bpy.ops.accelscope.teach(subject=subject)
    assert not overlay().show_floor
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=load_ui)
    assert lesson_view.current.lesson is None
    if subject == "SAMPLE":  # its scene is in the file, and End Lesson removes it
        bpy.ops.accelscope.end_lesson()
    assert overlay().show_floor


def test_viewports_go_on_in_a_file_without_a_lesson(bpy: Any, overlay: Any, tmp_path: Any) -> None:
    path = str(tmp_path / "without.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.accelscope.teach()
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
    assert overlay().show_floor
    # The next lesson is not told that floors were hidden.
    bpy.ops.accelscope.teach()
    bpy.ops.accelscope.end_lesson()
    assert overlay().show_floor
