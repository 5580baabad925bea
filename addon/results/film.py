"""The film of a lesson: its knob from the first to the last value, by steps or by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
from bpy.app.handlers import persistent

from .. import handlers
from . import lesson_view
from .lesson_view import current

WHOLE, SLOWEST, FASTEST = 12.0, 1.0, 0.1
"""Seconds that a film takes, if no picture then stands longer or shorter than these seconds."""

_playing = 0
"""Session id of the scene whose film plays by itself; 0 for none."""

BEFORE = "accelscope_timeline"
"""Property of a scene: its first, last and current frame before the film was put on its timeline.

There it is undone, and saved, with the frames themselves.
"""


def values() -> Sequence[Any]:
    """Return all values of the knob."""
    assert current.lesson is not None
    assert current.play is not None
    return current.play.film(current.lesson)


def place(scene: bpy.types.Scene) -> int:
    """Return which of them the knob has, or comes nearest to."""
    assert current.lesson is not None
    value, there = (
        getattr(lesson_view.settings_of(scene, current.lesson), current.lesson.film),
        values(),
    )
    if value in there:
        return there.index(value)
    if isinstance(value, str):
        return 0
    return min(range(len(there)), key=lambda number: abs(there[number] - value))


def go_to(scene: bpy.types.Scene, number: int) -> None:
    """Set the knob to one of its values, the nearest to a number."""
    assert current.lesson is not None
    there = values()
    value = there[min(max(number, 0), len(there) - 1)]
    group = lesson_view.group_of(scene, current.lesson)
    if getattr(group, current.lesson.film) != value:
        setattr(group, current.lesson.film, value)


# --------------------------------------------------------------------------------- by itself


def is_playing() -> bool:
    """Say whether the film plays by itself."""
    return _playing != 0


def start(scene: bpy.types.Scene) -> None:
    """Play from where the knob is, or from the first picture if it is at the last."""
    global _playing
    if place(scene) == len(values()) - 1:
        go_to(scene, 0)
    _playing = scene.session_uid
    if not bpy.app.timers.is_registered(_next):
        bpy.app.timers.register(_next, first_interval=_pause())


def stop() -> None:
    """Stop it."""
    global _playing
    _playing = 0


def _pause() -> float:
    return min(max(WHOLE / len(values()), FASTEST), SLOWEST)


def _next() -> float | None:
    scene = lesson_view.owner_scene()
    if scene is None or scene.session_uid != _playing or not current.is_in(scene):
        stop()
        return None
    number = place(scene)
    if number == len(values()) - 1:
        stop()
        current.follow(scene)  # the button to play is drawn again
        return None
    go_to(scene, number + 1)
    return _pause()


# ------------------------------------------------------------------------------ on the timeline


def is_on_timeline(scene: bpy.types.Scene) -> bool:
    """Say whether the frames of a scene's timeline are the pictures."""
    return BEFORE in scene


def bind_timeline(scene: bpy.types.Scene) -> None:
    """Put the film on the timeline of a scene, from its first frame on."""
    if not is_on_timeline(scene):
        scene[BEFORE] = scene.frame_start, scene.frame_end, scene.frame_current
    scene.frame_end = scene.frame_start + len(values()) - 1
    scene.frame_set(scene.frame_start + place(scene))


def free_timeline(scene: bpy.types.Scene) -> None:
    """Give a scene its own timeline back, if the film is on it."""
    if is_on_timeline(scene):
        scene.frame_start, scene.frame_end, frame = scene.pop(BEFORE)
        scene.frame_set(frame)


@persistent
def _after_frame_change(scene: bpy.types.Scene, *_: Any) -> None:
    is_shown = is_on_timeline(scene.original) and current.is_in(scene.original)
    if is_shown and not bpy.app.is_job_running("RENDER"):
        go_to(scene.original, scene.frame_current - scene.frame_start)


@persistent
def _after_undo(*_: Any) -> None:
    """Give timelines back that have a film on them which is not shown any more."""
    for scene in bpy.data.scenes:
        if not current.is_in(scene):
            free_timeline(scene)


@persistent
def _after_load(*_: Any) -> None:
    stop()
    _after_undo()


HANDLERS = (
    ("frame_change_post", _after_frame_change),
    ("load_post", _after_load),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
)


def register() -> None:
    """Start listening to Blender."""
    handlers.listen(HANDLERS)


def unregister() -> None:
    """Stop listening and playing."""
    handlers.stop_listening(HANDLERS)
    stop()
    if bpy.app.timers.is_registered(_next):
        bpy.app.timers.unregister(_next)
