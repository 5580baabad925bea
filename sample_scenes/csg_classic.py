"""The classic of constructive solid geometry: a cube, a sphere, and three cylinders taken away.

What a cube and a sphere share is a die with round corners; cylinders along all axes go through it.
They are longer than the cube, and are cut to its size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry.csg.description import Difference, Intersection, Union
from ..core.geometry.solids.description import Box, Cone, Sphere
from ..core.scene import Scene
from ..core.settings import setting
from .csg import Part, painted, scene_of_parts, seen_from
from .sample import Sample

RED, BLUE, GREEN = (
    painted("cube", (0.85, 0.2, 0.15)),
    painted("sphere", (0.15, 0.35, 0.85)),
    painted("cylinders", (0.2, 0.7, 0.25)),
)

CAMERA = seen_from((3.6, -5.2, 3.4), (0.0, 0.0, -0.05), 32.0)


@dataclass(frozen=True)
class Settings:
    """Settings of the classic."""

    length: float = setting(
        4.0, "Length", "Length of the cylinders, in widths of the cube", minimum=0.5, maximum=100.0
    )


def parts(settings: Settings) -> list[Part]:
    """Return the one tree."""
    cylinders = [
        Cone(-settings.length * axis, settings.length * axis, 0.55, 0.55) for axis in np.eye(3)
    ]
    die = Intersection([Box((-1, -1, -1), (1, 1, 1)), Sphere((0, 0, 0), 1.35)])
    return [Part("classic", Difference([die, Union(cylinders)]), [RED, BLUE, GREEN, GREEN, GREEN])]


def count(settings: Settings) -> int:
    """Return the number of items: trees, and plain solids."""
    return len(parts(settings))


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of_parts(parts(settings), "csg_classic", CAMERA)


SAMPLE = Sample(
    "csg_classic",
    "Cube, Sphere, Cylinders (CSG)",
    "A cube and a sphere intersected, cylinders taken away: the classic CSG tree",
    Settings,
    count,
    generate,
    parts=parts,
)
