"""Panel: trace rays, and step through one of them."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs, session
from .base import SidebarPanel, draw_figure, draw_group, draw_job, draw_wrapped


class VIEW3D_PT_accelscope_rays(SidebarPanel, bpy.types.Panel):
    bl_label = "Rays"
    bl_order = 2

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        layout.prop(root, "workload")
        draw_group(layout, getattr(root.workloads, root.workload))
        job = jobs.running()
        if job:
            # Here too, since the panel above may be scrolled out of sight.
            draw_job(layout, job)
        else:
            row = layout.row()
            row.scale_y = 1.4
            row.operator("accelscope.trace")

        column = layout.column(align=True)
        column.prop(root, "ray_index")
        column.operator("accelscope.step_ray")
        current = session.current
        if current.steps is None:
            return
        text = f"Ray {current.step_index} {current.hit_text()}"
        draw_wrapped(layout, text, "TRACKING_FORWARDS", context.region.width)
        grid = layout.column(align=True)
        for name, value in current.steps.tally().items():
            draw_figure(grid, name, str(value))


CLASSES = (VIEW3D_PT_accelscope_rays,)
