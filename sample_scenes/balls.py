"""Balls: a snowflake of spheres, also known as sphereflake.

Nine spheres of a third of its size sit on every sphere: six around its equator, three further up,
where up is away from the sphere that it sits on itself. Small spheres crowd on large ones, so that
nothing divides the scene evenly: hierarchies beat grids by an order of magnitude here.

Source: "balls" of the Standard Procedural Databases (``spd.py``), with its camera, lights and
materials: mirroring spheres above a floor, before the sky, which no ray of the camera sees. The
floor is so much larger than the spheres that they lie in few cells of a grid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Sphere
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, level_square, rotation, scene_of

FLOOR = Material("floor", (1.0, 0.75, 0.33), diffuse=0.8)
MIRROR = Material("spheres", (1.0, 0.9, 0.7), diffuse=0.5, specular=0.5, shine=shine_of(37.0))

ROOT_RADIUS = 0.5
CAMERA = Camera(
    position=np.array([2.1, 1.3, 1.7]), target=np.zeros(3), up=np.array([0.0, 0.0, 1.0]), fov=45.0
)
LIGHTS = point_lights((4.0, 3.0, 2.0), (1.0, -4.0, 4.0), (-3.0, 1.0, 5.0))


@dataclass(frozen=True)
class Settings:
    """Settings of balls."""

    size: int = setting(
        4, "Size", "Size factor of the SPD, generations after the first: (9^(size+1)-1)/8 spheres",
        unit="levels", minimum=1, maximum=6,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: (9^(size+1) - 1) / 8 spheres and the floor."""
    return (9 ** (settings.size + 1) - 1) // 8 + 1


def items(settings: Settings) -> Described:
    """Yield the floor, then every sphere before those that sit on it."""
    yield level_square(12.0, -ROOT_RADIUS), FLOOR
    up = np.array([0.0, 0.0, 1.0])
    for sphere in spheres(np.zeros(3), ROOT_RADIUS, up, settings.size):
        yield sphere, MIRROR


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "balls", CAMERA, LIGHTS)


def spheres(
    centre: np.ndarray, radius: float, away: np.ndarray, generations: int
) -> Iterator[Sphere]:
    """Yield a sphere and its descendants.

    Parameters
    ----------
    centre, radius : (3,) float64 and float
        Of the sphere.
    away : (3,) float64
        Unit vector from the sphere that it sits on.
    generations : int
        Still to come.
    """
    yield Sphere(centre, radius)
    if generations:
        child_radius = radius / 3.0
        for direction in CHILD_DIRECTIONS @ turn_from_z(away).T:
            child = centre + (radius + child_radius) * direction
            yield from spheres(child, child_radius, direction, generations - 1)


def child_directions() -> np.ndarray:
    """Return where the nine spheres sit on one that points along +z, (9, 3) unit vectors."""
    a = np.sqrt(0.5)
    trio = np.array([(a, a, 0.0), (a, 0.0, -a), (0.0, a, -a)])
    trio = trio @ rotation((1.0, -1.0, 0.0), np.degrees(np.arcsin(2.0 / np.sqrt(6.0)))).T
    return np.concatenate([trio @ rotation((0.0, 0.0, 1.0), turn).T for turn in (0, 120, 240)])


CHILD_DIRECTIONS = child_directions()


def turn_from_z(direction: np.ndarray) -> np.ndarray:
    """Return the rotation that takes +z to a unit vector the shortest way, (3, 3) float64."""
    # Close to the poles the axis of the turn is lost in rounding.
    if direction[2] >= 0.9999:
        return np.eye(3)
    if direction[2] <= -0.9999:
        return rotation((0.0, 1.0, 0.0), 180.0)
    axis = (-direction[1], direction[0], 0.0)  # +z x direction
    return rotation(axis, np.degrees(np.arccos(direction[2])))


SAMPLE = Sample(
    "balls",
    "Balls (SPD)",
    "Snowflake of spheres above a large floor: sizes from one to a hundredth",
    Settings,
    count,
    generate,
    items,
)
