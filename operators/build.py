"""Build the chosen structure over the scene."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import compile_ahead, jobs
from ..addon.from_blender import extraction
from ..addon.results import session
from ..addon.results.outcome import Outcome
from ..addon.settings import choices, properties
from ..core.progress import Progress


class ACCELSCOPE_OT_build(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.build"
    bl_label = "Build"
    bl_description = (
        "Build the acceleration structure over the evaluated meshes in scope. "
        "Esc stops it and leaves the previous one"
    )
    bl_options = {"REGISTER"}

    job_text = "Building"
    refused_text = "Not built"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        scope = extraction.VISIBLE
        if properties.is_loaded():
            scope = context.scene.accelscope.scope
        if not extraction.has_members(context.view_layer, scope):
            cls.poll_message_set(f"There is no {scope} mesh object to build over")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.evaluation.records.experiment import build

        root = context.scene.accelscope
        structure, settings = choices.structure_and_settings(root)
        taken = session.current.take(context, root.scope, root.instances)

        def work(progress: Progress) -> Outcome:
            snapshot = taken.snapshot(progress)
            with compile_ahead.plain_for(len(snapshot.scene)):
                built = build(snapshot.scene, structure, settings, progress, log=True)
                return Outcome.of(snapshot, built, progress)

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        session.current.set_built(result)
        text = session.current.headline()
        if dropped := result.snapshot.scene.dropped:
            text += f"; {dropped} triangles that are not finite were left out"
        return "; ".join([text, *result.snapshot.scene.notes])

    def give_up(self) -> None:
        session.current.watch()


CLASSES = (ACCELSCOPE_OT_build,)
