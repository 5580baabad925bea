"""Editors of Blender's in windows of their own."""

from __future__ import annotations

import bpy


def new_area(kind: str) -> bpy.types.Area | None:
    """Return an editor of a kind in a new window; None where there can be no window."""
    if bpy.app.background:
        return None
    before = set(bpy.context.window_manager.windows)
    bpy.ops.wm.window_new()
    opened = next(each for each in bpy.context.window_manager.windows if each not in before)
    area = max(opened.screen.areas, key=lambda each: each.width * each.height)
    area.type = kind
    return area
