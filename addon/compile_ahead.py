"""Compiling ahead, as Blender sees it: started after installation, watched by a timer, stopped.

The work itself is done by another process (:mod:`.preparing`).
"""

from __future__ import annotations

import importlib.util

import bpy

from ..core.kernels import run_plain
from .command.prepare import is_done
from .preparing import Preparation

BASE_PACKAGE = __package__.rpartition(".")[0]

LATER, OFTEN = 2.0, 1.0
"""Seconds after which it starts, and between two looks at how far it is."""

FEW_ITEMS, FEW_RAYS = 5000, 1000
"""So many are quicker done by plain Python than compiled for."""

_running: list[Preparation] = []


def running() -> Preparation | None:
    """Return the process at work, if there is one."""
    return _running[0] if _running and _running[0].is_running else None


def is_wanted() -> bool:
    """Say whether the preferences ask for it; true where there are none."""
    addon = bpy.context.preferences.addons.get(BASE_PACKAGE)
    return addon is None or addon.preferences is None or addon.preferences.compile_ahead


def start_soon() -> None:
    """Start it in a moment, in a Blender with windows; no effect if there is nothing to do."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_start):
        bpy.app.timers.register(_start, first_interval=LATER)


def stop() -> None:
    """End it, or do not start it; what has been compiled is kept."""
    for timer in (_start, _look):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    while _running:
        _running.pop().stop()
    run_plain(False)


def choose_kernels(items: int, rays: int = 0) -> None:
    """Have work on a small scene done by plain Python while kernels are still being compiled.

    Parameters
    ----------
    items, rays : int
        Of the scene, and to be traced.
    """
    run_plain(running() is not None and items <= FEW_ITEMS and rays <= FEW_RAYS)


def _start() -> None:
    if running() or not is_wanted() or importlib.util.find_spec("numba") is None:
        return
    if is_done():
        return
    _running[:] = [Preparation(BASE_PACKAGE, _folder())]
    bpy.app.timers.register(_look, first_interval=OFTEN)


def _folder() -> str:
    """Return where this Blender keeps compiled kernels; empty for the usual place."""
    try:
        return bpy.utils.extension_path_user(BASE_PACKAGE, path="kernels")
    except ValueError:
        return ""


def _look() -> float | None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
    if running():
        return OFTEN
    run_plain(False)
    return None
