"""Programs of the ray tracing pipeline in a real Blender window: button, picture, calls, lesson.

    .venv/bin/python .ci/build_extension.py --platform linux-x64 --output build/window/extension
    .ci/blender_window.sh tests/window/pipeline.py build/window/pipeline [-- ZIP]

A shipped program is run with the button of the panel, and its picture opens in an image editor; a
copy of it, changed, is run as a text; and the stages light up in the lesson.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    build,
    install,
    open_wide_tab,
    results,
    running,
    sample,
    session,
    settings,
    station,
)
from session import Steps

BELOW = 42
"""Pixels from the last button of the panel above to the header of the pipeline's."""


@session.step
def prepare() -> Steps:
    """A monkey before a camera, a structure, and the panel opened."""
    install()
    yield from open_wide_tab()
    sample("suzanne")
    bpy.ops.object.camera_add(location=(2.2, -4.2, 1.2), rotation=(1.35, 0.0, 0.48))
    bpy.context.scene.camera = bpy.context.object
    bpy.ops.object.light_add(type="POINT", location=(-3.0, -3.0, 5.0))
    bpy.ops.object.select_all(action="DESELECT")
    yield from build()
    x, y = yield from session.find("accelscope.step_ray(")
    session.click(x, y - BELOW)
    yield 1.0
    yield from session.find("accelscope.run_program(")
    station("panel")


@session.step
def run_a_program() -> Steps:
    """The button runs it; the picture is in an image editor of a new window."""
    settings().pipeline.program = "shadows"
    yield 0.5
    yield from session.press("accelscope.run_program(")
    yield lambda: running() is None and results().launched is not None
    yield 2.0
    station("picture")
    windows = bpy.context.window_manager.windows
    shown = [
        area.spaces.active.image
        for window in windows
        for area in window.screen.areas
        if area.type == "IMAGE_EDITOR"
    ]
    assert [image.name for image in shown] == ["shadows"]
    launch = results().launched["launch"]
    assert launch["by_class"]["shadow"]["trace_ray"] > 1000
    with bpy.context.temp_override(window=windows[1]):
        bpy.ops.wm.window_close()
    yield 1.0
    yield from session.find("accelscope.run_program(")
    station("calls")


@session.step
def run_a_text() -> Steps:
    """A copy of the lecture's program with other colours is a text, and is run as one."""
    settings().pipeline.program = "lecture"
    text = bpy.data.texts.new("mine.py")
    source = sys.modules[f"{type(results()).__module__.rpartition('.addon')[0]}"]
    program = Path(source.__file__).parent / "core" / "pipeline" / "programs" / "lecture.py"
    text.write(program.read_text(encoding="utf-8").replace("output.color = payload.color",
               "output.color = (1.0, payload.color[1], 0.0, 1.0)"))  # fmt: skip
    before = results().launched
    bpy.ops.accelscope.run_program("INVOKE_DEFAULT", text="mine.py")
    yield lambda: running() is None and results().launched is not before
    yield 1.0
    station("text")
    assert results().launched["program"]["name"] == "mine.py"


@session.step
def teach_it() -> Steps:
    """The stages light up beside the model."""
    for window in list(bpy.context.window_manager.windows)[1:]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.window_close()
    settings().teaching.lesson = "pipeline_states"
    bpy.ops.accelscope.teach("INVOKE_DEFAULT", subject="SAMPLE")
    yield lambda: running() is None
    yield 2.0
    settings().lessons.pipeline_states.state = 9
    yield 1.0
    station("lesson_states")
    settings().teaching.lesson = "closest_hit_shader"
    yield lambda: running() is None
    yield 3.0
    settings().lessons.closest_hit_shader.line = 6
    yield 1.0
    station("lesson_shader")


session.run()
