"""The 3D viewport: look at given points, whatever else is in the scene.

Blender's own View Selected knows objects only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Vector

from ..from_blender.cameras import VIEW_SENSOR
from .labels import Room

if TYPE_CHECKING:  # importing it for real would import Numba at registration
    from ...core.evaluation.pages.picture_cameras import Slopes

FRONT_RIGHT_ABOVE = (0.55, -0.75, 0.42)
"""Where the eye stands in the pictures of pages, seen from the middle of the scene."""


NARROWEST = 16
"""Pixels below which nothing can be seen in a room."""


def look_at(area: bpy.types.Area, points: np.ndarray, rooms: Sequence[Room] = ()) -> None:
    """Move a viewport, not turn it, so that it just shows all points beside its sidebar.

    Parameters
    ----------
    area : bpy.types.Area
        Of type ``VIEW_3D``.
    points : (n, 3) float64
        At least one.
    rooms : sequence of Room
        Where they may be seen, in pixels: in that of these where they are largest. By default
        wherever nothing covers the viewport.
    """
    space = area.spaces.active
    view = space.region_3d
    if view.view_perspective == "CAMERA":
        view.view_perspective = "PERSP"
    # Blender looks along the third axis, backwards.
    axes = np.array(view.view_rotation.to_matrix()).T * [[1], [1], [-1]]
    seen = points @ axes.T
    is_perspective = view.view_perspective == "PERSP"
    places = [
        _place_for(seen, slopes_of(area, space.lens, room), is_perspective)
        for room in rooms_to_see_in(area, rooms)
    ]
    distance, middle = min(places, key=lambda place: place[0])
    view.view_distance = max(distance, space.clip_start)
    view.view_location = Vector(middle @ axes)


def rooms_to_see_in(area: bpy.types.Area, rooms: Sequence[Room]) -> Sequence[Room]:
    """Return those of some rooms in which something can be seen; some room in any case.

    In a small viewport nothing may be left beside images, nor beside the sidebar.
    """
    window = window_of(area)
    whole = Room(0, 0, max(window.width, 1), max(window.height, 1))
    for candidates in (rooms, [room_in(area)]):
        wide_enough = [
            room
            for room in candidates
            if min(room.right - room.left, room.top - room.bottom) >= NARROWEST
        ]
        if wide_enough:
            return wide_enough
    return [whole]


def _place_for(seen: np.ndarray, slopes: Slopes, is_perspective: bool) -> tuple[float, np.ndarray]:
    """Return how far to stand from where to look, and that, (3,), so that all points are seen.

    Parameters
    ----------
    seen : (n, 3) float64
        The points: to the right, up, and forward.
    """
    from ...core.evaluation.pages.picture_cameras import standpoint

    low, high = seen.min(axis=0), seen.max(axis=0)
    middle = 0.5 * (low + high)
    if is_perspective:
        place = standpoint(seen, slopes)
        distance = float(middle[2] - place[2])
        middle[:2] = place[:2]
        return distance, middle
    # Parallel rays: the distance only says how much is seen.
    distance = max(size / sum(slope) for size, slope in zip(high - low, slopes, strict=False))
    middle[:2] += [0.5 * (before - behind) * distance for before, behind in slopes]
    return distance, middle


def slopes_of(area: bpy.types.Area, lens: float, room: Room | None = None) -> Slopes:
    """Return how far a viewport shows to the left and right, down and up, per distance forward.

    What headers, toolbar and sidebar cover does not count.
    """
    from ...core.evaluation.pages.picture_cameras import MARGIN

    window, room = window_of(area), room or room_in(area)
    # In units of half a pixel.
    unit = MARGIN * VIEW_SENSOR / lens / max(window.width, window.height)
    left, right = unit * (window.width - 2 * room.left), unit * (2 * room.right - window.width)
    down, up = unit * (window.height - 2 * room.bottom), unit * (2 * room.top - window.height)
    return (left, right), (down, up)


def window_of(area: bpy.types.Area) -> bpy.types.Region:
    """Return the region of a viewport that the scene is drawn in."""
    return next(region for region in area.regions if region.type == "WINDOW")


def room_in(area: bpy.types.Area) -> Room:
    """Return what headers, toolbar and sidebar leave of that region, in its pixels."""
    window = window_of(area)
    covered = dict.fromkeys(("LEFT", "RIGHT", "BOTTOM", "TOP"), 0)
    for region in area.regions:
        # A region that is hidden has one pixel; one that stands beside the window covers nothing.
        if region.alignment in covered and region.width > 1 and region.height > 1:
            reach = {
                "LEFT": region.x + region.width - window.x,
                "RIGHT": window.x + window.width - region.x,
                "BOTTOM": region.y + region.height - window.y,
                "TOP": window.y + window.height - region.y,
            }[region.alignment]
            covered[region.alignment] = max(covered[region.alignment], reach)
    return Room(
        covered["LEFT"], covered["BOTTOM"],
        window.width - covered["RIGHT"], window.height - covered["TOP"],
    )  # fmt: skip


def largest(window: bpy.types.Window) -> bpy.types.Area | None:
    """Return the largest viewport of a window; None if it has none."""
    areas = [area for area in window.screen.areas if area.type == "VIEW_3D"]
    return max(areas, key=lambda area: area.width * area.height, default=None)


def turn_to_front(area: bpy.types.Area) -> None:
    """Look from the front right and above, as pictures on pages do."""
    view = area.spaces.active.region_3d
    view.view_perspective = "PERSP"
    view.view_rotation = Vector(FRONT_RIGHT_ABOVE).to_track_quat("Z", "Y")
