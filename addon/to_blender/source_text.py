"""Our own source in Blender's text editor, to be read."""

from __future__ import annotations

from pathlib import Path

import bpy

from .editors import new_area
from .lesson_scene import OURS, is_ours

CORE = Path(__file__).parents[2] / "core"


def path_of(module: str) -> Path:
    """Return the file of a module below core, such as ``"structures.grid.dda"``."""
    path = CORE.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def open_text(module: str) -> bpy.types.Text:
    """Return a text of a module below core; a copy, so that nobody changes the file by accident."""
    path = path_of(module)
    name = f"core/{path.relative_to(CORE).as_posix()}"
    text = bpy.data.texts.get(name)
    if text is None or OURS not in text:
        text = bpy.data.texts.new(name)
        text[OURS] = True
        text.write(path.read_text(encoding="utf-8"))
    text.cursor_set(0)
    return text


def close_texts() -> None:
    """Remove all such texts."""
    bpy.data.batch_remove([each for each in bpy.data.texts if is_ours(each)])


def editor_in(context: bpy.types.Context) -> bpy.types.Area | None:
    """Return a text editor that is open in a window."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "TEXT_EDITOR":
                return area
    return None


def new_editor() -> bpy.types.Area | None:
    """Return a text editor in a new window; None where there can be no window."""
    return new_area("TEXT_EDITOR")


def show(area: bpy.types.Area, text: bpy.types.Text) -> None:
    """Show a text in a text editor, from its first line."""
    space = area.spaces.active
    space.text = text
    space.top = 0
    space.show_line_numbers = space.show_syntax_highlight = True
