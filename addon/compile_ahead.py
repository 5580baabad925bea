"""Compiling ahead, as Blender sees it: started after installation, watched by a timer, stopped.

The work itself is done by another process (:mod:`.preparing`).
"""

from __future__ import annotations

import contextlib
import importlib.util

import bpy

from ..core.kernels import plain
from . import jobs
from .command.prepare import is_done
from .preparing import Preparation

BASE_PACKAGE = __package__.rpartition(".")[0]

LATER, OFTEN = 2.0, 1.0
"""Seconds after which it starts, and between two looks at how far it is."""

FEW_ITEMS = 5000
"""A structure over so many is quicker built by plain Python than compiled for."""

_running: list[Preparation] = []


def running() -> Preparation | None:
    """Return the process at work, if there is one."""
    return _running[0] if _running and _running[0].is_running else None


def is_wanted() -> bool:
    """Say whether the preferences ask for it; true where there are none."""
    addon = bpy.context.preferences.addons.get(BASE_PACKAGE)
    return addon is None or addon.preferences is None or addon.preferences.compile_ahead


def start_soon() -> None:
    """Start it in a moment, in a Blender with windows; no effect if there is nothing to do.

    Another file that is loaded meanwhile does not stop it.
    """
    if not bpy.app.background and not bpy.app.timers.is_registered(_start):
        bpy.app.timers.register(_start, first_interval=LATER, persistent=True)


def stop() -> None:
    """End it, or do not start it; what has been compiled is kept."""
    for timer in (_start, _look):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    while _running:
        _running.pop().stop()


def plain_for(items: int) -> contextlib.AbstractContextManager[None]:
    """Return what has work on a small scene done by plain Python, while kernels are compiled.

    Parameters
    ----------
    items : int
        Of the scene.
    """
    return plain(running() is not None and items <= FEW_ITEMS)


def _start() -> None:
    if running() or not is_wanted() or importlib.util.find_spec("numba") is None:
        return
    if is_done():
        return
    _running[:] = [Preparation(BASE_PACKAGE, kernel_folder())]
    bpy.app.timers.register(_look, first_interval=OFTEN, persistent=True)


def kernel_folder() -> str:
    """Return where an extension keeps compiled kernels; empty for the platform's usual place.

    It is made when the first kernel is compiled; if that fails, kernels are not kept.
    """
    try:
        return bpy.utils.extension_path_user(BASE_PACKAGE, path="kernels")
    except ValueError:
        return ""


def _look() -> float | None:
    jobs.redraw_sidebars()
    return OFTEN if running() else None
