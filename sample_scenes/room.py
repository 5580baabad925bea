"""A room with two blocks and mirrors: the box of Cornell, of flat polygons alone.

Five walls, the left one red and the right one green, open to the front; a lamp in the ceiling; a
low block, and a tall one that mirrors on one side, towards the left wall, where a second mirror may
hang. All polygons are convex, and meet along edges and in planes: a scene for beams.

C. Goral, K. Torrance, D. Greenberg, B. Battaile: Modeling the Interaction of Light Between Diffuse
Surfaces, SIGGRAPH 1984.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Item, Polygon
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.settings import setting
from .sample import Sample
from .spd import scene_of

WHITE = Material("white", (0.76, 0.75, 0.71))
RED = Material("red", (0.63, 0.09, 0.08))
GREEN = Material("green", (0.15, 0.48, 0.13))
LAMP = Material("lamp", (1.0, 0.98, 0.9))
MIRROR = Material("mirror", (0.8, 0.85, 0.9), diffuse=0.15, specular=0.8)

LAMP_HALF, LAMP_HEIGHT = 0.25, 1.995

CAMERA = Camera(
    position=np.array([0.0, -3.7, 1.0]),
    target=np.array([0.0, 0.0, 1.0]),
    up=np.array([0.0, 0.0, 1.0]),
    fov=40.0,
)
LIGHTS = point_lights((0.0, 0.0, LAMP_HEIGHT - 0.1))


@dataclass(frozen=True)
class Settings:
    """Settings of the room."""

    mirrors: int = setting(
        1, "Mirrors", "One is the front of the tall block, the second hangs on the left wall",
        minimum=0, maximum=2,
    )  # fmt: skip
    open: bool = setting(
        False, "Open", "Without ceiling, lamp, right wall and camera, to be looked into"
    )


def count(settings: Settings) -> int:
    """Return the number of polygons: walls and lamp, a second mirror, five sides of each block."""
    return (3 if settings.open else 6) + (settings.mirrors == 2) + 2 * 5


def described(settings: Settings) -> Iterator[tuple[Item, Material]]:
    """Yield walls, the lamp, the second mirror, the tall block and the low one."""
    yield Polygon([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]), WHITE
    yield Polygon([(-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2)]), WHITE
    yield Polygon([(-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)]), RED
    if not settings.open:
        yield Polygon([(1, -1, 0), (1, -1, 2), (1, 1, 2), (1, 1, 0)]), GREEN
        yield Polygon([(-1, -1, 2), (-1, 1, 2), (1, 1, 2), (1, -1, 2)]), WHITE
        h, z = LAMP_HALF, LAMP_HEIGHT
        yield Polygon([(-h, -h, z), (-h, h, z), (h, h, z), (h, -h, z)]), LAMP
    if settings.mirrors == 2:
        x = -0.99
        yield Polygon([(x, -0.9, 0.3), (x, 0.5, 0.3), (x, 0.5, 1.5), (x, -0.9, 1.5)]), MIRROR
    yield from block((-0.3, 0.3), 0.3, 1.2, -20.0, MIRROR if settings.mirrors else WHITE)
    yield from block((0.42, -0.3), 0.28, 0.56, 16.0, WHITE)


def block(
    centre: tuple[float, float], half: float, height: float, degrees: float, front: Material
) -> Iterator[tuple[Item, Material]]:
    """Yield the top of a block, then its sides about the vertical, of which one is the front."""
    angle = np.radians(degrees)
    turn = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
    signs = half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    feet = np.column_stack([np.array(centre) + signs @ turn.T, np.zeros(4)])
    heads = feet + np.array([0.0, 0.0, height])
    yield Polygon(heads), WHITE
    for side in range(4):
        after = (side + 1) % 4
        corners = np.array([feet[side], feet[after], heads[after], heads[side]])
        yield Polygon(corners), front if side == 0 else WHITE


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up, and the room is two units wide, deep and high."""
    scene = scene_of(described(settings), "room", CAMERA, LIGHTS, (0.0, 0.0, 0.0))
    return dataclasses.replace(scene, camera=None) if settings.open else scene


SAMPLE = Sample(
    "room",
    "Room (polygons)",
    "The box of Cornell with mirrors: flat polygons, for beams",
    Settings,
    count,
    generate,
    described,
)
