"""Go to the next or the previous frame of the exhibit."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

from ..addon.results import session


class ACCELSCOPE_OT_step_frame(bpy.types.Operator):
    bl_idname = "accelscope.step_frame"
    bl_label = "Step Frame"
    bl_description = "Go to another frame of the exhibit"
    bl_options = {"INTERNAL"}

    by: IntProperty(name="By", description="How many frames forwards", default=1)  # type: ignore[valid-type]

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        return "Go to the next frame" if properties.by > 0 else "Go to the previous frame"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not session.current.showcase.exhibits:
            cls.poll_message_set("Build a structure that has exhibits first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        group = context.scene.accelscope.exhibits
        group.frame = max(group.frame + self.by, 0)
        group.show = True
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_step_frame,)
