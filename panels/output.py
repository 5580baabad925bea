"""Panel: keep cells as a mesh, and figures as a file."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from .base import SidebarPanel, draw_job


class VIEW3D_PT_accelscope_output(SidebarPanel, bpy.types.Panel):
    bl_label = "Bake and Export"
    bl_order = 6

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        job = jobs.running()
        if job:
            # Here too, since the panel above may be scrolled out of sight.
            draw_job(layout, job, context.region.width)
        else:
            layout.operator("accelscope.bake", icon="MESH_CUBE")
        row = layout.row(align=True)
        row.operator("accelscope.export", text="Export JSON", icon="EXPORT").format = "JSON"
        row.operator("accelscope.export", text="Export CSV").format = "CSV"


CLASSES = (VIEW3D_PT_accelscope_output,)
