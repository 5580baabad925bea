"""What all panels have in common."""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy

from ..addon import jobs
from ..addon.results.wording import in_lines
from ..addon.settings import properties, ranges
from ..core.settings import has_effect


class SidebarPanel:
    """A panel in the tab AccelScope of the 3D viewport's sidebar; mix it in before `Panel`."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "AccelScope"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel, once the settings are known."""
        layout: bpy.types.UILayout = self.layout  # type: ignore[attr-defined]
        if not properties.is_loaded():
            # A panel must not register anything: it is done a moment later.
            properties.load_soon()
            layout.label(text="Loading...")
            return
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.draw_loaded(context, layout, context.scene.accelscope)

    def draw_loaded(
        self, context: bpy.types.Context, layout: bpy.types.UILayout, root: Any
    ) -> None:
        """Draw the panel; `root` is ``scene.accelscope``."""
        raise NotImplementedError


def draw_settings(layout: bpy.types.UILayout, group: Any, settings_type: type) -> None:
    """Draw the settings that a generated group holds, but for those that change nothing."""
    column = layout.column()
    for field in dataclasses.fields(settings_type):
        if has_effect(field, group):
            column.prop(group, field.name, text=label_beside(field, getattr(group, field.name)))


def label_beside(field: dataclasses.Field, value: Any) -> str:
    """Return the label of a setting; a value that leaves it open is said in a word behind it."""
    label, unset = field.metadata["label"], field.metadata["unset"]
    if not unset:
        return label
    is_open = (tuple(value) if isinstance(field.default, tuple) else value) == field.default
    return f"{label} ({unset.capitalize()})" if is_open else label


def draw_range(layout: bpy.types.UILayout, group: Any, name: str) -> None:
    """Draw a number that ends where its content ends, and its slider.

    See :mod:`..addon.settings.ranges`.
    """
    row = layout.row(align=True)
    row.prop(group, name)
    row.prop(group, ranges.share_of(name), text="", slider=True)


def draw_job(layout: bpy.types.UILayout, job: jobs.Job, width: int) -> None:
    """Draw how far a job is, and the button that stops it; `width` is the region's in pixels."""
    # In the bar is room for some words only: what is said behind a comma stands below.
    what, _, more = job.text.partition(", ")
    row = layout.row(align=True)
    row.progress(factor=job.factor, text=what)
    row.operator("accelscope.cancel", text="", icon="X")
    if more:
        draw_wrapped(layout, more[:1].upper() + more[1:], "NONE", width)
    layout.label(text="Esc to stop")


def draw_figure(layout: bpy.types.UILayout, label: str, text: str) -> None:
    """Draw a figure behind its label, in one column with those above and below."""
    split = layout.split(factor=0.6)
    split.label(text=label)
    column = split.row()
    column.alignment = "RIGHT"
    column.label(text=text)


def draw_explained(layout: bpy.types.UILayout, label: str, text: str, meaning: str) -> None:
    """Draw a figure behind its label, whose tooltip says what it means."""
    share = len(label) / (len(label) + len(text))
    split = layout.split(factor=min(max(share, 0.2), 0.65))
    if meaning:
        row = split.row()
        row.alignment = "LEFT"
        row.operator("accelscope.explain_figure", text=label, emboss=False).meaning = meaning
    else:
        split.label(text=label)
    column = split.row()
    column.alignment = "RIGHT"
    column.label(text=text)


def draw_wrapped(layout: bpy.types.UILayout, text: str, icon: str, width: int) -> None:
    """Draw a text over as many lines as it needs; `width` is that of the region in pixels."""
    # About the width of a character in the interface's font.
    characters = max(int(width / (7.0 * bpy.context.preferences.system.ui_scale)) - 5, 16)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(in_lines(text, characters)):
        column.label(text=line, icon=icon if number == 0 or icon == "NONE" else "BLANK1")
