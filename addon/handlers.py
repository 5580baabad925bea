"""Handlers: functions of ours that Blender calls when something has happened."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import bpy

Handlers = Iterable[tuple[str, Callable[..., Any]]]
"""Names of Blender's events (``"load_post"``), each with what is to be called."""


def listen(handlers: Handlers) -> None:
    """Have Blender call them from now on."""
    for event, handler in handlers:
        getattr(bpy.app.handlers, event).append(handler)


def stop_listening(handlers: Handlers) -> None:
    """Have Blender call them no more; it may have dropped them already."""
    for event, handler in handlers:
        registered = getattr(bpy.app.handlers, event)
        if handler in registered:
            registered.remove(handler)
