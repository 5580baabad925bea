"""Shells: a sea shell of spheres along a spiral, each overlapping hundreds of others.

Many items cover the same place and most are tiny: a hierarchy's boxes overlap whatever it does,
and a cell of a grid at the tip holds thousands of them. The scene is made to be hard.

Source: "shells" of the Standard Procedural Databases (``spd.py``), with its camera, light and
material, before the sky; after Pickover's shells, IEEE CG&A 9(6), 1989. Its header speaks of a
square and of one sphere less; the program emits no square, and both ends of the spiral.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Sphere
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, scene_of

SHELL = Material("shell", (1.0, 0.8, 0.4), diffuse=0.8, specular=0.2, shine=shine_of(10.0))

GROWTH = 0.15  # of the logarithm of the radius, per radian
CAMERA = Camera(
    position=np.array([-6.0, -60.0, 35.0]),
    target=np.array([0.0, 8.0, -15.0]),
    up=np.array([0.0, 0.0, 1.0]),
    fov=45.0,
)
LIGHTS = point_lights((-100.0, -100.0, 100.0))


@dataclass(frozen=True)
class Settings:
    """Settings of shells."""

    size: int = setting(
        5, "Size", "Size factor of the SPD: 180 * 2^size + 1 spheres along the same spiral",
        minimum=1, maximum=12,
    )  # fmt: skip


def steps(settings: Settings) -> int:
    """Return the number of steps from sphere to sphere, 180 * 2^size."""
    return 180 * 2**settings.size


def count(settings: Settings) -> int:
    """Return the number of spheres, 180 * 2^size + 1."""
    return steps(settings) + 1


def items(settings: Settings) -> Described:
    """Yield the spheres from the tip on: nine turns, six of them before the radius is 1."""
    n = steps(settings)
    angles = 18.0 * np.pi * np.arange(-2 * n // 3, n // 3 + 1) / n
    radii = np.exp(GROWTH * angles)
    centres = radii[:, None] * np.stack(
        [np.sin(angles), np.cos(angles), np.full(n + 1, -2.0)], axis=1
    )
    for centre, radius in zip(centres, radii.tolist(), strict=True):
        yield Sphere(centre, radius), SHELL


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "shells", CAMERA, LIGHTS)


SAMPLE = Sample(
    "shells",
    "Shells (SPD)",
    "Sea shell of overlapping spheres: boxes overlap whatever is done",
    Settings,
    count,
    generate,
    items,
)
