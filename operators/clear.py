"""Drop the results."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.results import session


class ACCELSCOPE_OT_clear(bpy.types.Operator):
    bl_idname = "accelscope.clear"
    bl_label = "Clear"
    bl_description = "Drop the structure and the figures, and draw nothing"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.built is None:
            cls.poll_message_set("There is nothing to clear")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        session.current.clear()
        jobs.forget_refusal()
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_clear,)
