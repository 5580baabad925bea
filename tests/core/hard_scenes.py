"""Scenes on which subdivisions of space go wrong: where no plane separates, or none pays.

All are made of `size` triangles or a few less, the same every time.
"""

import numpy as np
from accelscope.sample_scenes import make_sample


def turned(corners, seed):
    """Turn triangles, or each of several groups of them (..., n, 3, 3), somehow."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(*corners.shape[:-3], 3, 3)))
    return corners @ turn[..., None, :, :]


def fan(sides, tip=(0.0, 0.0, 0.0)):
    """Return the triangles between a tip and a circle."""
    angle = 2 * np.pi * np.arange(sides) / sides
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    tips = np.broadcast_to(np.asarray(tip), rim.shape)
    return np.stack([tips, rim, np.roll(rim, -1, axis=0)], axis=1)


def cylinder(sides, length=1.0, radius=1.0):
    """Return the triangles around a cylinder without its ends."""
    angle = 2 * np.pi * np.arange(sides) / sides
    low = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)], axis=1)
    high, after = low + np.array([0, 0, length]), np.roll(low, -1, axis=0)
    lower = np.stack([low, after, high], axis=1)
    return np.concatenate([lower, np.stack([after, np.roll(high, -1, axis=0), high], axis=1)])


def cone(sides):
    return turned(np.concatenate([fan(sides, (0, 0, 2)), fan(sides)]), 1)


def bamboo(size):
    canes = max(size // 12, 1)
    straight = np.broadcast_to(cylinder(6, radius=0.004), (canes, 12, 3, 3))
    places = np.random.default_rng(2).random((canes, 1, 1, 3))
    return (turned(straight, 3) + places).reshape(-1, 3, 3)


def concentric(size):
    first = np.array([[1.0, 0, 0], [-0.5, 0.87, 0], [-0.5, -0.87, 0]])
    return turned(first * np.linspace(0.1, 1, size)[:, None, None], 4)


def concentric_cones(size):
    return np.concatenate([cone(8) * f for f in np.linspace(0.2, 1, max(size // 16, 1))])


def needles(size):
    rng = np.random.default_rng(5)
    start, way = rng.random((size, 3)), rng.normal(size=(size, 3))
    beside = start + 0.5 * way + 1e-3 * rng.normal(size=(size, 3))
    return np.stack([start, start + way, beside], axis=1)


def through_one_point(size):
    corners = np.random.default_rng(6).normal(size=(size, 3, 3))
    corners[:, 2] = -0.5 * (corners[:, 0] + corners[:, 1])
    return corners


def giants(size):
    return np.random.default_rng(7).random((size, 3, 3))


def identical(size):
    return np.repeat(np.random.default_rng(8).random((1, 3, 3)), size, axis=0)


def two_clusters(size):
    rng = np.random.default_rng(9)
    corners = rng.random((size, 1, 3)) + 0.05 * rng.random((size, 3, 3))
    corners[size // 2 :] += 1e6
    return corners


def one_plane(size):
    corners = np.random.default_rng(10).random((size, 3, 3))
    corners[:, :, 2] = corners[:, :, :2].sum(axis=2)
    return corners


def teapot_on_a_plain(size):
    return make_sample("teapot_in_stadium:teapot_resolution=2").triangles[:size]


HARD_SCENES = {
    "disc": lambda size: turned(fan(size), 0),
    "cone of 32": lambda size: cone(32),
    "cone": lambda size: cone(size // 2),
    "cylinder": lambda size: turned(cylinder(size // 2), 11),
    "bamboo": bamboo,
    "concentric": concentric,
    "concentric cones": concentric_cones,
    "needles": needles,
    "through one point": through_one_point,
    "giants": giants,
    "identical": identical,
    "two clusters": two_clusters,
    "one plane": one_plane,
    "teapot on a plain": teapot_on_a_plain,
    "sixteen": lambda size: giants(16),
}
"""Corners, (n, 3, 3), by name, from the number of triangles that there may be."""
