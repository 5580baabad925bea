"""Record one of the traced rays, or a cone around it, step by step, and show its path."""

from __future__ import annotations

import bpy

from ..addon import jobs
from ..addon.drawing.drawable import make_drawable
from ..addon.results import session
from ..addon.settings import properties
from ..core.errors import InputError
from ..core.printing import printable


class ACCELSCOPE_OT_step_ray(bpy.types.Operator):
    bl_idname = "accelscope.step_ray"
    bl_label = "Step Ray"
    bl_description = (
        "Trace one of the rays again, recording every step: the cells it enters, "
        "the triangles it tests, its hit; or a cone around it, and what it meets"
    )
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.traced is None:
            cls.poll_message_set("Trace rays first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        built, traced = session.current.built, session.current.traced
        assert built is not None
        assert traced is not None
        index = context.scene.accelscope.ray_index
        angle = context.scene.accelscope.cone_angle
        made = built.structure.made()
        try:
            if angle:
                _, steps = built.structure.cover(traced.rays, index, angle)
            else:
                steps = built.structure.record(traced.rays, index)
        except InputError as error:
            self.report({"ERROR"}, printable(f"{error}; or set Cone to 0"))
            return {"CANCELLED"}
        if built.structure.made() != made:  # a cone enters more than its ray has
            session.current.set_cells(make_drawable(built.structure.cells()))
        session.current.set_steps(index, steps, angle)
        session.current.draw_paths(properties.event_shown(context.scene.accelscope))
        text = f"Ray {index}: {len(steps)} events; {session.current.hit_text()}"
        self.report({"INFO"}, printable(text))
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_step_ray,)
