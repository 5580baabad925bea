"""Bake the cells that are shown into a mesh object."""

from __future__ import annotations

import functools
from typing import Any

import bpy

from ..addon import jobs
from ..addon.drawing.selection import Shown, visible
from ..addon.results import lesson_view, session
from ..core.errors import InputError
from ..core.progress import Progress


class ACCELSCOPE_OT_bake(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.bake"
    bl_label = "Bake to Meshes"
    bl_description = (
        "Make a mesh object of the edges of the cells that are shown, with depth and other "
        "figures as attributes, in the collection AccelScope; and another of the lines of the "
        "lesson on your mesh. Esc stops it"
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
        lesson = lesson_view.current.lines_in(context.scene)
        # A thread must not touch the operator itself.
        self.errands = errands = jobs.Errands()
        begun: list[Any] = []
        self.begun = begun

        def work(progress: Progress) -> str:
            meshes = []
            # Without a lesson there has to be a cell, or it says so.
            if lesson is None or visible(drawable.cells, shown).any():
                meshes.append((name, bake.edges_of(drawable, shown, progress)))
            if lesson is not None:
                label, *lines = lesson
                meshes.append((label, bake.edges_of_path(*lines)))
            made = []
            for object_name, edges in meshes:
                making = bake.making(scene, edges, object_name)
                begun.append(making)
                last = bake.steps_of(edges)
                for step in range(last + 1):
                    found = errands.run(
                        functools.partial(next_of, making), progress, step, last,
                        "Making the mesh",
                    )  # fmt: skip
                made.append(f"{found}: {edges.n_edges} edges")
            return "; ".join(made)

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
