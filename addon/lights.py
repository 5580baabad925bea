"""The scene's lamps: point, sun, spot and area lights that are visible.

Of an area light the centre is taken, and that it shines to its front only.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np

from ..core.scene import AREA, POINT, SPOT, SUN, Light

KINDS = {"POINT": POINT, "SUN": SUN, "SPOT": SPOT, "AREA": AREA}

EVEN = 1e-4
"""Relative difference of two scales up to which a cone counts as round."""


def lights_of(context: bpy.types.Context) -> tuple[Light, ...]:
    """Return all visible lamps, instances of them too."""
    return tuple(
        light
        for name, lamp, matrix in _lamps(context)
        if (light := _light(name, lamp, matrix)) is not None
    )


def remarks(context: bpy.types.Context) -> list[str]:
    """Return a sentence for each lamp that is left out, or taken for something simpler."""
    sentences = []
    for name, lamp, matrix in _lamps(context):
        if _light(name, lamp, matrix) is None:
            sentences.append(f"the light {name} is nowhere or has a scale of zero and is left out")
        elif lamp.type == "SPOT":
            scales = np.linalg.norm(matrix[:3, :3], axis=0)
            if lamp.use_square or np.ptp(scales) > EVEN * scales.max():
                sentences.append(
                    f"the cone of the spot light {name} is square or unevenly scaled; it is taken "
                    "as round"
                )
    return sentences


def _lamps(
    context: bpy.types.Context,
) -> Iterator[tuple[str, bpy.types.Light, np.ndarray]]:
    """Yield name, data and matrix (4, 4) of every visible lamp."""
    for instance in context.evaluated_depsgraph_get().object_instances:
        obj = instance.object
        if obj.type == "LIGHT":
            yield obj.original.name, obj.data, np.array(instance.matrix_world, dtype=np.float64)


def _light(name: str, lamp: bpy.types.Light, matrix: np.ndarray) -> Light | None:
    """Return a lamp as a light; None if it is nowhere or shines in no direction."""
    back = matrix[:3, 2]
    length = np.linalg.norm(back)
    kind = KINDS[lamp.type]
    if not np.isfinite(matrix).all() or (kind != POINT and not length > 0.0):
        return None
    direction = -back / length if kind != POINT else np.array([0.0, 0.0, -1.0])
    angle = {SPOT: float(np.degrees(lamp.spot_size)) if kind == SPOT else 0.0, AREA: 180.0}
    return Light(kind, matrix[:3, 3], direction, angle.get(kind, 360.0), name)
