"""Panel: choose a structure and build it."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from ..addon.settings import choices
from ..core.kernels import has_numba, numba_fault
from .base import SidebarPanel, draw_job, draw_settings, draw_wrapped


class VIEW3D_PT_accelscope_build(SidebarPanel, bpy.types.Panel):
    bl_label = "Build"
    bl_order = 0

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        width = context.region.width
        if not has_numba():
            fault = numba_fault()
            what = f"Numba cannot be imported: {fault}" if fault else "install the full extension"
            text = f"Slow: pure Python ({what})"
            draw_wrapped(layout, text, "ERROR", width)
        layout.prop(root, "scope", expand=True)
        layout.prop(root, "structure")
        structure = choices.structure_chosen(root)
        draw_settings(layout, getattr(root.structures, root.structure), structure.Settings)

        job = jobs.running()
        if job:
            draw_job(layout, job, context.region.width)
        else:
            row = layout.row(align=True)
            row.scale_y = 1.4
            row.operator("accelscope.build")
            row.operator("accelscope.clear", text="", icon="TRASH")
            if choices.is_refittable(structure):
                row = layout.row(align=True)
                row.operator("accelscope.refit")
                row.operator("accelscope.compare_over_timeline")
            if jobs.refusal():
                draw_wrapped(layout, jobs.refusal(), "CANCEL", width)
            status = session.current.status(context, at_once=False)
            stale = "ERROR" if session.current.built else "INFO"
            icon = "CHECKMARK" if status.up_to_date else stale
            draw_wrapped(layout, status.text, icon, width)
            for sentence in session.current.notes():
                draw_wrapped(layout, sentence[:1].upper() + sentence[1:], "INFO", width)
        layout.operator_menu_enum("accelscope.add_sample_scene", "sample", icon="MESH_MONKEY")


CLASSES = (VIEW3D_PT_accelscope_build,)
