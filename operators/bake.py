"""Bake the cells that are shown into a mesh object."""

from __future__ import annotations

import bpy

from ..addon import session


class ACCELSCOPE_OT_bake(bpy.types.Operator):
    bl_idname = "accelscope.bake"
    bl_label = "Bake to Meshes"
    bl_description = (
        "Make a mesh object of the edges of the cells that are shown, with depth and other "
        "figures as attributes, in the collection AccelScope"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if session.current.cells is None:
            cls.poll_message_set("Build a structure first")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..addon.bake import bake_cells
        from ..addon.wording import in_panel
        from ..core.errors import InputError

        built, cells = session.current.built, session.current.cells
        assert built is not None
        assert cells is not None
        display = context.scene.accelscope.display
        try:
            obj = bake_cells(context, cells, display, f"{built.structure.label} Cells")
        except InputError as error:
            self.report({"ERROR"}, in_panel(str(error)))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{obj.name}: {len(obj.data.edges)} edges")
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_bake,)
