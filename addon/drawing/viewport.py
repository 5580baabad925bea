"""The 3D viewport: look at given points, whatever else is in the scene.

Blender's own View Selected knows objects only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Vector

if TYPE_CHECKING:  # importing it for real would import Numba at registration
    from ...core.evaluation.pages.picture_cameras import Slopes

SENSOR = 36.0
"""Tangent between the middle and the border of a viewport's larger side, times its lens."""


def look_at(area: bpy.types.Area, points: np.ndarray) -> None:
    """Move a viewport, not turn it, so that it just shows all points beside its sidebar.

    Parameters
    ----------
    area : bpy.types.Area
        Of type ``VIEW_3D``.
    points : (n, 3) float64
        At least one.
    """
    from ...core.evaluation.pages.picture_cameras import standpoint

    space = area.spaces.active
    view = space.region_3d
    if view.view_perspective == "CAMERA":
        view.view_perspective = "PERSP"
    # Blender looks along the third axis, backwards.
    axes = np.array(view.view_rotation.to_matrix()).T * [[1], [1], [-1]]
    seen = points @ axes.T
    slopes = slopes_of(area, space.lens)
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle = 0.5 * (low + high)
    if view.view_perspective == "PERSP":
        place = standpoint(seen, slopes)
        distance = max(middle[2] - place[2], space.clip_start)
        middle[:2] = place[:2]
    else:
        # Parallel rays: the distance only says how much is seen.
        needed = [size / sum(slope) for size, slope in zip(high - low, slopes, strict=False)]
        distance = max(*needed, space.clip_start)
        middle[:2] += [0.5 * (before - behind) * distance for before, behind in slopes]
    view.view_distance = distance
    view.view_location = Vector(middle @ axes)


def slopes_of(area: bpy.types.Area, lens: float) -> Slopes:
    """Return how far a viewport shows to the left and right, down and up, per distance forward.

    What headers, toolbar and sidebar cover does not count.
    """
    from ...core.evaluation.pages.picture_cameras import MARGIN

    (window,) = (region for region in area.regions if region.type == "WINDOW")
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
    # In units of half a pixel.
    unit = MARGIN * SENSOR / lens / max(window.width, window.height)
    left, right, down, up = (
        unit * (size - 2 * covered[side])
        for size, side in zip(
            (window.width, window.width, window.height, window.height), covered, strict=True
        )
    )
    return (left, right), (down, up)
