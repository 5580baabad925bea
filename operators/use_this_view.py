"""Let the lesson that is about all rays of a camera take those of the viewport."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.drawing.viewport import window_of
from ..addon.from_blender.cameras import camera_of_view
from ..addon.results import lesson_view


class ACCELSCOPE_OT_use_this_view(bpy.types.Operator):
    bl_idname = "accelscope.use_this_view"
    bl_label = "Use This View"
    bl_description = "Trace the rays of a picture that shows what this viewport shows now"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        view = lesson_view.current
        if not view.is_in(context.scene) or not view.has_pixels():
            cls.poll_message_set("Teach a lesson with a heat map first")
            return False
        return context.area is not None and context.area.type == "VIEW_3D"

    def execute(self, context: bpy.types.Context) -> set[str]:
        camera = camera_of_view(context, context.area.spaces.active, window_of(context.area))
        if camera is None or not camera.has_rays:
            self.report({"ERROR"}, "no rays are made of such a camera; leave its view first")
            return {"CANCELLED"}
        lesson_view.current.choose_camera(context.scene, camera)
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_use_this_view,)
