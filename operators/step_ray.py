"""Step through one of the traced rays: the lesson on a ray, about what was built."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.results import lesson_view, session
from .teach import BUILT

LESSON = "ray"


class ACCELSCOPE_OT_step_ray(bpy.types.Operator):
    bl_idname = "accelscope.step_ray"
    bl_label = "Step Ray"
    bl_description = (
        "Teach A Ray, Event by Event on the rays that were traced: the cells one of them enters, "
        "the triangles it tests, its hit; or a cone around it, and what it meets"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.traced is None:
            cls.poll_message_set("Trace rays first")
            return False
        if not session.current.is_of(context.scene):
            cls.poll_message_set("Rays were traced in another scene of this file")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        lesson_view.ask("teach", context.scene, subject=BUILT, lesson=LESSON)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_step_ray,)
