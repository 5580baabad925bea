"""What the scenes of the Standard Procedural Databases have in common.

Eric Haines, A proposal for standard graphics environments, IEEE CG&A 7(11), 1987, and the programs
published since (version 3.14, 2005, CC0). A scene is described as its program writes it: one item
after the other, each with its material; that order gives the items their numbers. Cones and
cylinders have no end caps. Behind them all is the same sky, but behind ``jacks``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from ..core.geometry.solids.description import Item, Polygon
from ..core.scene import Camera, Light, Scene
from ..core.scene.material import Material

Described = Iterator[tuple[Item, Material]]
"""Items with their materials, in the order of the program's output."""

SKY = (0.078, 0.361, 0.753)
"""Background colour of all scenes but ``jacks``."""


def rotation(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    """Return the matrix that turns column vectors about an axis, (3, 3) float64.

    By the right hand: about +z, a quarter turn takes +x to +y (Rodrigues' formula).
    """
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    angle = np.radians(degrees)
    cross = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)


def level_square(half_side: float, z: float) -> Polygon:
    """Return the square of [-half_side, half_side]^2 at a height, counter-clockwise from +x +y."""
    h = half_side
    return Polygon([(h, h, z), (-h, h, z), (-h, -h, z), (h, -h, z)])


def scene_of(
    described: Described,
    name: str,
    camera: Camera,
    lights: Sequence[Light],
    background: tuple[float, float, float] = SKY,
) -> Scene:
    """Return the scene of items with materials; what is of one material is an object."""
    items, materials = zip(*described, strict=True)
    numbers = {material: number for number, material in enumerate(dict.fromkeys(materials))}
    material_ids = np.array([numbers[material] for material in materials], dtype=np.int32)
    scene = Scene.from_items(
        items,
        name,
        object_ids=material_ids,
        object_names=tuple(material.name for material in numbers),
        material_ids=material_ids,
        materials=tuple(numbers),
        camera=camera,
        lights=lights,
    )
    return dataclasses.replace(scene, background=background)


def of_one_material(scene: Scene, material: Material) -> Scene:
    """Return a scene of triangles before the sky, all of them of one material."""
    return dataclasses.replace(
        scene,
        materials=(material,),
        material_ids=np.zeros(len(scene), dtype=np.int32),
        background=SKY,
    )
