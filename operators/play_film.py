"""Play the film of the lesson: its knob from where it is to its last value, or stop that."""

from __future__ import annotations

import bpy

from ..addon.results import film, lesson_view


class ACCELSCOPE_OT_play_film(bpy.types.Operator):
    bl_idname = "accelscope.play_film"
    bl_label = "Play"
    bl_description = (
        "Play from here to the last picture, from the first if this is the last; or stop"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return lesson_view.is_taught(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if film.is_playing():
            film.stop()
        else:
            film.start(context.scene)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_play_film,)
