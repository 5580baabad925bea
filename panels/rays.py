"""Panel: trace rays, and step through one of them."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from ..addon.settings import properties
from .base import (
    SidebarPanel,
    draw_figure,
    draw_job,
    draw_range,
    draw_settings,
    draw_wrapped,
)

ICONS = {
    "inner": "MESH_CUBE",
    "leaf": "COLLECTION_COLOR_02",
    "empty": "COLLECTION_COLOR_05",
    "skipped": "COLLECTION_COLOR_06",
    "tested": "COLLECTION_COLOR_07",
    "postponed": "COLLECTION_COLOR_01",
    "found": "COLLECTION_COLOR_04",
}
"""Icons of about the colours in which a recorded ray is drawn."""


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

        current = session.current
        column = layout.column(align=True)
        if current.traced is not None:  # before, there is no ray that the field could stand at
            draw_range(column, root, "ray_index")
            cone = column.row(align=True)
            cone.active = current.built is not None and current.built.structure.takes_cones
            cone.prop(root, "cone_angle")
        column.operator("accelscope.step_ray")
        if current.steps is not None:
            self.draw_walk(context, layout, root)

    def draw_walk(self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any) -> None:
        """Draw the recorded walk: what is seen of it, and in which event it stands."""
        current, width = session.current, context.region.width
        assert current.steps is not None
        text = f"Ray {current.step_index} {current.hit_text()}"
        draw_wrapped(layout, text, "TRACKING_FORWARDS", width)
        row = layout.row(heading="Event")
        row.prop(root, "step_events", text="")
        number = row.row()
        number.active = root.step_events
        draw_range(number, root, "event", "")
        event = properties.event_shown(root)
        if event is not None:
            text = f"{event} of {len(current.steps) - 1}: {current.event_text(event)}"
            draw_wrapped(layout, text, "NONE", width)
        lines = layout.column(align=True)
        for name, text in current.legend:
            lines.label(text=text, icon=ICONS[name])
        grid = layout.column(align=True)
        for name, value in current.steps.tally().items():
            draw_figure(grid, name, str(value))


CLASSES = (VIEW3D_PT_accelscope_rays,)
