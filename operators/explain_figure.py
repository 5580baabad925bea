"""Say what a figure means: the label of a figure, whose tooltip that is."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty


class ACCELSCOPE_OT_explain_figure(bpy.types.Operator):
    bl_idname = "accelscope.explain_figure"
    bl_label = "Figure"
    bl_description = "What this figure means"
    bl_options = {"INTERNAL"}

    meaning: StringProperty(name="Meaning", description="What the figure means")  # type: ignore[valid-type]

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        return properties.meaning

    def execute(self, context: bpy.types.Context) -> set[str]:
        self.report({"INFO"}, self.meaning)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_explain_figure,)
