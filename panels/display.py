"""Panel: which cells are drawn, and how."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon.drawing import overlay, selection
from ..addon.drawing.drawable import Drawable
from ..addon.results import session
from ..addon.settings import properties
from .base import SidebarPanel, draw_range, draw_wrapped

RAMP_TEXTS = {
    "depth": "depth 0 to {}",
    "count": "1 to {} primitives",
    "order": "build step 0 to {}",
}


def what_is_not_there(drawable: Drawable) -> str:
    """Say why there are no planes to draw; "" if there are."""
    if drawable.extent.last_step is None:
        return "Planes: not of cells that were made at once, or refitted"
    if drawable.cells.planes is None:
        return "Planes: these cells are joined or rearranged, not cut by planes"
    return ""


class VIEW3D_PT_accelscope_display(SidebarPanel, bpy.types.Panel):
    bl_label = "Display"
    bl_order = 2

    def draw_header(self, context: bpy.types.Context) -> None:
        if properties.is_loaded():
            self.layout.prop(context.scene.accelscope.display, "show", text="")

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        display = root.display
        layout.active = display.show
        drawable = session.current.drawable
        if drawable is None:
            # There is no depth yet that the fields could stand at.
            layout.label(text="Nothing has been built yet")
        else:
            column = layout.column(align=True)
            draw_range(column, display, "depth_min")
            draw_range(column, display, "depth_max")
        column = layout.column(heading="Cells")
        column.prop(display, "leaves_only")
        column.prop(display, "hide_empty")
        column.prop(display, "tint_empty")
        row = column.row()
        row.active = drawable is not None and drawable.cells.planes is not None
        row.prop(display, "planes")
        if drawable is not None and (text := what_is_not_there(drawable)):
            draw_wrapped(layout, text, "INFO", context.region.width)
        column = layout.column()
        column.prop(display, "colour_by")
        column.prop(display, "opacity")
        column.prop(display, "line_width")
        if drawable is not None:
            lines, extent = layout.column(align=True), drawable.extent
            width = context.region.width
            maximum = selection.colour_maximum(extent, display)
            if maximum > 0:
                text = RAMP_TEXTS[selection.coloured_by(extent, display)].format(maximum)
                draw_wrapped(lines, f"Blue to red: {text}", "NONE", width)
            draw_wrapped(lines, overlay.shown_text(display), "NONE", width)


CLASSES = (VIEW3D_PT_accelscope_display,)
