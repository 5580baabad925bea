"""Show the links of a leaf to its neighbours."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.props import IntProperty

from ..addon import jobs
from ..addon.results import session
from ..addon.settings import properties
from ..core.errors import InputError
from ..core.progress import Progress


class ACCELSCOPE_OT_show_links(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.show_links"
    bl_label = "Show Links"
    bl_description = (
        "Draw the links (ropes) of the leaf at the 3D cursor to its neighbours. "
        "Outside of all leaves, draw none. Esc stops it"
    )
    bl_options = {"REGISTER"}

    job_text = "Finding links"
    refused_text = "Not shown"
    head_start = 0.05

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

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.kernels import announcing
        from ..core.lessons.ray_path import leaf_at, links_of

        built, cells = session.current.built, session.current.cells
        assert built is not None
        assert cells is not None
        cells = cells.own()
        structure: Any = built.structure
        asked = self.leaf
        cursor = np.array(context.scene.cursor.location)

        def work(progress: Progress) -> tuple[int, Any, int]:
            progress.report(0, 1, "Finding the leaf")
            number: int | None = asked
            if asked < 0:
                number = leaf_at(cells, cursor)
            elif not cells.is_leaf[cells.places_of(np.array([asked]))].any():
                raise InputError(f"there is no leaf with the number {asked}")
            if number is None:
                return -1, None, 0
            progress.report(0, 1, "Finding links")
            with announcing(progress, "links"):
                segments, colours, count = links_of(structure, cells, number, progress=progress)
            return number, (segments, colours), count

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        number, picture, count = result
        session.current.set_links(number, picture)
        session.current.draw_paths(properties.event_shown(context.scene.accelscope))
        if number < 0:
            return "There is no leaf at the 3D cursor"
        return f"Leaf {number} has {count} links"


CLASSES = (ACCELSCOPE_OT_show_links,)
