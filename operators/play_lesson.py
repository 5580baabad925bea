"""Play the lesson anew, after a knob that decides what is played."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import lesson_view
from ..addon.results.lesson_view import Ready
from ..core.progress import Progress


class ACCELSCOPE_OT_play_lesson(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.play_lesson"
    bl_label = "Show"
    bl_description = (
        "Show the lesson with these knobs. It may take as long as a build; Esc stops it, and what "
        "is shown stays"
    )
    bl_options = {"INTERNAL"}

    job_text = "Preparing the picture"
    refused_text = "Not shown"
    head_start = 0.1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if not lesson_view.current.is_in(context.scene):
            cls.poll_message_set("Teach a lesson first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.kernels import announcing

        lesson, subject = lesson_view.current.lesson, lesson_view.current.subject
        assert lesson is not None
        assert subject is not None
        settings = lesson_view.settings_of(context.scene, lesson)

        def work(progress: Progress) -> Ready:
            progress.report(0, 1, "Preparing the picture")
            with announcing(progress, "the lesson"):
                play = lesson.play(subject, settings, progress)
            return Ready(lesson, subject, play, settings)

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        view, owner = lesson_view.current, lesson_view.owner_scene()
        if owner is not None and result.subject is view.subject:  # no other lesson has come since
            view.keep_play(result)
            view.follow(owner)
        return ""


CLASSES = (ACCELSCOPE_OT_play_lesson,)
