"""Panel: a plane that divides the scene, and its cost as on the slide "SAH decision"."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from ..addon.settings import properties
from .base import SidebarPanel, draw_figure, draw_job


class VIEW3D_PT_accelscope_split_plane(SidebarPanel, bpy.types.Panel):
    bl_label = "Split Plane"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        if properties.is_loaded():
            self.layout.prop(context.scene.accelscope.split_plane, "show", text="")

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        view = session.current.split_view
        if view is None:
            layout.label(text="Nothing has been built yet")
            return
        group = root.split_plane
        layout.active = group.show
        column = layout.column()
        row = column.row()
        row.prop(group, "axis", expand=True)
        column.prop(group, "position", slider=True)
        column.prop(group, "t_tra")
        column.prop(group, "t_tri")
        layout.operator("accelscope.view_exhibit", icon="ZOOM_SELECTED")
        axis, job = view.wanted(group), jobs.running()
        if axis is not None and axis not in view.axes:
            if job:
                draw_job(layout, job, context.region.width)
            else:
                layout.operator("accelscope.show_frame", text="Show Plane")
        grid = layout.column(align=True)
        for label, text in view.rows:
            draw_figure(grid, label, text)


CLASSES = (VIEW3D_PT_accelscope_split_plane,)
