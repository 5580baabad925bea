"""Teach the lesson on the user's own mesh."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.from_blender import extraction
from ..addon.results import lesson_view
from ..addon.to_blender import lesson_scene
from .end_lesson import end
from .teach import MESH


class ACCELSCOPE_OT_use_my_mesh(bpy.types.Operator):
    bl_idname = "accelscope.use_my_mesh"
    bl_label = "Use My Mesh"
    bl_description = (
        "Go back to your scene and teach the lesson on the selected objects, or on all that are "
        "visible if none is selected"
    )
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode")
            return False
        home = context.scene
        if lesson_scene.is_ours(home):
            home = home[lesson_scene.HOME] or home
        if not extraction.has_members(home.view_layers[0], extraction.VISIBLE):
            cls.poll_message_set("There is no visible mesh object in your scene")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        scene = context.scene
        if lesson_scene.is_ours(scene):
            lesson, home = lesson_view.chosen(scene), scene[lesson_scene.HOME]
            if home is not None:
                lesson_view.copy_settings(lesson, scene, home)
            scene = end(context)
        lesson_view.ask("teach", scene, subject=MESH)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_use_my_mesh,)
