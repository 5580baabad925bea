"""Make what the panels of exhibits and of the split plane ask for, and draw it."""

from __future__ import annotations

from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import session
from ..core.progress import Progress


class ACCELSCOPE_OT_show_frame(jobs.JobOperator, bpy.types.Operator):
    bl_idname = "accelscope.show_frame"
    bl_label = "Show Frame"
    bl_description = (
        "Make this frame of the exhibit, or sort the triangles for the split plane, and draw it. "
        "It may take as long as a build; Esc stops it"
    )
    bl_options = {"INTERNAL"}

    job_text = "Making the frame"
    refused_text = "Not shown"
    head_start = 0.1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if jobs.keep_waiting(cls):
            return False
        root, view = context.scene.accelscope, session.current.split_view
        if view is None:
            cls.poll_message_set("Build a structure first")
            return False
        if not (session.current.showcase.wanted(root.exhibits) or view.wanted(root.split_plane)):
            cls.poll_message_set("Show an exhibit or the split plane first")
            return False
        return True

    def prepare(self, context: bpy.types.Context) -> jobs.Work:
        from ..core.kernels import announcing

        root = context.scene.accelscope
        showcase, view = session.current.showcase, session.current.split_view
        assert view is not None
        key, axis = showcase.wanted(root.exhibits), view.wanted(root.split_plane)

        def work(progress: Progress) -> tuple[Any, ...]:
            if axis is not None and axis not in view.axes:
                # Kept at once: a frame that fails, or is not waited for, is no fault of the plane.
                view.axes[axis] = view.make(axis, progress)
            frames = {}
            if key is not None and key not in showcase.frames:
                with announcing(progress, "the exhibit"):
                    frames[key] = showcase.make(key, progress)
            return showcase, frames

        return work

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        showcase, frames = result
        for key, frame in frames.items():
            showcase.keep(key, frame)
        # The panels may ask for something else by now.
        session.current.show_exhibit(context)
        session.current.show_plane(context)
        return ""

    def give_up(self) -> None:
        view, root = session.current.split_view, bpy.context.scene.accelscope
        if view is not None and view.wanted(root.split_plane) in view.axes:
            session.current.show_plane(bpy.context)


CLASSES = (ACCELSCOPE_OT_show_frame,)
