"""Compare refit and rebuild over the frames of the timeline."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import extraction, jobs, properties, session, timeline
from ..addon.snapshot import Snapshot
from ..core.errors import InputError
from ..core.progress import Progress


class ACCELSCOPE_OT_compare_over_timeline(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.compare_over_timeline"
    bl_label = "Compare over Timeline"
    bl_description = (
        "Build in the first frame of the timeline, refit in every other one, and compare with "
        "a tree built anew for each. The curve of cost becomes an exhibit"
    )
    bl_options = {"REGISTER"}

    job_text = "Comparing"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if properties.is_loaded() and context.scene.accelscope.structure != "bvh":
            cls.poll_message_set("Choose BVH as the structure: others cannot be refitted")
            return False
        if not extraction.has_members(context.view_layer, extraction.VISIBLE):
            cls.poll_message_set("There is no visible mesh object to build over")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.evaluation.animation import animate
        from ..core.evaluation.experiment import build, make_record
        from ..core.evaluation.workloads import RandomLinesSettings, RandomLinesWorkload
        from ..core.structures.bvh import BVH

        root = context.scene.accelscope
        structure, settings = properties.structure_and_settings(root)
        if structure is not BVH:
            raise InputError(f"only bvh can be refitted, not {root.structure}")
        # What is shown now is what will be shown afterwards: the tree of this frame.
        snapshot = Snapshot.take(context, root.scope)
        numbers = timeline.frame_range(context.scene)
        self.frames = timeline.Frames(context, root.scope, numbers)

        def work(progress: Progress) -> tuple[Any, ...]:
            lines = RandomLinesSettings(count=20_000)
            scenes = self.frames.iterate(progress)
            found = animate(scenes, settings, RandomLinesWorkload, lines, progress=progress)
            built = build(snapshot.scene, BVH, settings, progress)
            assert isinstance(built.structure, BVH)
            built.structure.history = found.history
            cells = built.structure.cells()
            return found, (snapshot, built, cells, make_record(built, None))

        return work

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "TIMER":
            # Only here may Blender be asked for another frame.
            self.frames.serve()
        return super().modal(context, event)

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        from ..core.evaluation.animation import growth
        from ..core.evaluation.report import show_number

        self.frames.restore()
        found, results = result
        session.current.set_built(*results)
        session.current.timeline = found.records
        first, last = found.history[0], found.history[-1]
        return (
            f"Frames {first.frame} to {last.frame}: SAH {show_number(last.refit)} refitted, "
            f"{show_number(last.rebuild)} built anew, "
            f"{show_number(growth(*found.records[-2:]))} times as much"
        )

    def give_up(self) -> None:
        if hasattr(self, "frames"):
            self.frames.restore()


CLASSES = (ACCELSCOPE_OT_compare_over_timeline,)
