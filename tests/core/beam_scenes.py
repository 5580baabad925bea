"""Polygonal scenes that are hard to look at, and what beams see of them."""

import dataclasses
import functools

import numpy as np
from accelscope.core.geometry.solids.description import Polygon, Triangle
from accelscope.core.probes.beam import camera_beam
from accelscope.core.probes.polygonal import SETTINGS, polygonal
from accelscope.core.probes.visible import visible
from accelscope.core.scene import Camera, Scene
from accelscope.sample_scenes import make_sample

WIDTH, HEIGHT = 45, 33
"""Odd, so that some centres of pixels lie in the middle of the picture."""

TREES = {
    "autopartition": SETTINGS,
    "no tree": dataclasses.replace(SETTINGS, max_depth=0),
    "sah": dataclasses.replace(SETTINGS, planes="sah", max_leaf_size=3),
    "fixed": dataclasses.replace(SETTINGS, planes="fixed", directions="9", max_leaf_size=2),
}


def camera_at(position=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fov=50.0):
    return Camera(np.array(position), np.array(target), np.array(up), fov)


def square(half=1.0, z=0.0, x=0.0, y=0.0):
    signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return Polygon(np.column_stack([(x, y) + half * signs, np.full(4, z)]))


def turned(polygon, degrees, axis=2):
    """A polygon turned about an axis through the origin."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    b, d = (axis + 1) % 3, (axis + 2) % 3
    corners = np.array(polygon.corners, dtype=float)
    corners[:, b], corners[:, d] = (
        c * corners[:, b] - s * corners[:, d],
        s * corners[:, b] + c * corners[:, d],
    )
    return Polygon(corners)


def cycle():
    """Three bars, each before the next one."""
    bar = Polygon([(-1.2, 0.4, 0.5), (1.2, 0.4, -0.5), (1.2, 0.8, -0.5), (-1.2, 0.8, 0.5)])
    return [turned(bar, 120.0 * k) for k in range(3)] + [square(4.0, -2.0)]


def crossing():
    """Squares through each other."""
    return [turned(square(1.0), 20.0 + 35.0 * k, axis) for k in range(4) for axis in (0, 1)]


def slivers():
    """Needles, some as thin as rounding, some not, and polygons without an area."""
    rng = np.random.default_rng(3)
    items = [square(1.5, -1.0)]
    for width in (1e-3, 1e-7, 1e-11, 1e-13, 1e-15, 1e-17, 0.0):
        for _ in range(4):
            a, b = rng.normal(size=3), rng.normal(size=3)
            aside = np.cross(b - a, (0.0, 0.0, 1.0))
            aside /= np.linalg.norm(aside)
            items.append(Triangle([a, b, b + width * aside]))
            items.append(Polygon([a, b, b + width * aside, a + width * aside]))
    return items


def apex():
    """The eye in the plane of a polygon, in one, at a corner of one, and just beside one."""
    floor = Polygon([(-2.0, 0.0, 7.0), (2.0, 0.0, 7.0), (2.0, 0.0, -2.0), (-2.0, 0.0, -2.0)])
    above = Polygon(np.array(floor.corners) + np.array([0.0, 1e-9, 0.0]))
    corner = Triangle([(0.0, 0.0, 5.0), (1.0, 0.5, 0.0), (1.0, -0.5, 0.0)])
    wall = Polygon([(0.0, -1.0, 5.0), (0.0, 1.0, 5.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
    return [floor, above, corner, wall, square(1.0, -1.0), square(9.0, 5.0)]


def behind():
    """Polygons behind the eye, around it, and from before it to behind it."""
    floor = Polygon([(-3.0, -1.0, 9.0), (3.0, -1.0, 9.0), (3.0, -1.0, -9.0), (-3.0, -1.0, -9.0)])
    aslant = Polygon([(-8.0, -3.0, 9.0), (-8.0, 3.0, 9.0), (5.0, 3.0, -4.0), (5.0, -3.0, -4.0)])
    return [square(2.0, 6.0), square(2.0, 5.0 + 1e-12), floor, aslant, turned(floor, 90.0)]


def touching():
    """A checkerboard of squares, cubes that stand on it, and a triangle on an edge of it."""
    board = [square(0.5, 0.0, x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)]
    sides = []
    for x in (-1.0, 0.0):
        loop = np.array([(x - 0.5, -0.5), (x + 0.5, -0.5), (x + 0.5, 0.5), (x - 0.5, 0.5)])
        for k in range(4):
            a, b = loop[k], loop[(k + 1) % 4]
            sides.append(Polygon([(*a, 0.0), (*b, 0.0), (*b, 1.0), (*a, 1.0)]))
        sides.append(square(0.5, 1.0, x, 0.0))
    return [*board, *sides, Triangle([(0.5, 0.5, 0.0), (1.5, 0.5, 0.0), (1.0, 0.5, 1.0)])]


def coplanar():
    """Polygons in one plane that overlap, some of them equal, before a wall."""
    star = Polygon(np.array([(0.0, 1.2, 0.0), (-0.3, 0.2, 0.0), (0.9, -1.1, 0.0)]))
    flat = [square(1.0, 0.0, 0.5), square(1.0), square(1.0), square(0.3), star]
    return [*flat, square(3.0, -1.0)]


def hollow():
    """An L, a star, and a polygon that is not quite flat."""
    ell = Polygon([(-1, -1, 0), (1, -1, 0), (1, 0, 0), (0, 0, 0), (0, 1, 0), (-1, 1, 0)])
    angles = np.radians(36.0 * np.arange(10))
    radii = np.where(np.arange(10) % 2 == 0, 1.4, 0.5)
    star = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.full(10, -0.5)])
    bent = np.array(square(1.2, -0.8, 0.4, 0.4).corners) + np.array([0, 0, 0, 1e-7])[:, None]
    return [ell, Polygon(star), Polygon(bent)]


def mess(count=60, seed=8):
    """Triangles and quadrilaterals anywhere, the eye among them."""
    rng = np.random.default_rng(seed)
    items = []
    for _ in range(count):
        middle = rng.normal(size=3) * (1.5, 1.5, 3.0) + (0.0, 0.0, 2.0)
        u, v = np.linalg.qr(rng.normal(size=(3, 2)))[0].T * rng.uniform(0.1, 1.5)
        if rng.random() < 0.5:
            items.append(Triangle([middle, middle + u, middle + v]))
        else:
            items.append(Polygon([middle - u, middle - v, middle + u, middle + v]))
    return items


MADE = {
    each.__name__: each
    for each in (cycle, crossing, slivers, apex, behind, touching, coplanar, hollow, mess)
}
SAMPLES = {"room": "room", "facade": "facade:floors=2,bays=3", "triangles": "tetra:size=3"}
NAMES = [*MADE, *SAMPLES]


@functools.cache
def scene_named(name):
    if name in MADE:
        return dataclasses.replace(Scene.from_items(MADE[name](), name), camera=camera_at())
    return make_sample(SAMPLES[name])


@functools.cache
def prepared(name, tree="autopartition"):
    return polygonal(scene_named(name), TREES[tree])


@functools.cache
def looked_at(name, tree="autopartition"):
    """The beam of the scene's camera, and its pieces."""
    beam = camera_beam(scene_named(name).camera, WIDTH, HEIGHT)
    return beam, visible(prepared(name, tree), beam)


def by_item(pieces, count):
    """The area of each item, that of what sees nothing first."""
    return np.bincount(pieces.items + 1, weights=pieces.areas, minlength=count + 1)
