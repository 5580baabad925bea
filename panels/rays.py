"""Panel: trace rays, and step through one of them."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from .base import (
    SidebarPanel,
    draw_job,
    draw_settings,
)


class VIEW3D_PT_accelscope_rays(SidebarPanel, bpy.types.Panel):
    bl_label = "Rays"
    bl_order = 3

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        from ..core.evaluation.rays.workloads import workload_named

        layout.prop(root, "workload")
        group = getattr(root.workloads, root.workload)
        draw_settings(layout, group, workload_named(root.workload).Settings)
        job = jobs.running()
        if job:
            # Here too, since the panel above may be scrolled out of sight.
            draw_job(layout, job, context.region.width)
        else:
            row = layout.row()
            row.scale_y = 1.4
            row.operator("accelscope.trace")

        layout.operator("accelscope.step_ray")
        traced = session.current.traced
        if traced is not None and traced.outcome is not None:
            layout.operator("accelscope.keep_picture", icon="IMAGE_DATA")


CLASSES = (VIEW3D_PT_accelscope_rays,)
