"""Make the frame of an exhibit that the panel asks for, and draw it."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs, session
from ..core.progress import Progress


class ACCELSCOPE_OT_show_frame(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.show_frame"
    bl_label = "Show Frame"
    bl_description = (
        "Make this frame of the exhibit and draw it. It may take as long as a build; Esc stops it"
    )
    bl_options = {"INTERNAL"}

    job_text = "Making the frame"
    head_start = 0.2

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if not session.current.showcase.exhibits:
            cls.poll_message_set("Build a structure that has exhibits first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        group = context.scene.accelscope.exhibits
        showcase = session.current.showcase
        key = showcase.wanted(group)

        def work(progress: Progress) -> tuple[Any, ...]:
            if key is None or key in showcase.frames:
                return showcase, key, None
            return showcase, key, showcase.make(key)

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        showcase, key, frame = result
        if frame is not None:
            showcase.keep(key, frame)
        # The panel may ask for another frame by now.
        session.current.show_exhibit(context)
        return ""


CLASSES = (ACCELSCOPE_OT_show_frame,)
