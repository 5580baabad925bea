"""The scene's lamps: point, sun, spot and area lights that are visible.

Of an area light the shape is taken, and that it shines to its front only.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy as np

from ...core.scene import AREA, POINT, SPOT, SUN, Light

KINDS = {"POINT": POINT, "SUN": SUN, "SPOT": SPOT, "AREA": AREA}

ANGLES = {POINT: 360.0, SUN: 360.0, AREA: 180.0}
"""What :class:`...core.scene.Light` calls the angle, in degrees; that of a spot is its own."""

EVEN = 1e-4
"""Relative difference of two scales up to which a cone counts as round."""


class Lamps(NamedTuple):
    """The lights of a scene, and a sentence for each that is left out or taken as simpler."""

    lights: tuple[Light, ...]
    remarks: list[str]


def lamps_of(context: bpy.types.Context) -> Lamps:
    """Return all visible lamps, instances of them too."""
    lights, remarks = [], []
    for instance in context.evaluated_depsgraph_get().object_instances:
        obj = instance.object
        if obj.type != "LIGHT":
            continue
        name, lamp = obj.original.name, obj.data
        matrix = np.array(instance.matrix_world, dtype=np.float64)
        light = _light(name, lamp, matrix)
        if light is None:
            remarks.append(f"the light {name} is nowhere or has a scale of zero and is left out")
            continue
        lights.append(light)
        if lamp.type == "SPOT" and not _is_round(lamp, matrix):
            remarks.append(
                f"the cone of the spot light {name} is square or unevenly scaled; it is taken "
                "as round"
            )
    return Lamps(tuple(lights), remarks)


def _light(name: str, lamp: bpy.types.Light, matrix: np.ndarray) -> Light | None:
    """Return a lamp as a light; None if it is nowhere or shines in no direction."""
    back = matrix[:3, 2]
    length = np.linalg.norm(back)
    kind = KINDS[lamp.type]
    if not np.isfinite(matrix).all() or (kind != POINT and not length > 0.0):
        return None
    direction = -back / length if kind != POINT else np.array([0.0, 0.0, -1.0])
    angle = float(np.degrees(lamp.spot_size)) if kind == SPOT else ANGLES[kind]
    return Light(kind, matrix[:3, 3], direction, angle, name, *_shape_of(lamp, matrix))


def _shape_of(lamp: bpy.types.Light, matrix: np.ndarray) -> tuple[np.ndarray | None, bool]:
    """Return the half-axes of an area light in the world, and whether it is round."""
    if lamp.type != "AREA":
        return None, False
    size_y = lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size
    sizes = np.array([lamp.size, size_y])
    return 0.5 * sizes[:, None] * matrix[:3, :2].T, lamp.shape in ("DISK", "ELLIPSE")


def _is_round(lamp: bpy.types.Light, matrix: np.ndarray) -> bool:
    """Say whether the cone of a spot light is round."""
    scales = np.linalg.norm(matrix[:3, :3], axis=0)
    return not lamp.use_square and bool(np.ptp(scales) <= EVEN * scales.max())
