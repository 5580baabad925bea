"""Put the film of the lesson on the timeline, or take it off."""

from __future__ import annotations

import bpy

from ..addon.results import film, lesson_view


class ACCELSCOPE_OT_film_on_timeline(bpy.types.Operator):
    bl_idname = "accelscope.film_on_timeline"
    bl_label = "On Timeline"
    bl_description = (
        "Let the frames of the timeline be the pictures of the lesson; once more gives the "
        "timeline its own first and last frame back"
    )
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return lesson_view.is_taught(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if film.is_on_timeline(context.scene):
            film.free_timeline(context.scene)
        else:
            film.bind_timeline(context.scene)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_film_on_timeline,)
