"""Gears: a cube of meshing gears, some of them of glass.

The two faces of a gear are concave polygons of 144 corners whose boxes cover the whole gear, while
its 144 flanks are thin: an item's box says little about where it is, and testing a face is dear.

Source: "gears" of the Standard Procedural Databases (``spd.py``), with its camera, lights and
materials: every fifth gear transmits, the ground mirrors, the sky is behind. A gear is an object.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Polygon
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, level_square, scene_of

GROUND = Material("ground", (1.0, 0.85, 0.7), diffuse=0.3, specular=0.6, shine=shine_of(37.0))

TEETH = 36
# Distances from the axis, in outer radii of gears that would touch, and where they are, in teeth
# from the middle of a tooth: its two tips, then the valley after it.
RADII = np.array([0.995, 0.995, 0.9, 0.9])
TURNS = np.array([-0.19, 0.19, 0.3, 0.7])

CAMERA = Camera(
    position=np.array([-1.1, -2.1, 2.6]),
    target=np.zeros(3),
    up=np.array([0.0, 0.0, 1.0]),
    fov=45.0,
)
LIGHTS = point_lights(
    (2.0, 4.0, 4.0), (-2.0, 4.0, 3.0), (2.0, -2.5, 2.5), (-1.0, -4.0, 2.0),
    (-1.111, -2.121, 2.626),  # just behind the camera
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """Settings of gears."""

    size: int = setting(
        4, "Size", "Size factor of the SPD, gears along each side: size^3 gears of 146 polygons",
        unit="gears", minimum=1, maximum=16,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of polygons: 146 for each of size^3 gears, and the ground."""
    return settings.size**3 * (2 + 4 * TEETH) + 1


def items(settings: Settings) -> Described:
    """Yield the ground, then the gears from the top layer down, x varying fastest."""
    yield level_square(2.0, 0.0), GROUND
    n = settings.size
    radius = 1.0 / (n - (n - 1) * 0.05)
    thickness = min(0.1, 1.0 / (2.0 * n))
    for iz, iy, ix in itertools.product(range(n), repeat=3):
        # Neighbours are 1.9 radii apart, so that the teeth of one stand in the valleys of the next.
        across = -1.0 + radius + 1.9 * radius * np.array([ix, iy])
        centre = np.array([*across, 1.0 - iz / n])
        phase = (ix + iy + iz) % 2 / 2.0
        material = gear_material(ix, iy, iz)
        for polygon in gear(centre, radius, thickness, phase):
            yield polygon, material


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "gears", CAMERA, LIGHTS)


def gear(centre: np.ndarray, radius: float, thickness: float, phase: float) -> Iterator[Polygon]:
    """Yield the polygons of a gear: its top, its flanks one after the other, its bottom.

    Parameters
    ----------
    centre : (3,) float64
        Of the top; the axis is z.
    radius, thickness : float
        `radius` would be the distance of the tips if gears touched.
    phase : float
        By how many teeth it is turned.
    """
    top = centre + outline(phase, radius)
    below = np.array([0.0, 0.0, -thickness])
    yield Polygon(top)
    after = np.roll(top, -1, axis=0)
    yield from map(Polygon, np.stack([top, top + below, after + below, after], axis=1))
    # Seen from below it turns the other way.
    yield Polygon(centre + below + outline(phase, radius, direction=-1))


def outline(phase: float, radius: float, direction: int = 1) -> np.ndarray:
    """Return the corners of a face around the origin, (4 * TEETH, 3) float64, tooth after tooth."""
    teeth = phase + direction * (np.arange(TEETH)[:, None] + TURNS)
    angles = (2.0 * np.pi / TEETH * teeth).ravel()
    distances = radius * np.tile(RADII, TEETH)
    return np.stack(
        [distances * np.cos(angles), distances * np.sin(angles), np.zeros(4 * TEETH)], axis=1
    )


def gear_material(ix: int, iy: int, iz: int) -> Material:
    """Return the material of a gear: a colour that looks random, and glass for every fifth one."""
    sevenths = np.array([
        (3 * ix + 2 * iy + iz + 1) * 5,
        (3 * iy + 2 * iz + ix + 1) * 3,
        (3 * iz + 2 * ix + iy + 1) * 2,
    ]) % 7  # fmt: skip
    colour = 0.01 + sevenths / 7.0
    red, green, blue = (colour / colour.max()).tolist()
    name = f"gear {ix + 1} {iy + 1} {iz + 1}"
    if (4 * ix + 2 * iy + iz) % 5 == 0:
        return Material(
            name, (red, green, blue), diffuse=0.2, transmission=0.8, index_of_refraction=1.1
        )
    return Material(name, (red, green, blue))


SAMPLE = Sample(
    "gears",
    "Gears (SPD)",
    "Meshing gears: concave polygons of 144 corners beside thin flanks",
    Settings,
    count,
    generate,
    items,
)
