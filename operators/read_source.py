"""Open the file that does what the lesson shows in Blender's text editor."""

from __future__ import annotations

import bpy

from ..addon.results import lesson_view
from ..addon.to_blender import source_text


class ACCELSCOPE_OT_read_source(bpy.types.Operator):
    bl_idname = "accelscope.read_source"
    bl_label = "Read the Source"
    bl_description = (
        "Open the file that does what is shown in Blender's text editor: in one that is open, or "
        "in a new window. It is a copy, which goes when the lesson ends"
    )
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        lesson = lesson_view.chosen(context.scene)
        text = source_text.open_text(lesson.source)
        editor = source_text.editor_in(context) or source_text.new_editor()
        if editor is None:
            self.report({"INFO"}, f"Choose the text {text.name} in a text editor")
        else:
            source_text.show(editor, text)
            self.report({"INFO"}, f"{text.name} is in the text editor")
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_read_source,)
