"""Go to the next or the previous picture of the lesson's film."""

from __future__ import annotations

import bpy
from bpy.props import IntProperty

from ..addon.results import film, lesson_view


class ACCELSCOPE_OT_step_film(bpy.types.Operator):
    bl_idname = "accelscope.step_film"
    bl_label = "Step"
    bl_description = "Go to another picture"
    bl_options = {"INTERNAL"}

    by: IntProperty(name="By", description="How many pictures forwards", default=1)  # type: ignore[valid-type]

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        return "One step forwards" if properties.by > 0 else "One step back"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return lesson_view.is_taught(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        film.stop()
        film.go_to(context.scene, film.place(context.scene) + self.by)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_step_film,)
