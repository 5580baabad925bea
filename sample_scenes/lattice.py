"""Lattice: spheres at the points of a cubic lattice, joined by thin cylinders.

Everything is evenly spread and of like size, the camera stands inside and most rays see far
between the rods: the scene for which a uniform grid is made.

Source: "lattice" of the Standard Procedural Databases (``spd.py``; Antonio Costa), with its camera,
lights and materials: mirroring spheres, matt cylinders, red along x, green along y, blue along z.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Cone, Sphere
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, scene_of

MIRROR = Material("spheres", (0.9, 0.9, 0.9), diffuse=0.5, specular=0.5, shine=shine_of(37.0))
RODS = (
    Material("rods along x", (0.9, 0.1, 0.1), diffuse=0.99),
    Material("rods along y", (0.1, 0.9, 0.1), diffuse=0.99),
    Material("rods along z", (0.1, 0.1, 0.9), diffuse=0.99),
)

# In lengths of the lattice's edge.
SPHERE_RADIUS, ROD_RADIUS = 0.25, 0.0625
ROD_START = 0.99 * SPHERE_RADIUS * (1.0 - np.sqrt(ROD_RADIUS / SPHERE_RADIUS))
"""From the point at which a rod would begin, inside the sphere there."""

LIGHTS = point_lights(
    (2.0, 0.5, 0.5), (-1.0, 0.5, 0.5), (0.5, 2.0, 0.5),
    (0.5, -1.0, 0.5), (0.5, 0.5, 2.0), (0.5, 0.5, -1.0),
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """Settings of lattice."""

    size: int = setting(
        12, "Size", "Size factor of the SPD, edges along each side: (size+1)^3 spheres",
        unit="edges", minimum=1, maximum=64,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: (size + 1)^3 spheres, 3 size (size + 1)^2 cylinders."""
    n = settings.size
    return (n + 1) ** 3 + 3 * n * (n + 1) ** 2


def camera(settings: Settings) -> Camera:
    """Return the camera: in the top layer, above the middle of a cell, looking down into it."""
    n = settings.size
    x = (n // 2 + 0.5) / n
    return Camera(
        position=np.array([x, 1.0, 1.0 - 0.5 / n]),
        target=np.array([x, -1.0, -1.0 - 0.5 / n]),
        up=np.array([0.2, 1.0, 0.0]),
        fov=60.0,
    )


def items(settings: Settings) -> Described:
    """Yield point after point, x varying slowest: its sphere, then the rods that begin there."""
    n = settings.size
    edge = 1.0 / n
    start, rod = ROD_START * edge, ROD_RADIUS * edge
    for place in itertools.product(range(n + 1), repeat=3):
        point = np.array(place) / n
        yield Sphere(point, SPHERE_RADIUS * edge), MIRROR
        for axis, along in enumerate(np.eye(3)):
            if place[axis] < n:
                base, apex = point + start * along, point + (edge - start) * along
                yield Cone(base, apex, rod, rod, is_capped=False), RODS[axis]


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "lattice", camera(settings), LIGHTS)


SAMPLE = Sample(
    "lattice",
    "Lattice (SPD)",
    "Spheres and rods spread evenly, seen from inside: made for a grid",
    Settings,
    count,
    generate,
    items,
)
