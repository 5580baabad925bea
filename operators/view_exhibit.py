"""Move the viewport so that it shows the whole frame of the exhibit."""

from __future__ import annotations

import bpy

from ..addon import session


class ACCELSCOPE_OT_view_exhibit(bpy.types.Operator):
    bl_idname = "accelscope.view_exhibit"
    bl_label = "View Exhibit"
    bl_description = (
        "Move the view so that all of this frame is in it: charts stand beside the model"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        frame = session.current.showcase.frame_shown
        if frame is None or len(frame.segments) == 0:
            cls.poll_message_set("Show an exhibit first")
            return False
        return context.area is not None and context.area.type == "VIEW_3D"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..addon.viewport import look_at

        frame = session.current.showcase.frame_shown
        assert frame is not None
        look_at(context.area, frame.segments.reshape(-1, 3))
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_view_exhibit,)
