"""Flat shading: one colour for each polygon, lit in its middle, without shadows.

W. J. Bouknight: A procedure for generation of three-dimensional half-toned computer graphics
presentations, CACM 13(9), 1970.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..scene import AREA, SUN, Light, Scene
from ..scene.whitted.shading import Surfacing, intensity


def flat_colours(
    scene: Scene,
    items: np.ndarray,
    planes: np.ndarray,
    middles: np.ndarray,
    apex: np.ndarray,
    lights: Sequence[Light],
) -> np.ndarray:
    """Return the colours of polygons, (n, 3), on the sides that are seen.

    Parameters
    ----------
    items : (n,) int
        What they are of, as the scene numbers it.
    planes : (n, 4) float64
        Unit normals and positions along them.
    middles : (n, 3) float64
    apex : (3,) float64
        Where they are seen from.
    """
    sides = np.where(planes[:, :3] @ apex > planes[:, 3], 1.0, -1.0)
    normals = sides[:, None] * planes[:, :3]
    arriving = np.ones(len(items))
    for light in lights:
        to_light = light.position - middles
        if light.kind == SUN:
            to_light = np.broadcast_to(-light.direction, middles.shape)
        lengths = np.linalg.norm(to_light, axis=1)
        cosines = (normals * to_light).sum(axis=1) / np.where(lengths > 0.0, lengths, 1.0)
        if light.kind == AREA:  # it shines to its front
            cosines = np.where(to_light @ light.direction < 0.0, cosines, 0.0)
        arriving += np.maximum(cosines, 0.0)
    matt = Surfacing.of(scene).at(scene.materials_of(items)).matt
    return intensity(len(lights)) * arriving[:, None] * matt
