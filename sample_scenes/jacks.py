"""Jacks: crosses of three cylinders with balls on their ends, and eight half as large around each.

Eight copies of half the size fill the octants between the arms, recursively, as in the Menger
sponge: all generations overlap the same space, so that no plane parts large items from small ones.

Source: "jacks" of the Standard Procedural Databases (``spd.py``; Alexander Enzmann), with its
camera, light and materials: shiny pink before a dark purple (0.2, 0.05, 0.2). The whole is turned
by -20 degrees about y, then by -30 degrees about x. The program's own size is 1, a single jack.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Cone, Sphere
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, rotation, scene_of

PINK = Material("jacks", (0.737, 0.561, 0.561), diffuse=0.7, specular=0.7, shine=shine_of(20.0))

JACK_SCALE = 0.75  # of a jack in its cube [-1, 1]^3, so that neighbours do not overlap
ROD_RADIUS, BALL_RADIUS = 0.1, 0.2
TURN = rotation((1.0, 0.0, 0.0), -30.0) @ rotation((0.0, 1.0, 0.0), -20.0)
CAMERA = Camera(
    position=np.array([0.0, 0.0, -8.0]),
    target=np.zeros(3),
    up=np.array([0.0, 1.0, 0.0]),
    fov=25.0,
)
DARK_PURPLE = (0.2, 0.05, 0.2)
LIGHTS = point_lights((-10.0, 3.0, -20.0))


@dataclass(frozen=True)
class Settings:
    """Settings of jacks."""

    size: int = setting(
        4, "Size", "Size factor of the SPD, generations of jacks: 9 (8^size-1)/7 items",
        unit="levels", minimum=1, maximum=6,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: (8^size - 1) / 7 jacks of three cylinders and six spheres."""
    return 9 * (8**settings.size - 1) // 7


def items(settings: Settings) -> Described:
    """Yield every jack before those in its octants, x varying slowest."""
    for centre, half_side in cubes(np.zeros(3), 1.0, settings.size):
        arms = JACK_SCALE * half_side * TURN.T  # row i is the arm along axis i
        centre, radius = TURN @ centre, JACK_SCALE * half_side
        for arm in arms:
            rod = ROD_RADIUS * radius
            yield Cone(centre - arm, centre + arm, rod, rod, is_capped=False), PINK
        for arm in (*arms, *-arms):
            yield Sphere(centre + arm, BALL_RADIUS * radius), PINK


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "jacks", CAMERA, LIGHTS, DARK_PURPLE)


def cubes(
    centre: np.ndarray, half_side: float, generations: int
) -> Iterator[tuple[np.ndarray, float]]:
    """Yield centre and half side of a jack's cube and of those of its descendants, unturned."""
    yield centre, half_side
    if generations > 1:
        for signs in itertools.product((-0.5, 0.5), repeat=3):
            yield from cubes(centre + np.multiply(signs, half_side), half_side / 2, generations - 1)


SAMPLE = Sample(
    "jacks",
    "Jacks (SPD)",
    "Crosses of rods and balls within each other: all sizes in the same place",
    Settings,
    count,
    generate,
    items,
)
