"""Go from a lesson that shows a ray, such as the pixel of a heat map, to that ray step by step."""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import lesson_view
from ..addon.results.lesson_view import Ready
from ..core.progress import Progress
from .teach import begin


class ACCELSCOPE_OT_step_this_ray(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.step_this_ray"
    bl_label = "Step This Ray"
    bl_description = "Step through the ray of the chosen pixel, event by event"
    bl_options = {"INTERNAL"}

    job_text = "Recording the ray"
    refused_text = "Not shown"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if not lesson_view.current.is_in(context.scene) or lesson_view.current.ray() is None:
            cls.poll_message_set("Teach a lesson with a heat map first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.lessons import lesson_named

        view, lesson = lesson_view.current, lesson_named("ray")
        assert view.subject is not None
        subject = dataclasses.replace(view.subject, rays=view.ray(), ray=0)
        group = lesson_view.group_of(context.scene, lesson)
        group.ray, group.event = 0, 0
        settings = lesson_view.settings_of(context.scene, lesson)

        def work(progress: Progress) -> Ready:
            return Ready(lesson, subject, lesson.play(subject, settings, progress), settings)

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        owner = lesson_view.owner_scene()
        if owner is not None:
            begin(result, owner, lesson_view.current.is_own)
        return result.lesson.label


CLASSES = (ACCELSCOPE_OT_step_this_ray,)
