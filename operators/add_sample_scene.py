"""Add one of the sample scenes: objects, camera and lights."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty

from ..addon.drawing.viewport import look_at, turn_to_front
from ..addon.results.wording import refusal_in_panel
from ..addon.settings import generated
from ..addon.to_blender import sample_objects
from ..core.errors import InputError
from ..core.geometry.box_shape import corners_of
from ..core.printing import printable
from ..core.settings import has_effect
from ..sample_scenes import samples

MOST_NAMED = 3
"""Hidden objects that the report names."""


def settings_of(sample: str) -> dict[str, Any]:
    """Return the Blender properties of a sample's settings by field name."""
    return generated.properties_of(samples()[sample].Settings)


def operator_properties() -> dict[str, Any]:
    """Return the operator's properties: which sample, and SAMPLE_SETTING for every setting of each.

    They belong to the operator, not to the scene, so that the redo panel changes them. Not in
    groups, because Blender 4.5 takes no group as an argument of an operator.
    """
    choices = {name: (sample.label, sample.summary) for name, sample in samples().items()}
    all_properties = {
        "sample": generated.enum_of(choices, name="Sample Scene", default=next(iter(choices))),
        "only": BoolProperty(
            name="Only This Sample",
            description="Hide all other objects that would be built over. Undo brings them back, "
            "and so does Show Hidden Objects (Alt H)",
            default=True,
        ),
    }
    for sample in choices:
        for field, prop in settings_of(sample).items():
            all_properties[f"{sample}_{field}"] = prop
    return all_properties


class ACCELSCOPE_OT_add_sample_scene(bpy.types.Operator):
    bl_idname = "accelscope.add_sample_scene"
    bl_label = "Add Sample Scene"
    bl_description = (
        "Add a generated scene with its camera and lights, in a collection of its own, hide other "
        "objects and look at it"
    )
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
        self.layout.prop(self, "only")
        for field in dataclasses.fields(samples()[self.sample].Settings):
            if has_effect(field, self.group()):
                self.layout.prop(self, f"{self.sample}_{field.name}")

    def group(self) -> SimpleNamespace:
        """Return the settings of the chosen sample by field name."""
        name = self.sample
        return SimpleNamespace(**{f: getattr(self, f"{name}_{f}") for f in settings_of(name)})

    def execute(self, context: bpy.types.Context) -> set[str]:
        sample = samples()[self.sample]
        try:
            settings: Any = generated.read(self.group(), sample.Settings, sample.label)
            scene = sample.generate(settings)
            items = sample.items(settings)
        except (InputError, MemoryError) as error:
            self.report({"ERROR"}, refusal_in_panel(error))
            return {"CANCELLED"}
        text = f"{sample.label}: {scene.counted}"
        others = sample_objects.hide_others(context) if self.only else []
        sample_objects.add_scene(context.scene, scene, sample.label, items, context.view_layer)
        if others:
            text += f"; hidden, back with Alt H: {', '.join(others[:MOST_NAMED])}"
            text += f" and {len(others) - MOST_NAMED} more" * (len(others) > MOST_NAMED)
        if context.area is not None and context.area.type == "VIEW_3D":
            box = np.concatenate([scene.lower, scene.upper])
            turn_to_front(context.area)
            look_at(context.area, corners_of(box[None])[0])
        self.report({"INFO"}, printable(text))
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_add_sample_scene,)
