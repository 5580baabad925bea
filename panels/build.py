"""Panel: choose a structure and build it."""

from __future__ import annotations

import textwrap
from typing import Any

import bpy

from ..addon import jobs
from ..addon.from_blender.booleans import has_booleans
from ..addon.results import session
from ..addon.settings import choices
from ..core.geometry.csg.settings import CuttingSettings
from ..core.kernels import has_numba, numba_fault
from ..core.scene.placing import PlacingSettings
from .base import SidebarPanel, draw_job, draw_settings, draw_wrapped

MOST_LETTERS = 160
"""Of what Numba says when it cannot be imported; the command line prints all."""


class VIEW3D_PT_accelscope_build(SidebarPanel, bpy.types.Panel):
    bl_label = "Build"
    bl_order = 1

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        width = context.region.width
        if not has_numba():
            fault = numba_fault()
            why = "Numba cannot be imported" if fault else "install the full extension"
            draw_wrapped(layout, f"Slow: pure Python ({why})", "ERROR", width)
            if fault:
                # Some tell all the places where they have looked.
                fault = textwrap.shorten(fault, MOST_LETTERS, placeholder=" ...")
                draw_wrapped(layout, fault, "BLANK1", width)
        elif session.current.built is not None and session.current.built.is_plain:
            text = "Built by plain Python, since kernels are still being compiled: ignore times"
            draw_wrapped(layout, text, "INFO", width)
        layout.prop(root, "scope", expand=True)
        draw_settings(layout, root, PlacingSettings)
        if any(has_booleans(obj) for obj in context.view_layer.objects):
            draw_settings(layout, root, CuttingSettings)
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
            if headline := session.current.headline():
                draw_wrapped(layout, headline, "NONE", width)
            status = session.current.status(context, at_once=False)
            stale = "ERROR" if session.current.built else "INFO"
            icon = "CHECKMARK" if status.up_to_date else stale
            draw_wrapped(layout, status.text, icon, width)
            for sentence in session.current.notes():
                draw_wrapped(layout, sentence[:1].upper() + sentence[1:], "INFO", width)
        layout.operator_menu_enum("accelscope.add_sample_scene", "sample", icon="MESH_MONKEY")


CLASSES = (VIEW3D_PT_accelscope_build,)
