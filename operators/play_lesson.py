"""Play the lesson anew, after a knob that decides what is played."""

from __future__ import annotations

import functools
from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import lesson_view, session
from ..addon.results.lesson_view import Ready
from ..addon.results.outcome import drawable_since
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

    _has_draft = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return not jobs.keep_waiting(cls) and lesson_view.is_taught(cls, context)

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.kernels import announcing

        lesson, subject = lesson_view.current.lesson, lesson_view.current.subject
        assert lesson is not None
        assert subject is not None
        settings = lesson_view.settings_of(context.scene, lesson)
        ready = self._ready = functools.partial(Ready, lesson, subject, settings=settings)

        built = session.current.built
        given = [s for s in subject.structures if built is not None and s is built.structure]
        made = given[0].made() if given else None

        def work(progress: Progress) -> tuple[Ready, Any]:
            progress.report(0, 1, "Preparing the picture")
            with announcing(progress, "the lesson"):
                play = lesson.play(subject, settings, progress)
            drawable = drawable_since(made, given[0], progress) if given else None
            return ready(play), drawable

        return work

    def tick(self, context: bpy.types.Context) -> None:
        """Show what the play has offered since the last tick, if anything."""
        assert self._job is not None
        draft = self._job.take_draft()
        if draft is not None:
            self._has_draft = show(self._ready(draft))

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        ready, drawable = result
        if show(ready) and drawable is not None:
            session.current.set_cells(drawable)
        return ""

    def give_up(self) -> None:
        if self._has_draft:  # it stays, and the next knob has all of it played
            lesson_view.current.played_with = None


def show(ready: Ready) -> bool:
    """Show what was played, if no other lesson has come since; return whether it is shown."""
    view, owner = lesson_view.current, lesson_view.owner_scene()
    if owner is None or ready.subject is not view.subject:
        return False
    view.keep_play(ready)
    view.follow(owner)
    return True


CLASSES = (ACCELSCOPE_OT_play_lesson,)
