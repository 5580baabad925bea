"""Panel: what the active object stands for."""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy

from ..addon.from_blender.extraction import GEOMETRY_TYPES
from ..addon.from_blender.standing import ITEMS
from ..addon.settings.solids import ITSELF, SolidSettings, settings_of
from ..core.settings import has_effect
from .base import SidebarPanel, draw_wrapped


def has_solid(context: bpy.types.Context) -> bool:
    """Say whether the active object may stand for a solid."""
    return context.object is not None and context.object.type in GEOMETRY_TYPES


def draw_solid(layout: bpy.types.UILayout, obj: bpy.types.Object, width: int) -> None:
    """Draw what an object stands for, and of which shape that is; nothing that has no effect.

    `width` is that of the region in pixels.
    """
    layout.use_property_split = True
    layout.use_property_decorate = False
    group = settings_of(obj)
    layout.prop(group, "kind")
    if group.kind == ITSELF:
        if obj.type == "MESH" and ITEMS in obj.data:
            text = "Its mesh draws the solids of a sample scene. Once edited, it is its triangles"
            draw_wrapped(layout, text, "INFO", width)
        return
    for field in dataclasses.fields(SolidSettings)[1:]:
        if has_effect(field, group):
            layout.prop(group, field.name)


class VIEW3D_PT_accelscope_solid(SidebarPanel, bpy.types.Panel):
    bl_label = "Solid"
    bl_order = 7
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_solid(context)

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        layout.label(text=context.object.name, icon="OBJECT_DATA", translate=False)
        draw_solid(layout, context.object, context.region.width)


class OBJECT_PT_accelscope_solid(bpy.types.Panel):
    """The same where all other properties of an object are."""

    bl_label = "AccelScope Solid"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return has_solid(context)

    def draw(self, context: bpy.types.Context) -> None:
        draw_solid(self.layout, context.object, context.region.width)


CLASSES = (VIEW3D_PT_accelscope_solid, OBJECT_PT_accelscope_solid)
