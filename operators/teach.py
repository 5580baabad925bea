"""Teach a lesson: everything it needs is prepared, and its picture stands in the viewport."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
from bpy.props import EnumProperty, StringProperty

from ..addon import jobs
from ..addon.drawing.arrangement import arrange
from ..addon.drawing.viewport import largest, turn_to_front
from ..addon.from_blender import extraction
from ..addon.results import film, lesson_view, session
from ..addon.results.lesson_view import Ready
from ..addon.results.outcome import drawable_since
from ..addon.to_blender import lesson_scene
from ..core.progress import Progress

if TYPE_CHECKING:  # importing it for real would import the structures, and Numba with them
    from ..core.lessons.lesson import Play

SAMPLE, MESH, BUILT = "SAMPLE", "MESH", "BUILT"

SUBJECTS = [
    (SAMPLE, "Sample", "The sample scene of the lesson, in a scene of its own"),
    (MESH, "My Mesh", "The selected objects, or all that are visible if none is selected"),
    (BUILT, "What Was Built", "The structure that was built, and the rays that were traced"),
]


class Opening(NamedTuple):
    """What a lesson is opened with.

    Attributes
    ----------
    ready : Ready
    items, label : object, str
        Of the sample; without any the lesson is about a mesh of the user's.
    look : object
        How that mesh looked.
    is_draft : bool
        Whether what was played is a draft.
    drawable : Drawable, optional
        The cells, where rays have made some of them.
    """

    ready: Ready
    items: Any
    label: str
    look: Any
    is_draft: bool
    drawable: Any = None


class ACCELSCOPE_OT_teach(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.teach"
    bl_label = "Teach"
    bl_description = "Prepare a lesson and show it. Esc stops it and leaves everything as it is"
    bl_options = {"UNDO"}

    job_text = "Preparing the lesson"
    refused_text = "Not taught"
    head_start = 0.1

    subject: EnumProperty(  # type: ignore[valid-type]
        name="Subject", description="What the lesson is about", items=SUBJECTS, default=SAMPLE,
        options={"SKIP_SAVE"},
    )  # fmt: skip
    lesson: StringProperty(  # type: ignore[valid-type]
        name="Lesson", description="Its name; without it, the lesson that the list shows",
        options={"SKIP_SAVE", "HIDDEN"},
    )  # fmt: skip

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        if properties.subject == MESH:
            return (
                "Teach the lesson on the selected objects, or on all that are visible if none is "
                "selected. Esc stops it"
            )
        return (
            "Show the lesson on its sample, in a scene of its own: yours stays as it is, and End "
            "Lesson goes back to it. Esc stops it"
        )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.kernels import announcing
        from ..core.lessons import lesson_named
        from ..sample_scenes import sample_and_settings

        lesson = lesson_named(self.lesson) if self.lesson else lesson_view.chosen(context.scene)
        settings = lesson_view.settings_of(context.scene, lesson)
        root, is_own = context.scene.accelscope, self.subject != SAMPLE
        taken, given = None, []
        traced = session.current.traced
        history = session.current.history
        sample, sample_settings = sample_and_settings(lesson.sample)
        built = session.current.built if session.current.is_of(context.scene) else None
        if self.subject == BUILT and built is not None:
            given = [built.structure]
        elif is_own:
            given = session.current.given_for(lesson, context)
        if is_own and not given:
            has_selected = extraction.has_members(context.view_layer, extraction.SELECTED)
            scope = extraction.SELECTED if has_selected else extraction.VISIBLE
            taken = session.current.take(context, scope, root.instances)

        look = taken.look if taken is not None else None
        if given and session.current.snapshot is not None:
            look = session.current.snapshot.look

        made = given[0].made() if given else None
        # A thread must not touch the operator itself.
        begun: list[Callable[[Play], Opening]] = []
        self._begun = begun

        def work(progress: Progress) -> Opening:
            items, label = None, ""
            progress.report(0, 1, "Preparing the lesson")
            if given:
                scene = given[0].scene
            elif taken is not None:
                scene = taken.snapshot(progress).scene
            else:
                scene, items = sample.generate(sample_settings), sample.items(sample_settings)
                label = sample.label
            with announcing(progress, "the lesson"):
                subject = lesson.subject(scene, progress, given)
                if given and traced is not None:
                    subject = dataclasses.replace(subject, rays=traced.rays)
                if is_own and lesson.takes_frames:
                    subject = dataclasses.replace(subject, history=history)

                def opening(play: Play, *, is_draft: bool = True) -> Opening:
                    ready = Ready(lesson, subject, play, settings)
                    return Opening(ready, items, label, look, is_draft)

                # What a structure makes of itself for rays is drawn when all have been traced.
                if made is None:
                    begun.append(opening)
                finished = opening(lesson.play(subject, settings, progress), is_draft=False)
            drawable = drawable_since(made, given[0], progress) if given else None
            return finished._replace(drawable=drawable)

        return work

    def enough(self) -> Opening | None:
        """Open the lesson with the first draft: all of it is played when it can be seen."""
        assert self._job is not None
        draft = self._job.take_draft() if self._begun else None
        return None if draft is None else self._begun[0](draft)

    def finish(self, context: bpy.types.Context, result: Opening) -> str:
        ready, items, label, look, is_draft, drawable = result
        if drawable is not None:
            session.current.set_cells(drawable)
        if label:
            before, lesson = context.scene, ready.lesson
            owner = lesson_scene.open_scene(
                context.window, lesson.sample, ready.subject.scene, label, items
            )
            # A scene that is new is followed by nobody yet.
            lesson_view.copy_settings(lesson, before, owner)
        else:
            # The window may have come to another scene since.
            owner = lesson_view.scene_of(look.owner)
            if owner is None:
                self.give_up()
                return ""
        session.current.lesson_look = look
        session.current.watch()
        left = lesson_view.owner_scene()
        begin(ready, owner, is_own=not label)
        if left is not None and left != owner:
            film.free_timeline(left)
            lesson_view.rearrange()
        area = largest(context.window)
        if area is not None and context.window.scene == owner:
            arrange(area)
            turn_to_front(area)
            lesson_view.current.frame(context, area)
        if is_draft:
            lesson_view.current.play_again(owner)
        return ready.lesson.label

    def give_up(self) -> None:
        session.current.watch()


def begin(ready: Ready, owner: bpy.types.Scene, is_own: bool) -> None:
    """Show a lesson over a scene, name it in the list, and put its film where the last one was."""
    view = lesson_view.current
    view.begin(ready, owner, is_own)
    # Now that the lesson is the one that is taught, naming it asks for no other.
    owner.accelscope.teaching.lesson = ready.lesson.name
    view.follow(owner)
    if film.is_on_timeline(owner):
        film.bind_timeline(owner)


CLASSES = (ACCELSCOPE_OT_teach,)
