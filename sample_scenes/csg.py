"""What the samples of CSG trees have in common: parts with materials, and the light they stand in.

A part is a tree, or a plain solid beside trees. Each of its leaves has a material, so that what is
left of an operand's surface can be told from that of the others.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.geometry.csg.description import Node, leaves_of
from ..core.scene import Camera, Light, Scene, point_lights
from ..core.scene.material import Material, shine_of

BACKGROUND = (0.82, 0.86, 0.92)

LIGHTS = point_lights((14.0, -20.0, 26.0), (-20.0, -8.0, 12.0))


class Part(NamedTuple):
    """A tree of a sample.

    Attributes
    ----------
    name : str
    node : Node
    materials : sequence of Material
        Of each leaf, from the first operands to the last; one for all of them may stand alone.
    """

    name: str
    node: Node
    materials: Sequence[Material]


def painted(
    name: str, colour: tuple[float, float, float], diffuse: float = 0.75, specular: float = 0.2
) -> Material:
    """Return a material that shines a little."""
    return Material(name, colour, diffuse=diffuse, specular=specular, shine=shine_of(40.0))


def materials_of(part: Part) -> list[Material]:
    """Return the material of every leaf of a part."""
    count = sum(1 for _ in leaves_of(part.node))
    return list(part.materials) * (count if len(part.materials) == 1 else 1)


def scene_of_parts(
    parts: Sequence[Part],
    name: str,
    camera: Camera,
    lights: Sequence[Light] = LIGHTS,
) -> Scene:
    """Return the scene of trees with materials; each part is an object."""
    of_leaves = [material for part in parts for material in materials_of(part)]
    numbers = {material: number for number, material in enumerate(dict.fromkeys(of_leaves))}
    scene = Scene.from_trees(
        [part.node for part in parts], name,
        object_ids=np.arange(len(parts)), object_names=tuple(part.name for part in parts),
        material_ids=np.array([numbers[material] for material in of_leaves]),
        materials=tuple(numbers), camera=camera, lights=lights,
    )  # fmt: skip
    return dataclasses.replace(scene, background=BACKGROUND)


def seen_from(
    position: tuple[float, float, float], target: tuple[float, float, float], fov: float
) -> Camera:
    """Return a camera that has z upward."""
    up = np.array([0.0, 0.0, 1.0])
    return Camera(position=np.array(position), target=np.array(target), up=up, fov=fov)
