"""Panel: run a program of DXR's five kinds of shaders."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from .base import SidebarPanel, draw_figure, draw_job, draw_wrapped


class VIEW3D_PT_accelscope_pipeline(SidebarPanel, bpy.types.Panel):
    bl_label = "Ray Tracing Pipeline"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        layout.prop(root.pipeline, "program")
        # The camera is that of the rays Camera, which has the rest of its settings there.
        size = layout.column(align=True)
        size.prop(root.workloads.camera, "width")
        size.prop(root.workloads.camera, "height")
        job = jobs.running()
        if job:
            # Here too, since the panel above may be scrolled out of sight.
            draw_job(layout, job, context.region.width)
        else:
            row = layout.row()
            row.scale_y = 1.4
            row.operator("accelscope.run_program").text = ""
        row = layout.row(align=True)
        row.operator("accelscope.copy_program", icon="TEXT")
        row.menu("VIEW3D_MT_accelscope_programs")
        if refusal := jobs.refusal("ACCELSCOPE_OT_run_program"):
            draw_wrapped(layout, refusal, "ERROR", context.region.width)
        if session.current.launched is not None:
            draw_calls(layout, session.current.launched)


def draw_calls(layout: bpy.types.UILayout, record: dict[str, Any]) -> None:
    """Draw how often each stage was called, for each class of rays."""
    from ..core.printing import show_integer

    column = layout.column(align=True)
    program, launch = record["program"], record["launch"]
    column.label(text=f"Calls of {program['name']}", translate=False)
    for name, calls in launch["by_class"].items():
        for stage, count in calls.items():
            if count:
                words = stage.replace("_", " ")
                draw_figure(column, f"{name}: {words}", show_integer(count))


CLASSES = (VIEW3D_PT_accelscope_pipeline,)
