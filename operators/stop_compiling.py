"""Stop compiling ahead."""

from __future__ import annotations

import bpy

from ..addon import compile_ahead


class ACCELSCOPE_OT_stop_compiling(bpy.types.Operator):
    bl_idname = "accelscope.stop_compiling"
    bl_label = "Stop Compiling Ahead"
    bl_description = (
        "Stop it for now: what is not compiled yet will be at its first use. The preferences of "
        "the add-on turn it off for good"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return compile_ahead.running() is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        compile_ahead.stop()
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_stop_compiling,)
