"""Compare refit and rebuild over the frames of the timeline."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy

from ..addon import jobs
from ..addon.from_blender import extraction, timeline
from ..addon.from_blender.snapshot import Look
from ..addon.results import session
from ..addon.results.outcome import Outcome
from ..addon.settings import choices, properties
from ..core.errors import InputError
from ..core.progress import Progress
from ..core.scene.placing import FLATTEN, OBJECTS

if TYPE_CHECKING:
    from ..core.evaluation.records.animation import Comparison


class ACCELSCOPE_OT_compare_over_timeline(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.compare_over_timeline"
    bl_label = "Compare over Timeline"
    bl_description = (
        "Build in the first frame of the timeline, refit in every other one, and compare with "
        "a tree built anew for each. The lesson Refit over the Timeline shows "
        "it frame by frame on your mesh. Instances are flattened, but of two levels the top one is "
        "built anew and the others are kept or refitted"
    )
    bl_options = {"REGISTER"}

    job_text = "Comparing"
    refused_text = "Not compared"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if properties.is_loaded():
            structure = choices.structure_chosen(context.scene.accelscope)
            if not choices.is_refittable(structure):
                known = choices.refittable_labels()
                cls.poll_message_set(f"Choose {known} as the structure: others cannot be refitted")
                return False
        if not extraction.has_members(context.view_layer, extraction.VISIBLE):
            cls.poll_message_set("There is no visible mesh object to build over")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
        from ..core.evaluation.records.animation import animate
        from ..core.evaluation.records.experiment import build

        root = context.scene.accelscope
        structure: Any
        structure, settings = choices.structure_and_settings(root)
        if not choices.is_refittable(structure):
            raise InputError(
                f"only {choices.refittable_labels()} can be refitted, not {structure.label}"
            )
        # What is shown now is what will be shown afterwards: the tree of this frame.
        instances = OBJECTS if structure.keeps_instances else FLATTEN
        taken = session.current.take(context, root.scope, instances)
        numbers = timeline.frame_range(context.scene)

        def watch(look: Look) -> None:
            session.current.watch(taken.look, look)

        # A thread must not touch the operator itself.
        self.frames = frames = timeline.Frames(context, root.scope, numbers, watch, instances)

        def work(progress: Progress) -> tuple[Comparison, Outcome]:
            lines = RandomLinesSettings(count=20_000)
            scenes = frames.iterate(progress)
            found = animate(
                scenes, structure, settings, RandomLinesWorkload, lines, progress=progress
            )
            snapshot = taken.snapshot(progress)
            built = build(snapshot.scene, structure, settings, progress)
            return found, Outcome.of(snapshot, built, progress, found.history)

        return work

    def tick(self, context: bpy.types.Context) -> None:
        # Only here may Blender be asked for another frame.
        self.frames.serve()

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        from ..core.evaluation.records.animation import growth
        from ..core.evaluation.records.report import show_number

        self.frames.restore()
        found, outcome = result
        session.current.set_built(outcome)
        session.current.timeline = found.records
        first, last = found.history[0], found.history[-1]
        flattened = "; instances were flattened" * (outcome.snapshot.look.instances == FLATTEN)
        return (
            f"Frames {first.frame} to {last.frame}: SAH {show_number(last.refit)} refitted, "
            f"{show_number(last.rebuild)} built anew, "
            f"{show_number(growth(*found.records[-2:]))} times as much{flattened}"
        )

    def give_up(self) -> None:
        session.current.watch()
        if hasattr(self, "frames"):
            self.frames.restore()


CLASSES = (ACCELSCOPE_OT_compare_over_timeline,)
