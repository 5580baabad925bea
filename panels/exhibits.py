"""Panel: exhibits of the structure, frame by frame."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from ..addon.results.wording import in_panel
from ..addon.settings import properties
from .base import SidebarPanel, draw_job, draw_range, draw_wrapped


class VIEW3D_PT_accelscope_exhibits(SidebarPanel, bpy.types.Panel):
    bl_label = "Exhibits"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        if properties.is_loaded():
            self.layout.prop(context.scene.accelscope.exhibits, "show", text="")

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        group, showcase = root.exhibits, session.current.showcase
        exhibit = showcase.chosen(group)
        if exhibit is None:
            built = session.current.built
            text = f"{built.structure.label} has none" if built else "Nothing has been built yet"
            layout.label(text=text)
            return
        layout.active = group.show
        layout.prop(group, "exhibit")
        row = layout.row(align=True)
        draw_range(row, group, "frame")
        row.operator("accelscope.step_frame", text="", icon="TRIA_LEFT").by = -1
        row.operator("accelscope.step_frame", text="", icon="TRIA_RIGHT").by = 1
        layout.prop(group, "alone")
        layout.operator("accelscope.view_exhibit", icon="ZOOM_SELECTED")

        job, width = jobs.running(), context.region.width
        if job:
            draw_job(layout, job, context.region.width)
        elif showcase.shown != showcase.wanted(group):
            layout.operator("accelscope.show_frame")
        assert session.current.built is not None
        from ..core.lessons import exhibits_left_out

        left_out = exhibits_left_out(session.current.built.structure)
        if left_out:
            draw_wrapped(layout.column(align=True), in_panel(left_out), "INFO", width)
        lines = layout.column(align=True)
        frame = showcase.frame_shown
        if showcase.shown is None or frame is None:
            draw_wrapped(lines, exhibit.description, "NONE", width)
            return
        text = f"Frame {showcase.shown.frame} of {exhibit.count - 1}"
        draw_wrapped(lines, text, "NONE", width)
        draw_wrapped(lines, frame.caption, "NONE", width)


CLASSES = (VIEW3D_PT_accelscope_exhibits,)
