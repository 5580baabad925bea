"""Stop what is running: the button beside the progress bar."""

from __future__ import annotations

import bpy

from ..addon import jobs


class ACCELSCOPE_OT_cancel(bpy.types.Operator):
    bl_idname = "accelscope.cancel"
    bl_label = "Cancel"
    bl_description = "Stop what is running; the previous result stays"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return jobs.running() is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        jobs.cancel()
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_cancel,)
