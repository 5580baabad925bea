"""Panel: what the active object says of itself as an instance."""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy

from ..addon.from_blender.extraction import may_have_geometry
from ..addon.settings.instances import NAME
from ..core.geometry.instance_settings import InstanceSettings
from .base import SidebarPanel


def is_instance(context: bpy.types.Context) -> bool:
    """Say whether the active object may be an instance, or have some."""
    return context.object is not None and may_have_geometry(context.object)


def draw_instance(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draw the descriptor of an object."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    group = getattr(obj, NAME)
    numbers, flags = layout.column(align=True), layout.column(align=True, heading="Flags")
    for field in dataclasses.fields(InstanceSettings):
        (flags if isinstance(field.default, bool) else numbers).prop(group, field.name)


class VIEW3D_PT_accelscope_instance(SidebarPanel, bpy.types.Panel):
    bl_label = "Instance"
    bl_order = 8
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_instance(context)

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        layout.label(text=context.object.name, icon="OBJECT_DATA", translate=False)
        draw_instance(layout, context.object)


class OBJECT_PT_accelscope_instance(bpy.types.Panel):
    """The same where all other properties of an object are."""

    bl_label = "AccelScope Instance"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_instance(context)

    def draw(self, context: bpy.types.Context) -> None:
        draw_instance(self.layout, context.object)


CLASSES = (VIEW3D_PT_accelscope_instance, OBJECT_PT_accelscope_instance)
