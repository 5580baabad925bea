"""Panel: which cells are drawn, and how."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import overlay, properties, session
from .base import SidebarPanel, draw_wrapped


class VIEW3D_PT_accelscope_display(SidebarPanel, bpy.types.Panel):
    bl_label = "Display"
    bl_order = 1

    def draw_header(self, context: bpy.types.Context) -> None:
        if properties.is_loaded():
            self.layout.prop(context.scene.accelscope.display, "show", text="")

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        display = root.display
        layout.active = display.show
        column = layout.column(align=True)
        column.prop(display, "depth_min")
        column.prop(display, "depth_max")
        column = layout.column(heading="Cells")
        column.prop(display, "leaves_only")
        column.prop(display, "hide_empty")
        column = layout.column()
        column.prop(display, "colour_by")
        column.prop(display, "opacity")
        column.prop(display, "line_width")
        cells = session.current.cells
        if cells is not None:
            maximum = overlay.colour_maximum(cells, display)
            by_count = overlay.coloured_by_count(cells, display)
            text = f"1 to {maximum} primitives" if by_count else f"depth 0 to {maximum}"
            lines = layout.column(align=True)
            if maximum > 0:
                draw_wrapped(lines, f"Blue to red: {text}", "NONE", context.region.width)
            draw_wrapped(lines, overlay.shown_text(display), "NONE", context.region.width)


CLASSES = (VIEW3D_PT_accelscope_display,)
