"""Panel: the figures of the record, section by section."""

from __future__ import annotations

import itertools
from typing import Any

import bpy

from ..addon.results import session
from .base import SidebarPanel, draw_explained, draw_figure


class VIEW3D_PT_accelscope_statistics(SidebarPanel, bpy.types.Panel):
    bl_label = "Statistics"
    bl_order = 5

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        if session.current.record is None:
            layout.label(text="Nothing has been built yet")
            return
        from ..core.evaluation.records.report import explained_figures

        name, changed = session.current.what_was_built()
        column = layout.column(align=True)
        column.label(text=name)
        for label, text in changed:
            draw_figure(column, label, text)
        rows = explained_figures(session.current.record)
        for section, group in itertools.groupby(rows, key=lambda row: row[0]):
            box = layout.box().column(align=True)
            box.label(text=section)
            for _, label, text, meaning in group:
                draw_explained(box, label, text, meaning[:1].upper() + meaning[1:])


CLASSES = (VIEW3D_PT_accelscope_statistics,)
