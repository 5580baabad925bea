"""Put the images of the lesson into the file, to be looked at in the image editor."""

from __future__ import annotations

import bpy

from ..addon.results import lesson_view
from ..addon.to_blender.images import keep_images


class ACCELSCOPE_OT_open_lesson_image(bpy.types.Operator):
    bl_idname = "accelscope.open_lesson_image"
    bl_label = "Keep Image"
    bl_description = "Keep the image in the file; image editors that are open show it"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        picture = lesson_view.current.picture
        if picture is None or not picture.images:
            cls.poll_message_set("This lesson shows no image")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        picture = lesson_view.current.picture
        assert picture is not None
        names = keep_images(context, picture.images)
        self.report({"INFO"}, f"Kept as image {names}")
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_open_lesson_image,)
