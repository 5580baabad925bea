"""Add one of the sample scenes: objects, camera and lights."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import PointerProperty

from ..addon import properties, sample_objects
from ..core.errors import InputError
from ..sample_scenes import samples

GROUPS = {
    name: properties.group_type(f"sample_{name}", properties.properties_of(sample.Settings))
    for name, sample in samples().items()
}
"""The settings of every sample scene. They belong to the operator, not to the scene, so that the
redo panel changes them."""


def operator_properties() -> dict[str, Any]:
    """Return the properties of the operator: which sample, and the settings of each."""
    choices = {name: (sample.label, sample.summary) for name, sample in samples().items()}
    choice = properties.enum_of(choices, name="Sample Scene", default=next(iter(choices)))
    return {"sample": choice, **{name: PointerProperty(type=g) for name, g in GROUPS.items()}}


class ACCELSCOPE_OT_add_sample_scene(bpy.types.Operator):
    bl_idname = "accelscope.add_sample_scene"
    bl_label = "Add Sample Scene"
    bl_description = "Add a generated scene with its camera and lights, in a collection of its own"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = operator_properties()

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode")
            return False
        return True

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(self, "sample")
        for name in getattr(GROUPS[self.sample], "__annotations__", {}):
            self.layout.prop(getattr(self, self.sample), name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        sample = samples()[self.sample]
        group = getattr(self, self.sample)
        try:
            settings: Any = properties.read(group, sample.Settings, f"sample scene {sample.name}")
            scene = sample.generate(settings)
        except (InputError, MemoryError) as error:
            self.report({"ERROR"}, str(error) or "Out of memory; lower the settings")
            return {"CANCELLED"}
        sample_objects.add_scene(context, scene, sample.label)
        self.report({"INFO"}, f"{sample.label}: {len(scene)} triangles")
        return {"FINISHED"}


CLASSES = (*GROUPS.values(), ACCELSCOPE_OT_add_sample_scene)
