"""Refit the hierarchy to the scene as it is now."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from ..addon.results.outcome import Outcome
from ..addon.settings import choices
from ..core.geometry.instances import Instanced
from ..core.progress import Progress
from ..core.scene.placing import FLATTEN, KEEP


class ACCELSCOPE_OT_refit(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.refit"
    bl_label = "Refit"
    bl_description = (
        "Keep the tree and fit its volumes to where the triangles are now, "
        "after the objects were moved or deformed"
    )
    bl_options = {"REGISTER"}

    job_text = "Refitting"
    refused_text = "Not refitted"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        built = session.current.built
        if built is None or not choices.is_refittable(built.structure):
            cls.poll_message_set(f"Build a {choices.refittable_labels()} first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.evaluation.records.experiment import Built
        from ..core.kernels import announcing

        built, known = session.current.built, session.current.snapshot
        assert built is not None
        assert known is not None
        tree: Any = built.structure
        # Over instances the tree is refitted to where they are now.
        instances = known.look.instances or (
            KEEP if isinstance(tree.scene.geometry, Instanced) else FLATTEN
        )
        taken = session.current.take(context, known.look.scope, instances)
        assert session.current.record is not None
        before = session.current.record["statistics"]["sah"]

        def work(progress: Progress) -> tuple[float, Outcome]:
            snapshot = taken.snapshot(progress)
            with announcing(progress, "refit"):
                start = time.perf_counter()
                structure = tree.refitted(snapshot.scene, progress)
            refitted = Built(structure, time.perf_counter() - start)
            return before, Outcome.of(snapshot, refitted, progress, method="refit")

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        from ..core.evaluation.records.report import show_number, show_seconds

        before, outcome = result
        session.current.set_built(outcome)
        after = outcome.record["statistics"]["sah"]
        return (
            f"Refitted in {show_seconds(outcome.built.seconds)}: "
            f"SAH {show_number(after)}, before {show_number(before)}"
        )

    def give_up(self) -> None:
        session.current.watch()


CLASSES = (ACCELSCOPE_OT_refit,)
