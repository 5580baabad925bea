"""Bake the cells that are shown into a mesh object."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.drawing.selection import Shown
from ..addon.results import session
from ..core.errors import InputError
from ..core.progress import Progress


class ACCELSCOPE_OT_bake(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.bake"
    bl_label = "Bake to Meshes"
    bl_description = (
        "Make a mesh object of the edges of the cells that are shown, with depth and other "
        "figures as attributes, in the collection AccelScope. Esc stops it"
    )
    bl_options = {"REGISTER", "UNDO"}

    job_text = "Baking"
    refused_text = "Not baked"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.drawable is None:
            cls.poll_message_set("Build a structure first")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..addon.to_blender import bake

        built, drawable = session.current.built, session.current.drawable
        assert built is not None
        assert drawable is not None
        shown = Shown.by(context.scene.accelscope.display)
        scene, name = context.scene, f"{built.structure.label} Cells"
        # A thread must not touch the operator itself.
        self.errands = errands = jobs.Errands()
        begun: list[Any] = []
        self.begun = begun

        def work(progress: Progress) -> str:
            edges = bake.edges_of(drawable, shown, progress)
            making = bake.making(scene, edges, name)
            begun.append(making)
            for step in range(bake.STEPS + 1):
                made = errands.run(
                    lambda: next_of(making), progress, step, bake.STEPS, "Making the mesh"
                )
            return f"{made}: {edges.n_edges} edges"

        return work

    def tick(self, context: bpy.types.Context) -> None:
        self.errands.serve()

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        return result

    def give_up(self) -> None:
        for making in getattr(self, "begun", ()):
            making.close()


def next_of(making: Any) -> str:
    """Do the next step of a generator; return the name of the object if that was the last one.

    Raises
    ------
    InputError
        When Blender has taken away what was made so far, as by an undo.
    """
    try:
        next(making)
    except StopIteration as stop:
        return stop.value.name
    except ReferenceError:
        raise InputError("the file was changed meanwhile, as by an undo; bake again") from None
    return ""


CLASSES = (ACCELSCOPE_OT_bake,)
