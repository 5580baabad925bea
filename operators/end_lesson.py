"""End the lesson and go back to the user's scene."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.results import film, lesson_view, session
from ..addon.to_blender import lesson_scene


class ACCELSCOPE_OT_end_lesson(bpy.types.Operator):
    bl_idname = "accelscope.end_lesson"
    bl_label = "End Lesson"
    bl_description = "Go back to your scene, as it was, and remove that of the lesson"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if lesson_view.current.lesson is None and not lesson_scene.is_ours(context.scene):
            cls.poll_message_set("No lesson is taught")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        end(context)
        return {"FINISHED"}


def end(context: bpy.types.Context) -> bpy.types.Scene:
    """End the lesson; return the user's scene."""
    view = lesson_view.current
    owner = lesson_view.owner_scene() or context.scene
    name = owner.accelscope.teaching.lesson
    film.stop()
    film.free_timeline(owner)
    view.clear()
    session.current.lesson_look = None
    session.current.watch()
    home = lesson_scene.close_scene(owner) if lesson_scene.is_ours(owner) else owner
    home.accelscope.teaching.lesson = name
    view.rearrange()
    jobs.forget_refusal()
    return home


CLASSES = (ACCELSCOPE_OT_end_lesson,)
