"""Shadow rays: from what the primary rays hit to the lights."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ...geometry.rays import ANY, CLOSEST, Rays
from ...scene import LIGHT_KINDS, POINT, SUN, Light, Scene

OFF_THE_FACE = 1e-9
"""How far off the face a shadow ray starts, relative to the scene's diagonal."""

ULPS_OFF_THE_FACE = 32 * np.finfo(np.float64).eps
"""The same relative to the largest coordinate of the hit and of the ray's origin.

Far from the origin of the coordinates this is more. The point ``o + t d`` lies off its triangle by
the roundings of t, of the product and of the sum, four units in the last place of those
coordinates, and by as much more for a face that is seen edge-on; the shadow ray's own test has a
slack of 8 units at the origin and 8 at the triangle. 32 is more than all of that together.
"""


def with_shadow_rays(scene: Scene, primary: Rays) -> Rays:
    """Return primary rays followed by their shadow rays.

    From every hit one ray goes to each light that is on the viewer's side of the face and shines
    there: to a point or spot light, to the centre of an area light (t_max = 1), or against the
    direction of a sun (without an end). It starts a little off the face, so as not to hit it again.

    Raises
    ------
    InputError
        If the scene has no light.
    """
    from ...structures.bvh import BVH

    if not scene.lights:
        raise InputError(
            f"{scene.name} has no light, so there are no shadow rays; add a light "
            f"({', '.join(LIGHT_KINDS)}), or leave the shadow rays out",
            scene.name,
        )
    hits, _ = BVH.build(scene, BVH.Settings()).trace(primary)
    hit = np.flatnonzero(hits.primitive >= 0)
    directions = primary.directions[hit]
    normals = unit_normals(scene.triangles[hits.primitive[hit]], scene.diagonal)
    normals *= -np.sign((normals * directions).sum(1, keepdims=True))  # towards the viewer
    points = primary.origins[hit] + hits.t[hit, None] * directions
    reach = np.maximum(np.abs(points), np.abs(primary.origins[hit])).max(axis=1)
    offset = np.maximum(OFF_THE_FACE * scene.diagonal, ULPS_OFF_THE_FACE * reach)
    points += offset[:, None] * normals

    to_light = np.stack([ways_to(light, points) for light in scene.lights], axis=1)
    lit = (to_light * normals[:, None]).sum(axis=2) > 0.0
    lit &= np.stack([shines_along(light, to_light[:, n])
                     for n, light in enumerate(scene.lights)], axis=1)  # fmt: skip
    origins = np.broadcast_to(points[:, None], to_light.shape)[lit]
    if not len(origins):
        return primary
    ends = np.array([np.inf if light.kind == SUN else 1.0 for light in scene.lights])
    count, shadows = len(primary), len(origins)
    return Rays.from_arrays(
        np.concatenate([primary.origins, origins]),
        np.concatenate([primary.directions, to_light[lit]]),
        np.concatenate([primary.t_max, np.broadcast_to(ends, lit.shape)[lit]]),
        queries=np.repeat([CLOSEST, ANY], [count, shadows]),
        classes=np.repeat([0, 1], [count, shadows]),
        class_names=primary.class_names,
    )


def unit_normals(triangles: np.ndarray, diagonal: float) -> np.ndarray:
    """Return the unit normals, (n, 3), of triangles in a scene of some diagonal."""
    # A power of two changes no bit of the result; without it, areas of very large and very small
    # scenes leave the range of float64.
    _, exponent = np.frexp(diagonal)
    edges = np.ldexp(triangles[:, 1:] - triangles[:, :1], -exponent)
    normals = np.cross(edges[:, 0], edges[:, 1])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


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
