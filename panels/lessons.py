"""Panel: the lessons of the lecture, and the one that is taught."""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy

from ..addon import jobs
from ..addon.results import film, lesson_view, session
from ..addon.settings import ranges
from ..core.settings import has_effect
from .base import SidebarPanel, draw_explained, draw_job, draw_range, draw_wrapped, label_beside


class VIEW3D_PT_accelscope_lessons(SidebarPanel, bpy.types.Panel):
    bl_label = "Lessons"
    bl_order = 0

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        view, width = lesson_view.current, context.region.width
        lesson, is_shown = lesson_view.chosen(context.scene), view.is_in(context.scene)
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator("accelscope.step_lesson", text="", icon="TRIA_LEFT").by = -1
        row.prop(root.teaching, "lesson", text="")
        row.operator("accelscope.step_lesson", text="", icon="TRIA_RIGHT").by = 1
        column.label(text=f"Slide: {lesson.slide}")
        draw_wrapped(layout, lesson.begin, "NONE", width)

        job = jobs.running()
        if job:
            draw_job(layout, job, width)
        else:
            self.draw_buttons(layout, context.scene, is_shown)
            if reason := jobs.refusal(lesson_view.TEACH, lesson_view.PLAY):
                draw_wrapped(layout, reason, "CANCEL", width)
        if is_shown and view.lesson is not None:
            if view.lesson != lesson:
                draw_wrapped(layout, f"Shown: {view.lesson.label}", "INFO", width)
            self.draw_lesson(layout, context, root, width)

    def draw_buttons(
        self, layout: bpy.types.UILayout, scene: bpy.types.Scene, is_shown: bool
    ) -> None:
        """Draw what begins and ends a lesson."""
        column = layout.column(align=True)
        if not is_shown:
            row = column.row()
            row.scale_y = 1.8
            row.operator("accelscope.teach", icon="PLAY").subject = "SAMPLE"
        row = column.row(align=True)
        row.scale_y = 1.2
        if lesson_view.can_end_in(scene):
            row.operator("accelscope.end_lesson", icon="LOOP_BACK")
        if not is_shown or not lesson_view.current.is_own:
            row.operator("accelscope.use_my_mesh")

    def draw_lesson(
        self, layout: bpy.types.UILayout, context: bpy.types.Context, root: Any, width: int
    ) -> None:
        """Draw the lesson that is shown: knobs, figures, what to look for, the question."""
        view, teaching = lesson_view.current, root.teaching
        lesson, picture = view.lesson, view.picture
        assert lesson is not None
        self.draw_knobs(layout, lesson_view.group_of(context.scene, lesson), lesson)
        if change := session.current.lesson_change(context):
            draw_wrapped(layout, f"Out of date: {change}", "ERROR", width)
            layout.operator("accelscope.use_my_mesh", text="Use It as It Is Now")
        if view.fault:
            draw_wrapped(layout, view.fault, "CANCEL", width)
        if picture is not None:
            if picture.rows:
                box = layout.box().column(align=True)
                for each in picture.rows:
                    draw_explained(box, each.label, each.text, each.meaning)
            draw_wrapped(layout, picture.caption, "NONE", width)
            if picture.images:
                layout.operator("accelscope.open_lesson_image", icon="IMAGE_DATA")
        self.draw_ray(layout, lesson, teaching)
        draw_titled(layout, "Look For", lesson.look_for, width)
        draw_titled(layout, "Question", lesson.question, width)
        icon = "DOWNARROW_HLT" if teaching.show_answer else "RIGHTARROW"
        row = layout.row()
        row.use_property_split = False
        row.prop(teaching, "show_answer", toggle=True, icon=icon)
        if teaching.show_answer:
            draw_wrapped(layout, lesson.answer, "NONE", width)
        row = layout.row(align=True)
        row.operator("accelscope.view_lesson", icon="ZOOM_SELECTED")
        row.operator("accelscope.read_source", icon="TEXT")
        row = layout.row(align=True)
        row.use_property_split = False
        row.prop(teaching, "large_text", toggle=True)
        if session.current.built is not None:
            row.prop(teaching, "hide_cells", toggle=True)

    def draw_ray(self, layout: bpy.types.UILayout, lesson: Any, teaching: Any) -> None:
        """Draw what chooses a ray."""
        view = lesson_view.current
        row = layout.row(align=True)
        row.use_property_split = False
        if lesson.takes_ray or view.has_pixels():
            text = "Pick Ray" if lesson.takes_ray else "Pick Pixel"
            row.operator("accelscope.pick_ray", text=text, icon="EYEDROPPER")
        if lesson.takes_ray:
            row.prop(teaching, "aim", toggle=True, icon="EMPTY_ARROWS")
        if view.has_pixels():
            row.operator("accelscope.step_this_ray", icon="TRACKING_FORWARDS")
            layout.operator("accelscope.use_this_view", icon="VIEW_CAMERA_UNSELECTED")

    def draw_knobs(self, layout: bpy.types.UILayout, group: Any, lesson: Any) -> None:
        """Draw the knobs that have an effect; behind that of the film, what steps and plays it."""
        for each in dataclasses.fields(lesson.Settings):
            if not has_effect(each, group):
                continue
            if ranges.share_of(each.name) in group.bl_rna.properties:
                draw_range(layout, group, each.name)
            else:
                text = label_beside(each, getattr(group, each.name))
                is_share = each.metadata["maximum"] is not None
                layout.prop(group, each.name, text=text, slider=is_share)
            if each.name == lesson.film:
                row = layout.row(align=True)
                row.operator("accelscope.step_film", text="", icon="TRIA_LEFT").by = -1
                icon, text = ("PAUSE", "Pause") if film.is_playing() else ("PLAY", "Play")
                row.operator("accelscope.play_film", text=text, icon=icon)
                row.operator("accelscope.step_film", text="", icon="TRIA_RIGHT").by = 1
                row.operator(
                    "accelscope.film_on_timeline", text="", icon="TIME",
                    depress=film.is_on_timeline(group.id_data),
                )  # fmt: skip


def draw_titled(layout: bpy.types.UILayout, title: str, text: str, width: int) -> None:
    """Draw a text below its title."""
    column = layout.column(align=True)
    column.label(text=title)
    draw_wrapped(column, text, "NONE", width)


CLASSES = (VIEW3D_PT_accelscope_lessons,)
