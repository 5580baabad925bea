"""Sombrero: a height field, z = cos(2 pi r) exp(-r), the ripples of a drop falling into water.

A height field is nearly two-dimensional: a grid of cubes leaves most of its cells empty, and
hierarchies split it almost like an image.

Source: "sombrero" of the Standard Procedural Databases (Enzmann, Schwan 1995; Haines), with its
camera, light and material, its y axis being z here. As there, the function is sampled at
-4 + 8 i / W while sample i stands at -4 + 8 i / (W - 1), so the tip is exactly 1 high and a little
off the centre. Unlike its polygon output, the field is not lowered by 3, so that the camera looks
at its foot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import of_one_material

SHINY_RED = Material("sombrero", (1.0, 0.1, 0.1), diffuse=0.8, shine=shine_of(40.0))


@dataclass(frozen=True)
class Settings:
    """Settings of sombrero."""

    size: int = setting(
        1, "Size", "Size factor of the SPD: W = 32 * 2^(size-1) samples a side, 2 (W-1)^2 faces",
        minimum=1, maximum=9,
    )  # fmt: skip


def samples_per_side(settings: Settings) -> int:
    """Return W, the number of samples along x and along y."""
    return 32 * 2 ** (settings.size - 1)


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles, 2 (W - 1)^2."""
    return 2 * (samples_per_side(settings) - 1) ** 2


def generate(settings: Settings) -> Scene:
    """Return the scene; it covers [-4, 4]^2, z is up, rows of constant y one after the other."""
    W = samples_per_side(settings)
    sampled_at = -4.0 + 8.0 * np.arange(W) / W
    r = np.hypot(sampled_at[None, :], sampled_at[:, None])
    heights = np.cos(2.0 * np.pi * r) * np.exp(-r)

    x, y = np.meshgrid(np.linspace(-4.0, 4.0, W), np.linspace(-4.0, 4.0, W))
    points = np.stack([x, y, heights], axis=2)
    p00, p10, p11, p01 = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    triangles = np.stack([p00, p10, p11, p00, p11, p01], axis=2).reshape(-1, 3, 3)
    camera = Camera(
        position=np.array([0.0, -8.0, 5.0]),
        target=np.zeros(3),
        up=np.array([0.0, 0.0, 1.0]),
        fov=40.0,
    )
    lights = point_lights((10.0, -10.0, 10.0))
    scene = Scene.from_triangles(triangles, "sombrero", camera=camera, lights=lights)
    return of_one_material(scene, SHINY_RED)


SAMPLE = Sample(
    "sombrero",
    "Sombrero (SPD)",
    "Height field of ripples: evenly dense and nearly flat",
    Settings,
    triangle_count,
    generate,
)
