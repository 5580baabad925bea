"""Run a program of the ray tracing pipeline over the camera's view."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import StringProperty

from ..addon import jobs
from ..addon.from_blender.view import View
from ..addon.results import session
from ..addon.results.outcome import seen_from
from ..addon.settings.generated import read
from ..addon.to_blender.images import open_image
from ..core.errors import InputError
from ..core.progress import Progress


class ACCELSCOPE_OT_run_program(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.run_program"
    bl_label = "Run Program"
    bl_description = (
        "Run the program's shaders for every pixel of the camera, against the structure that was "
        "built, and open the picture. Esc stops it"
    )
    bl_options = {"REGISTER"}

    job_text = "Running the program"
    refused_text = "Not run"

    # Named at each call, and kept nowhere: what a file says must not decide which code is run.
    text: StringProperty(  # type: ignore[valid-type]
        name="Text",
        description="Name of a text of this file that is a program; its Python is run. Empty for "
        "the program that is chosen",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        if not properties.text:
            return cls.bl_description
        return f"Run the Python of the text {properties.text}, and its shaders for every pixel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.built is None:
            cls.poll_message_set("Build a structure first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.evaluation.records import launched
        from ..core.evaluation.records.experiment import build
        from ..core.pipeline.loading import program_from, program_named

        root = context.scene.accelscope
        view_settings = read(root.workloads.camera, launched.LaunchSettings, "Camera")
        name = self.text or root.pipeline.program
        if self.text:
            text = bpy.data.texts.get(self.text)
            if text is None:
                raise InputError(f"there is no text {self.text} in this file")
            program = program_from(text.as_string(), self.text)
        else:
            program = program_named(name)
        built, snapshot = session.current.built, session.current.snapshot
        assert built is not None
        assert snapshot is not None
        view = View.of(context)

        def work(progress: Progress) -> Any:
            seen = seen_from(built, snapshot.shape, view)
            structure = seen.structure
            scene = launched.seen_by(program, structure.scene)
            if scene is not structure.scene:
                seen = build(scene, type(structure), structure.settings, progress)
            made = launched.run(seen, program, view_settings, progress=progress)
            record = launched.make_record(seen, name, made, view_settings, 0)
            return made.launched.picture, record

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        from ..core.evaluation.records.report import show_number
        from ..core.lessons.picture import Image
        from ..core.printing import show_integer

        picture, record = result
        session.current.launched = record
        launch = record["launch"]
        name = open_image(context, Image(record["program"]["name"], picture))
        calls = ", ".join(
            f"{stage.replace('_', ' ')} {show_integer(count)}"
            for stage, count in launch["calls"].items()
            if count
        )
        speed = show_number(launch["rays_per_second"] / 1e6)
        return f"Image {name}; {speed} million rays a second; calls: {calls}"


class VIEW3D_MT_accelscope_programs(bpy.types.Menu):
    bl_idname = "VIEW3D_MT_accelscope_programs"
    bl_label = "Run a Text"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        for text in bpy.data.texts:
            button = layout.operator(
                "accelscope.run_program", text=text.name, icon="TEXT", translate=False
            )
            button.text = text.name
        if not bpy.data.texts:
            layout.label(text="There is no text in this file")


CLASSES = (ACCELSCOPE_OT_run_program, VIEW3D_MT_accelscope_programs)
