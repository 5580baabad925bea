"""Overlapping: hollow spheres of three thin rings each, through each other, all instances of one.

Each fills but a little of its box, and all boxes lie upon each other: a ray that comes near has to
enter them all. That is the worst case of two levels, for which partial re-braiding was made; the
tree over all triangles in world space does not know of it.

As long as they stand upright, a box in a mesh's space is as tight in the world. Turned at random it
is not, and there opening nodes pays less than it costs: the boxes of the parts are no smaller.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.scene.placing import KEEP, Mesh, PlacedMesh, scene_of
from ..core.settings import setting
from .sample import Sample

METALS = tuple(
    Material(f"metal {number}", colour)
    for number, colour in enumerate(
        ((0.85, 0.35, 0.25), (0.9, 0.7, 0.3), (0.3, 0.6, 0.4), (0.3, 0.5, 0.8), (0.7, 0.7, 0.75))
    )
)


@dataclass(frozen=True)
class Settings:
    """Settings of overlapping rings."""

    spheres: int = setting(
        40, "Spheres", "How many there are, of three rings each", minimum=2, maximum=100_000
    )
    segments: int = setting(
        64, "Segments", "Around a ring; 8 times as many are its quads", minimum=3, maximum=10_000
    )
    thickness: float = setting(
        0.02, "Thickness", "Radius of a ring's section by its own", minimum=0.001, maximum=0.5
    )
    spread: float = setting(
        0.15, "Spread", "How far from the middle they are, in their radii; far apart they do not "
        "overlap", minimum=0.0, maximum=1000.0,
    )  # fmt: skip
    turned: bool = setting(False, "Turned", "Turned at random, and not upright")
    seed: int = setting(1, "Seed", "Of places and directions", minimum=0)


ACROSS = 8
"""Sides of a ring's section."""


def count(settings: Settings) -> int:
    """Return the number of instances."""
    return settings.spheres


def hollow_sphere(segments: int, thickness: float) -> Mesh:
    """Return three rings of radius 1 around x, y and z, of 2 * 8 * segments triangles each."""
    vertices, faces = ring(segments, thickness)
    turned = [np.roll(vertices, axis, axis=1) for axis in range(3)]
    return Mesh(
        np.concatenate(turned), np.concatenate([faces + k * len(vertices) for k in range(3)])
    )


def ring(segments: int, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and triangles of a torus of radius 1 around z."""
    along = 2.0 * np.pi * np.arange(segments) / segments
    across = 2.0 * np.pi * np.arange(ACROSS) / ACROSS
    radius = 1.0 + thickness * np.cos(across)
    vertices = np.stack(
        [
            np.cos(along)[:, None] * radius,
            np.sin(along)[:, None] * radius,
            np.broadcast_to(thickness * np.sin(across), (segments, ACROSS)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = (each.ravel() for each in np.divmod(np.arange(segments * ACROSS), ACROSS))
    after, beside = (i + 1) % segments, (j + 1) % ACROSS
    a, b = i * ACROSS + j, after * ACROSS + j
    c, d = after * ACROSS + beside, i * ACROSS + beside
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return vertices, faces


def generate(settings: Settings) -> Scene:
    """Return the scene: spheres of rings around the origin."""
    rng = np.random.default_rng(settings.seed)
    mesh = hollow_sphere(settings.segments, settings.thickness)
    objects = []
    for number in range(settings.spheres):
        turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        matrix = np.eye(4)
        matrix[:3, :3] = (turned if settings.turned else np.eye(3)) * (0.7 + 0.6 * rng.random())
        matrix[:3, 3] = settings.spread * rng.normal(size=3)
        metal = METALS[number % len(METALS)]
        objects.append(PlacedMesh(f"sphere {number}", mesh, matrix, (metal,)))
    scene = scene_of(objects, KEEP, "overlapping")
    distance = 4.0 + 3.0 * settings.spread
    camera = Camera(
        position=distance * np.array([0.5, -0.8, 0.35]), target=np.zeros(3),
        up=np.array([0.0, 0.0, 1.0]), fov=40.0,
    )  # fmt: skip
    lights = point_lights((-distance, -distance, 2.0 * distance), (2.0 * distance, 0.0, distance))
    return replace(scene, camera=camera, lights=lights, background=(0.85, 0.87, 0.9))


SAMPLE = Sample(
    "overlapping",
    "Overlapping instances",
    "Hollow spheres through each other, whose boxes overlap: where two levels are slow",
    Settings,
    count,
    generate,
)
