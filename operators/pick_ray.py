"""Choose by a click what a lesson shows: the ray through a point of the viewport, or a pixel."""

from __future__ import annotations

import bpy
import numpy as np
from bpy_extras import view3d_utils

from ..addon import jobs
from ..addon.drawing import picture_overlay
from ..addon.drawing.viewport import window_of
from ..addon.results import lesson_view


class ACCELSCOPE_OT_pick_ray(bpy.types.Operator):
    bl_idname = "accelscope.pick_ray"
    bl_label = "Pick Ray"
    bl_description = (
        "Click into the viewport: the lesson shows the ray from your eye through that point. In a "
        "heat map the click chooses a pixel. Esc or right click leaves all as it is"
    )
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls) or not lesson_view.is_taught(cls, context):
            return False
        view = lesson_view.current
        assert view.lesson is not None
        if not (view.lesson.takes_ray or view.has_pixels()):
            cls.poll_message_set("This lesson shows no ray that could be chosen")
            return False
        return context.area is not None and context.area.type == "VIEW_3D"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window.cursor_modal_set("CROSSHAIR")
        context.workspace.status_text_set("Click: this ray     Esc: cancel")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        # Meanwhile the viewport can be turned, but also closed, or made another editor.
        has_view = context.area is not None and context.area.type == "VIEW_3D"
        is_shown = has_view and lesson_view.current.is_in(context.scene)
        if event.type in {"ESC", "RIGHTMOUSE"} or not is_shown:
            self.cancel(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"}
        self.cancel(context)
        region = window_of(context.area)
        place = event.mouse_x - region.x, event.mouse_y - region.y
        if not (0 <= place[0] < region.width and 0 <= place[1] < region.height):
            return {"CANCELLED"}
        self.take(context, region, place)
        return {"FINISHED"}

    def take(
        self, context: bpy.types.Context, region: bpy.types.Region, place: tuple[int, int]
    ) -> None:
        """Show what was clicked at: a pixel of a map, or else the ray of the view."""
        view = lesson_view.current
        pixel = picture_overlay.pixel_at(region, *place)
        if pixel is not None and view.has_pixels():
            view.choose_pixel(context.scene, *pixel)
        elif view.lesson is not None and view.lesson.takes_ray:
            seen = context.area.spaces.active.region_3d
            origin = view3d_utils.region_2d_to_origin_3d(region, seen, place)
            direction = view3d_utils.region_2d_to_vector_3d(region, seen, place)
            view.choose_ray(context.scene, np.array(origin), np.array(direction))

    def cancel(self, context: bpy.types.Context) -> None:
        """Leave cursor and status line as they were; Blender calls it when it ends the operator."""
        if context.window is not None:
            context.window.cursor_modal_restore()
        if context.workspace is not None:
            context.workspace.status_text_set(None)


CLASSES = (ACCELSCOPE_OT_pick_ray,)
