"""Copy the source of a program of the pipeline into a text, to make it another one."""

from __future__ import annotations

import bpy

from ..addon.to_blender import source_text


class ACCELSCOPE_OT_copy_program(bpy.types.Operator):
    bl_idname = "accelscope.copy_program"
    bl_label = "Copy as Text"
    bl_description = (
        "Copy the source of the program into a text of this file, to read it or make it another one"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..core.pipeline.loading import source_of

        name = context.scene.accelscope.pipeline.program
        text = bpy.data.texts.new(f"{name}.py")
        text.write(source_of(name))
        text.cursor_set(0)
        editor = source_text.editor_in(context) or source_text.new_editor()
        if editor is not None:
            source_text.show(editor, text)
        self.report({"INFO"}, f"{text.name} is a text of this file now; Run a Text runs it")
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_copy_program,)
