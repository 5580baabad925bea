"""Ways from surfaces to the lights: where shadow rays go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from . import POINT, SUN, Light
from .surfaces import Surfaces


class Ways(NamedTuple):
    """Ways from surfaces to lights that shine on them, ordered by the surface, then by the light.

    Attributes
    ----------
    surfaces, lights : (n,) int64
        Numbers of the surface, and of the light.
    origins, directions : (n, 3) float64
    ends : (n,) float64
        The t at which a way ends: 1 at a light, none at a sun.
    """

    surfaces: np.ndarray
    lights: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    ends: np.ndarray


def ways_to_lights(surfaces: Surfaces, lights: Sequence[Light]) -> Ways:
    """Return the ways from surfaces to each light that is on the side they are seen from.

    One goes to a point or spot light, to the centre of an area light, or against the direction of
    a sun. It starts a little off the face, so as not to hit it again.
    """
    origins = surfaces.points + surfaces.offsets[:, None] * surfaces.normals
    to_light = np.stack([ways_to(light, origins) for light in lights], axis=1)
    lit = (to_light * surfaces.normals[:, None]).sum(axis=2) > 0.0
    lit &= np.stack([shines_along(light, to_light[:, n]) for n, light in enumerate(lights)], axis=1)
    owner, number = np.nonzero(lit)
    ends = np.array([np.inf if light.kind == SUN else 1.0 for light in lights])
    return Ways(owner, number, origins[owner], to_light[lit], ends[number])


def ways_to(light: Light, points: np.ndarray) -> np.ndarray:
    """Return the vectors from points (n, 3) to a light; unit vectors to a sun."""
    if light.kind == SUN:
        return np.broadcast_to(-np.asarray(light.direction, float), points.shape)
    return np.asarray(light.position, float) - points


def shines_along(light: Light, to_light: np.ndarray) -> np.ndarray:
    """Say where a light shines against the vectors (n, 3) that lead to it."""
    if light.kind in (POINT, SUN):
        return np.ones(len(to_light), dtype=bool)
    # Not as a product of matrices, whose last digits depend on the machine.
    along = -(to_light * np.asarray(light.direction, float)).sum(axis=1)
    distance = np.sqrt((to_light * to_light).sum(axis=1))
    return along > np.cos(np.radians(light.angle) / 2.0) * distance
