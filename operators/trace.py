"""Trace the chosen rays through the structure that was built."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.from_blender.view import View
from ..addon.results import session
from ..addon.results.outcome import drawable_since, seen_from
from ..addon.settings import choices
from ..core.progress import Progress


class ACCELSCOPE_OT_trace(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.trace"
    bl_label = "Trace"
    bl_description = (
        "Trace the rays through the structure and count what they cost. Esc stops it and leaves "
        "the previous figures"
    )
    bl_options = {"REGISTER"}

    job_text = "Tracing"
    refused_text = "Not traced"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if session.current.built is None:
            cls.poll_message_set("Build a structure first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.evaluation.records.experiment import make_record, trace

        workload, settings = choices.workload_and_settings(context.scene.accelscope)
        built, snapshot = session.current.built, session.current.snapshot
        assert built is not None
        assert snapshot is not None
        view = View.of(context)

        def work(progress: Progress) -> tuple[Any, ...]:
            seen, made = seen_from(built, snapshot.shape, view), built.structure.made()
            traced = trace(seen, workload, settings, progress=progress)
            record = make_record(seen, traced, progress)
            return traced, record, drawable_since(made, seen.structure, progress)

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        from ..core.evaluation.records.report import (
            counters_in_words,
            show_seconds,
        )
        from ..core.printing import show_integer

        session.current.set_traced(*result)
        traced, record, _ = result
        return (
            f"{show_integer(len(traced.rays))} rays in {show_seconds(traced.seconds)}, "
            f"{show_integer(record['trace']['hits'])} hits; per ray {counters_in_words(record)}"
        )


CLASSES = (ACCELSCOPE_OT_trace,)
