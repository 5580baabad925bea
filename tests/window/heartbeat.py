"""Measure whether Blender's interface stays alive: how long timers and redraws have to wait."""

from __future__ import annotations

import itertools
import time

import bpy

INTERVAL = 0.01
"""Seconds between two beats that are asked for."""


class Heartbeat:
    """Notes when Blender serves a timer, and when it draws the sidebar.

    Attributes
    ----------
    beats, redraws : list of float
        Times by `time.monotonic`.
    """

    def __init__(self) -> None:
        self.beats: list[float] = []
        self.redraws: list[float] = []
        self._handler = None
        # Blender knows a timer by its object, and Python makes a new one at every access.
        self._timer = self._beat

    def start(self) -> None:
        """Begin."""
        self._handler = bpy.types.SpaceView3D.draw_handler_add(
            self._note_redraw, (), "UI", "POST_PIXEL"
        )
        bpy.app.timers.register(self._timer)

    def stop(self) -> None:
        """End."""
        bpy.app.timers.unregister(self._timer)
        bpy.types.SpaceView3D.draw_handler_remove(self._handler, "UI")

    def _beat(self) -> float:
        self.beats.append(time.monotonic())
        return INTERVAL

    def _note_redraw(self) -> None:
        self.redraws.append(time.monotonic())


def gaps(times: list[float], start: float, end: float) -> list[float]:
    """Return the seconds between one time and the next, from `start` to `end`."""
    within = [start, *(each for each in times if start < each < end), end]
    return [after - before for before, after in itertools.pairwise(within)]


def summary(values: list[float]) -> dict[str, float]:
    """Return how many, the median, what 95 of 100 do not exceed, and the largest."""
    ordered = sorted(values)
    return {
        "count": len(ordered),
        "median": round(ordered[len(ordered) // 2], 3),
        "p95": round(ordered[int(0.95 * (len(ordered) - 1))], 3),
        "maximum": round(ordered[-1], 3),
    }
