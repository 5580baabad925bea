"""Panel: which cells are drawn, and how."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import overlay, properties, selection, session
from .base import SidebarPanel, draw_wrapped

RAMP_TEXTS = {
    "depth": "depth 0 to {}",
    "count": "1 to {} primitives",
    "order": "build step 0 to {}",
}


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
        column.prop(display, "tint_empty")
        cells = session.current.cells
        row = column.row()
        row.active = cells is not None and cells.planes is not None
        row.prop(display, "planes")
        row = layout.row(heading="Replay")
        row.active = cells is not None and "order" in cells.extra
        row.prop(display, "replay", text="")
        step = row.row()
        step.active = display.replay
        step.prop(display, "step", text="")
        column = layout.column()
        column.prop(display, "colour_by")
        column.prop(display, "opacity")
        column.prop(display, "line_width")
        if cells is not None:
            lines = layout.column(align=True)
            width = context.region.width
            maximum = selection.colour_maximum(cells, display)
            if maximum > 0:
                text = RAMP_TEXTS[selection.coloured_by(cells, display)].format(maximum)
                draw_wrapped(lines, f"Blue to red: {text}", "NONE", width)
            step = selection.step_shown(cells, display)
            if step is not None:
                last = int(cells.extra["order"].max())
                text = f"step {min(step, last)} of {last}"
                draw_wrapped(lines, f"Built up to {text}", "NONE", width)
            draw_wrapped(lines, overlay.shown_text(display), "NONE", width)


CLASSES = (VIEW3D_PT_accelscope_display,)
