"""Show the links of a leaf to its neighbours."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import IntProperty

from ..addon import jobs, properties, session


class ACCELSCOPE_OT_show_links(bpy.types.Operator):
    bl_idname = "accelscope.show_links"
    bl_label = "Show Links"
    bl_description = (
        "Draw the links (ropes) of the leaf at the 3D cursor to its neighbours. "
        "Outside of all leaves, draw none"
    )
    bl_options = {"REGISTER"}

    leaf: IntProperty(  # type: ignore[valid-type]
        name="Leaf",
        description="Number of the leaf; -1 takes the one at the 3D cursor",
        default=-1,
        min=-1,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.built is None:
            cls.poll_message_set("Build a structure first")
            return False
        if not session.current.has_links():
            cls.poll_message_set("The leaves of this structure have no links to their neighbours")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..core.evaluation.ray_path import leaf_at

        current = session.current
        assert current.built is not None
        assert current.cells is not None
        number = self.leaf
        if number < 0:
            cursor = context.scene.cursor.location
            found = leaf_at(current.cells, np.array(cursor))
            number = -1 if found is None else found
        elif not current.cells.is_leaf[current.cells.numbers == number].any():
            self.report({"ERROR"}, f"There is no leaf with the number {number}")
            return {"CANCELLED"}
        current.set_linked_leaf(number)
        current.draw_paths(properties.event_shown(context.scene.accelscope))
        if number < 0:
            self.report({"INFO"}, "There is no leaf at the 3D cursor")
        else:
            links = len(current.built.structure.links(number))
            self.report({"INFO"}, f"Leaf {number} has {links} links")
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_show_links,)
