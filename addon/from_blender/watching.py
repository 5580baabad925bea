"""Watching: whether Blender still shows what was built over.

Handlers only mark what may have changed; a timer compares it with what was built over
(:mod:`.snapshot`), a little at a time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import bpy
from bpy.app.handlers import persistent

from .. import handlers, jobs
from ..drawing import overlay
from .snapshot import Look

DELAY = 0.15
"""Seconds without an update before the scene is compared: during a drag there are many."""

AT_ONCE = 0.03
"""Seconds that Blender may be held up by comparing; what is left waits for the next time."""

PAUSE = 0.01
"""Seconds that Blender gets in between."""

watched: list[Look] = []
"""How the scene looked that was built over, and those looked that work under way has taken."""

_last_update = 0.0

_found: list[str] = []
"""The changes that the last comparison has found."""


@persistent
def _after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Mark what Blender has evaluated: by an edit or for another frame."""
    global _last_update
    # Rendering evaluates a scene of its own, perhaps in another thread.
    if depsgraph.mode != "VIEWPORT" or not watched:
        return
    looks = [each for each in watched if each.owner == scene.original.session_uid]
    is_news = [look.note_updates(depsgraph) for look in looks]
    if not all(each.is_settled for each in looks):
        _last_update = time.monotonic()
        compare_soon()
    if any(is_news) and not bpy.app.background:
        jobs.redraw_sidebars()  # what they say may not be true any more


@persistent
def _after_undo(*_: Any) -> None:
    for look in watched:
        look.note_everything()
    compare_soon()


def compare_soon() -> None:
    """Compare with the scene once Blender has time; without a window, whoever asks compares."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_compare):
        bpy.app.timers.register(_compare, first_interval=DELAY)


def _compare() -> float | None:
    """Compare what is watched with what windows show, a little at a time; return when to go on."""
    waiting = list(_waiting())
    if not waiting:
        return None
    wait = _last_update + DELAY - time.monotonic()
    if wait > 0.0 or jobs.running() or is_playing():
        return max(wait, DELAY)
    until = time.monotonic() + AT_ONCE
    for look, window in waiting:
        with in_window(window):
            is_complete = look.compare(bpy.context.evaluated_depsgraph_get(), until)
        if not is_complete:
            return PAUSE
    found = [layer.change for look in watched for layer in look.layers.values()]
    if found == _found:
        jobs.redraw_sidebars()
    else:  # what is drawn is faded, or is not any more
        _found[:] = found
        overlay.tag_redraw()
    return None


def _waiting() -> Iterator[tuple[Look, bpy.types.Window]]:
    """Yield what is watched and not known, and a window that shows that scene and view layer.

    Every window has a scene and a view layer of its own. In a timer Blender makes the first window
    the current one, whichever the user works in.
    """
    asked = set()
    for window in bpy.context.window_manager.windows:
        for look in watched:
            key = id(look), window.view_layer.name
            is_shown = look.owner == window.scene.session_uid
            if is_shown and key not in asked and not look.is_settled_for(window.view_layer):
                asked.add(key)
                yield look, window


def in_window(window: bpy.types.Window) -> Any:
    """Return a context in which a window is the current one, with the scene that it shows.

    All three are named, since Blender takes what is not from whoever is the current one otherwise.
    """
    return bpy.context.temp_override(
        window=window, scene=window.scene, view_layer=window.view_layer
    )


def is_playing() -> bool:
    """Say whether an animation is playing: comparing every frame would hold it up."""
    windows = bpy.context.window_manager.windows
    return any(window.screen.is_animation_playing for window in windows)


HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("frame_change_post", _after_update),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
)


def register() -> None:
    """Start listening to Blender."""
    handlers.listen(HANDLERS)


def unregister() -> None:
    """Stop listening."""
    if bpy.app.timers.is_registered(_compare):
        bpy.app.timers.unregister(_compare)
    handlers.stop_listening(HANDLERS)
