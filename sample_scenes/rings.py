"""Rings: a pyramid of knots of six pentagons, seen from its tip.

The six pentagons of a knot are linked; their corners are the middles of the edges of a
dodecahedron. Each pentagon is made of five cylinders with a sphere at every joint. A ray passes
close by many items before it hits one, and every ray of the camera hits: behind the pyramid is a
wall.

Source: "rings" of the Standard Procedural Databases (``spd.py``), with its camera, lights and
materials: shiny rings in six colours before a matt wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Cone, Polygon, Sphere
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, rotation, scene_of

WALL = Material("wall", (1.0, 1.0, 1.0))
RINGS = tuple(
    Material(f"{name} rings", colour, diffuse=0.5, specular=0.2, shine=shine_of(37.0))
    for name, colour in {
        "red": (1.0, 0.0, 0.0),
        "green": (0.0, 1.0, 0.0),
        "blue": (0.0, 0.0, 1.0),
        "cyan": (0.0, 1.0, 1.0),
        "magenta": (1.0, 0.0, 1.0),
        "yellow": (1.0, 1.0, 0.0),
    }.items()
)

TUBE_RADIUS = 0.07412
"""With it the rings of a knot of unit pentagons just touch each other. The pentagons are scaled so
that the knot fits into the unit sphere, the tubes are not: they pass a little into each other."""
LAYER_DISTANCE = 1.0 / np.sin(np.radians(22.5))
"""Between the layers of knots along y: with it, a view of 45 degrees from the tip just holds them
when neighbours are 2 apart."""

CAMERA = Camera(
    position=np.array([-1.0, -LAYER_DISTANCE, 0.5]),
    target=np.array([-1.0, 1.0 - LAYER_DISTANCE, 0.5]),
    up=np.array([0.0, 0.0, 1.0]),
    fov=45.0,
)
LIGHTS = point_lights(
    (3.0, -LAYER_DISTANCE, 3.0), (-4.0, -LAYER_DISTANCE, 1.0), (2.0, -LAYER_DISTANCE, -4.0)
)


@dataclass(frozen=True)
class Settings:
    """Settings of rings."""

    size: int = setting(
        7, "Size", "Size factor of the SPD, layers of size^2 knots of 30 spheres and 30 cylinders",
        unit="layers", minimum=1, maximum=30,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: 5 size (size+1) (2 size+1) spheres and cylinders each, a wall."""
    n = settings.size
    return 2 * 5 * n * (n + 1) * (2 * n + 1) + 1


def items(settings: Settings) -> Described:
    """Yield the wall, then the layers, knots, rings: each joint's cylinder to the one before."""
    yield wall(settings.size), WALL
    joints = knot()
    for layer in range(settings.size):
        places = np.arange(-layer, layer + 1, 2)
        for z in places:
            for x in places:
                centre = (x, LAYER_DISTANCE * (layer + 1), z)
                for ring, material in zip(joints + centre, RINGS, strict=True):
                    for joint, before in zip(ring, np.roll(ring, 1, axis=0), strict=True):
                        yield Cone(joint, before, TUBE_RADIUS, TUBE_RADIUS, False), material
                        yield Sphere(joint, TUBE_RADIUS), material


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "rings", CAMERA, LIGHTS)


def knot() -> np.ndarray:
    """Return the corners of the six pentagons of a knot in the unit sphere, (6, 5, 3) float64."""
    angles = np.radians(72.0 * np.arange(5))
    pentagon = np.stack([np.cos(angles), np.sin(angles), np.zeros(5)], axis=1) / (1.0 + TUBE_RADIUS)
    # The angle between the normals of neighbouring faces of the dodecahedron.
    tilt = 2.0 * np.degrees(np.arccos(np.cos(np.pi / 3.0) / np.sin(np.pi / 5.0)))
    tilted = pentagon @ rotation((1.0, 0.0, 0.0), tilt).T
    turns = [rotation((0.0, 0.0, 1.0), 36.0 * (2 * i + 1)) for i in range(5)]
    return np.stack([pentagon, *(tilted @ turn.T for turn in turns)])


def wall(layers: int) -> Polygon:
    """Return the square behind the last layer, 1% larger than what the camera sees of it."""
    y = LAYER_DISTANCE * (layers + 1)
    half_side = 1.01 * (y - CAMERA.position[1]) * np.tan(np.radians(22.5))
    x, z = CAMERA.position[0], CAMERA.position[2]
    return Polygon(
        [(x + i * half_side, y, z + j * half_side) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    )


SAMPLE = Sample(
    "rings",
    "Rings (SPD)",
    "Pyramid of linked rings before a wall: near misses everywhere",
    Settings,
    count,
    generate,
    items,
)
