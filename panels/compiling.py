"""Panel: how far compiling ahead is, while it is under way."""

from __future__ import annotations

import bpy

from ..addon import compile_ahead


class VIEW3D_PT_accelscope_compiling(bpy.types.Panel):
    bl_label = "Preparing"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "AccelScope"
    bl_order = -1
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return compile_ahead.running() is not None

    def draw(self, context: bpy.types.Context) -> None:
        preparation = compile_ahead.running()
        if preparation is None:
            return
        share, what = preparation.done
        row = self.layout.row(align=True)
        row.progress(factor=share, text="Compiling Ahead")
        row.operator("accelscope.stop_compiling", text="", icon="X")
        column = self.layout.column(align=True)
        column.scale_y = 0.8
        column.label(text=what[:1].upper() + what[1:])
        column.label(text="All works meanwhile, but may have to wait")


CLASSES = (VIEW3D_PT_accelscope_compiling,)
