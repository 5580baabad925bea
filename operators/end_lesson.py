"""End the lesson and go back to the user's scene."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.results import film, lesson_view
from ..addon.to_blender import lesson_scene, source_text


class ACCELSCOPE_OT_end_lesson(bpy.types.Operator):
    bl_idname = "accelscope.end_lesson"
    bl_label = "End Lesson"
    bl_description = "Go back to your scene, as it was, and remove that of the lesson"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if not lesson_view.can_end_in(context.scene):
            cls.poll_message_set("No lesson is taught here")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        end(context)
        return {"FINISHED"}


def end(context: bpy.types.Context) -> bpy.types.Scene:
    """End the lesson of this window's scene; return the user's scene.

    A lesson that another window shows in another scene goes on.
    """
    view, owner = lesson_view.current, context.scene
    name = owner.accelscope.teaching.lesson
    film.free_timeline(owner)
    other = lesson_view.owner_scene()
    if other is None or other == owner:
        film.stop()
        lesson_view.forget()
        source_text.close_texts()
    home = lesson_scene.close_scene(owner) if lesson_scene.is_ours(owner) else owner
    if not view.is_in(home):
        home.accelscope.teaching.lesson = name
    lesson_view.rearrange()
    jobs.forget_refusal()
    return home


CLASSES = (ACCELSCOPE_OT_end_lesson,)
