"""Two handles in the viewport, between which the ray of a lesson runs."""

from __future__ import annotations

from typing import Any

import bpy
from mathutils import Matrix, Vector

from ..addon.results import lesson_view
from ..addon.settings import properties

NAMES = "ray_from", "ray_to"

SIZE, COLOUR, BRIGHT = 0.12, (0.93, 0.20, 0.85), (1.0, 1.0, 1.0)


class VIEW3D_GGT_accelscope_ray(bpy.types.GizmoGroup):
    bl_label = "Ray of the Lesson"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"3D", "PERSISTENT"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        view = lesson_view.current
        if not properties.is_loaded() or not view.is_in(context.scene) or view.lesson is None:
            return False
        return view.lesson.takes_ray and context.scene.accelscope.teaching.aim

    def setup(self, context: bpy.types.Context) -> None:
        for name in NAMES:
            handle = self.gizmos.new("GIZMO_GT_move_3d")
            handle.draw_options = {"FILL_SELECT", "ALIGN_VIEW"}
            handle.target_set_handler("offset", get=getter(name), set=setter(name))
            handle.color, handle.alpha = COLOUR, 0.9
            handle.color_highlight, handle.alpha_highlight = BRIGHT, 1.0
            handle.scale_basis = SIZE
            handle.use_draw_modal = True
            handle.matrix_basis = Matrix.Identity(4)


def getter(name: str) -> Any:
    """Return what reads where a handle stands."""

    def get() -> Vector:
        return Vector(getattr(bpy.context.scene.accelscope.teaching, name))

    return get


def setter(name: str) -> Any:
    """Return what moves a handle."""

    def move(place: Any) -> None:
        setattr(bpy.context.scene.accelscope.teaching, name, place)

    return move


CLASSES = (VIEW3D_GGT_accelscope_ray,)
