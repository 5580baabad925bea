"""Shadow rays: from what the primary rays hit to the lights."""

from __future__ import annotations

import numpy as np

from ...contract.structure import Hits
from ...errors import InputError
from ...geometry.geometry import normals_at
from ...geometry.rays import ANY, Rays
from ...scene import LIGHT_KINDS, POINT, SUN, Light, Scene
from ...scene.camera_rays import SHADOW

OFF_THE_FACE = 1e-9
"""How far off the face a shadow ray starts, relative to the scene's diagonal."""

ULPS_OFF_THE_FACE = 32 * np.finfo(np.float64).eps
"""The same relative to the largest coordinate of the hit and of the ray's origin.

Far from the origin of the coordinates this is more. The point ``o + t d`` lies off its triangle by
the roundings of t, of the product and of the sum, four units in the last place of those
coordinates, and by as much more for a face that is seen edge-on; the shadow ray's own test has a
slack of 8 units at the origin and 8 at the triangle. 32 is more than all of that together.
"""


def refuse_darkness(scene: Scene) -> None:
    """Raise InputError if a scene has no light: there are no shadow rays then."""
    if not scene.lights:
        raise InputError(
            f"{scene.name} has no light, so there are no shadow rays; add a light "
            f"({', '.join(LIGHT_KINDS)}), or leave the shadow rays out",
            scene.name,
        )


def shadow_rays(scene: Scene, primary: Rays, hits: Hits) -> Rays | None:
    """Return the shadow rays of primary rays; None if there are none.

    From every hit one ray goes to each light that is on the viewer's side of the face and shines
    there: to a point or spot light, to the centre of an area light (t_max = 1), or against the
    direction of a sun (without an end). It starts a little off the face, so as not to hit it again.
    Its source is the item that was hit, its target the number of the light.
    """
    hit = np.flatnonzero(hits.primitive >= 0)
    directions = primary.directions[hit]
    points = primary.origins[hit] + hits.t[hit, None] * directions
    normals = normals_at(scene.geometry, hits.primitive[hit], points, primary.times[hit])
    normals *= -np.sign((normals * directions).sum(1, keepdims=True))  # towards the viewer
    reach = np.maximum(np.abs(points), np.abs(primary.origins[hit])).max(axis=1, initial=0.0)
    offset = np.maximum(OFF_THE_FACE * scene.diagonal, ULPS_OFF_THE_FACE * reach)
    points += offset[:, None] * normals

    to_light = np.stack([ways_to(light, points) for light in scene.lights], axis=1)
    lit = (to_light * normals[:, None]).sum(axis=2) > 0.0
    lit &= np.stack([shines_along(light, to_light[:, n])
                     for n, light in enumerate(scene.lights)], axis=1)  # fmt: skip
    origins = np.broadcast_to(points[:, None], to_light.shape)[lit]
    if not len(origins):
        return None
    ends = np.array([np.inf if light.kind == SUN else 1.0 for light in scene.lights])
    owner, light = np.nonzero(lit)
    return Rays.from_arrays(
        origins, to_light[lit], ends[light],
        queries=ANY, classes=primary.class_names.index(SHADOW), class_names=primary.class_names,
        sources=hits.primitive[hit][owner], targets=light, times=primary.times[hit][owner],
        pixels=primary.pixels[hit][owner],
    )  # fmt: skip


def ways_to(light: Light, points: np.ndarray) -> np.ndarray:
    """Return the vectors from points (n, 3) to a light; unit vectors to a sun."""
    if light.kind == SUN:
        return np.broadcast_to(-np.asarray(light.direction, float), points.shape)
    return np.asarray(light.position, float) - points


def shines_along(light: Light, to_light: np.ndarray) -> np.ndarray:
    """Say where a light shines against the vectors (n, 3) that lead to it."""
    if light.kind in (POINT, SUN):
        return np.ones(len(to_light), dtype=bool)
    along = -(to_light @ np.asarray(light.direction, float))
    return along > np.cos(np.radians(light.angle) / 2.0) * np.linalg.norm(to_light, axis=1)
