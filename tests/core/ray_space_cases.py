"""Rays and scenes that are awkward for whoever divides the space of rays."""

import numpy as np
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import MovingTriangle, Polygon, Sphere
from accelscope.core.scene import Scene
from accelscope.core.structures.ray_classification.ray_space import U, V


def members(rng, root, ends, count):
    """Return rays of a cell: half of them from corners along edges."""
    a, sign = root // 2, 1.0 if root % 2 == 0 else -1.0
    share = rng.random((count, 5))
    share[::2] = rng.integers(2, size=share[::2].shape)
    at = ends[0, :5] + share * (ends[1, :5] - ends[0, :5])
    directions = np.empty((count, 3))
    directions[:, a] = sign
    directions[:, (a + 1) % 3], directions[:, (a + 2) % 3] = at[:, U], at[:, V]
    return at[:, :3], directions


def awkward(scene, count=600):
    """Rays from and along borders of cells, from corners of items, from inside, from far away."""
    rng = np.random.default_rng(8)
    size = scene.upper - scene.lower
    borders = scene.lower + rng.integers(0, 9, (count, 3)) / 8 * size
    inside = scene.lower + rng.random((count, 3)) * size
    slopes = rng.integers(-4, 5, (count, 3)) / 4.0
    slopes[np.arange(count), rng.integers(3, size=count)] = rng.choice([-1.0, 1.0], count)
    free = rng.normal(size=(count, 3))
    boxes = scene.boxes()
    corners = boxes[rng.integers(len(boxes), size=count)].reshape(-1, 2, 3)[:, 0]
    origins = np.concatenate([borders, borders, inside, corners, inside - 20 * free,
                              inside - 1e5 * slopes])  # fmt: skip
    directions = np.concatenate([slopes, free, slopes, free, free, slopes])
    starts = np.where(rng.random(len(origins)) < 0.3, rng.random(len(origins)), 0.0)
    return Rays.from_arrays(origins, directions, t_min=starts, times=rng.random(len(origins)))


def moving():
    rng = np.random.default_rng(6)
    corners = rng.random((60, 3, 3)) * 0.3 + rng.random((60, 1, 3))
    shifts = 0.5 * rng.normal(size=(60, 1, 3))
    items = [MovingTriangle(c, c + s) for c, s in zip(corners, shifts, strict=True)]
    items += [Sphere(rng.random(3), 0.1) for _ in range(10)]
    arrow = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (0, -0.5, 0), (-1, 1, 0.0)])
    items += [Polygon(0.2 * arrow + rng.random(3)) for _ in range(10)]
    return Scene.from_items(items, "moving")
