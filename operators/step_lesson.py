"""Go to the next or the previous lesson."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty


class ACCELSCOPE_OT_step_lesson(bpy.types.Operator):
    bl_idname = "accelscope.step_lesson"
    bl_label = "Step Lesson"
    bl_description = "Go to another lesson"
    bl_options = {"INTERNAL"}

    by: IntProperty(name="By", description="How many lessons forwards", default=1)  # type: ignore[valid-type]

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        return "Next lesson of the lecture" if properties.by > 0 else "Previous lesson"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..core.lessons import lessons

        names, teaching = list(lessons()), context.scene.accelscope.teaching
        place = names.index(teaching.lesson) + self.by
        if 0 <= place < len(names):
            teaching.lesson = names[place]
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_step_lesson,)
