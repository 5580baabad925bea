"""Move the viewport so that it shows the whole lesson."""

from __future__ import annotations

import bpy

from ..addon.results import lesson_view


class ACCELSCOPE_OT_view_lesson(bpy.types.Operator):
    bl_idname = "accelscope.view_lesson"
    bl_label = "View All"
    bl_description = (
        "Move the view so that the scene and all that is drawn of the lesson are in it: charts "
        "stand beside the model"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not lesson_view.is_taught(cls, context):
            return False
        return context.area is not None and context.area.type == "VIEW_3D"

    def execute(self, context: bpy.types.Context) -> set[str]:
        lesson_view.current.frame(context, context.area)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_view_lesson,)
