"""Move the viewport so that it shows the scene, the whole exhibit and the split plane."""

from __future__ import annotations

import bpy
import numpy as np

from ..addon.drawing import overlay
from ..addon.results import session

LAYERS = overlay.EXHIBIT, overlay.PLANE


class ACCELSCOPE_OT_view_exhibit(bpy.types.Operator):
    bl_idname = "accelscope.view_exhibit"
    bl_label = "View All"
    bl_description = (
        "Move the view so that the scene and all that is drawn of exhibit and split plane are in "
        "it: charts stand beside the model"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if len(overlay.points_of(LAYERS)) == 0:
            cls.poll_message_set("Show an exhibit or the split plane first")
            return False
        return context.area is not None and context.area.type == "VIEW_3D"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..addon.drawing.viewport import look_at
        from ..core.geometry.box_shape import corners_of

        assert session.current.built is not None
        scene = session.current.built.structure.scene
        corners = corners_of(np.concatenate([scene.lower, scene.upper])[None])[0]
        look_at(context.area, np.concatenate([corners, overlay.points_of(LAYERS)]))
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_view_exhibit,)
