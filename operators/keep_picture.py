"""Put the picture that the rays have made into the file, to be looked at in the image editor."""

from __future__ import annotations

import bpy

from ..addon.results import session
from ..addon.to_blender.images import keep_images


class ACCELSCOPE_OT_keep_picture(bpy.types.Operator):
    bl_idname = "accelscope.keep_picture"
    bl_label = "Keep Picture"
    bl_description = (
        "Keep the picture that the rays have made in the file, and how many samples each pixel has "
        "if that differs; image editors that are open show it"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        traced = session.current.traced
        if traced is None or traced.outcome is None:
            cls.poll_message_set("Trace rays that make a picture first, such as Whitted")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..core.evaluation.pages.picture_files import images_of

        traced = session.current.traced
        assert traced is not None
        assert traced.outcome is not None
        names = keep_images(context, images_of(traced.outcome))
        self.report({"INFO"}, f"Kept as image {names}")
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_keep_picture,)
