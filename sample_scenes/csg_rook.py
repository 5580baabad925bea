"""A chess piece: a rook, turned from cylinders and truncated cones, with battlements cut into it.

It stands on squares that are plain boxes, beside the tree. The tree is deep where the head is: a
ring is a cylinder without a narrower one, and bars that cross it are taken away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry.csg.description import Difference, Intersection, Union
from ..core.geometry.solids.description import Box, Cone, Placed, Sphere
from ..core.scene import Scene
from ..core.scene.material import Material
from ..core.settings import setting
from .csg import Part, painted, scene_of_parts, seen_from
from .sample import Sample

IVORY = painted("ivory", (0.93, 0.87, 0.72), specular=0.35)
CUT = painted("cut", (0.78, 0.5, 0.3))
LIGHT, DARK = painted("light square", (0.9, 0.85, 0.75)), painted("dark square", (0.3, 0.2, 0.15))

CAMERA = seen_from((4.4, -6.6, 5.4), (0.0, 0.0, 1.5), 40.0)


@dataclass(frozen=True)
class Settings:
    """Settings of the rook."""

    bars: int = setting(
        3, "Bars", "Bars across the head, each for two gaps of the battlements",
        minimum=1, maximum=12,
    )  # fmt: skip


def bar(angle: float) -> Placed:
    """Return a bar through the head, at an angle around its axis."""
    c, s = np.cos(angle), np.sin(angle)
    turned = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0]])
    return Placed(Box((-4.0, -0.16, 3.1), (4.0, 0.16, 5.0)), turned)


def parts(settings: Settings) -> list[Part]:
    """Return the piece, and the squares around it."""
    foot = Union(
        [
            Cone((0, 0, 0), (0, 0, 0.3), 1.05, 1.05),
            # What a ball and a slab share rounds the foot.
            Intersection([Sphere((0, 0, 0.1), 1.0), Box((-2, -2, 0.3), (2, 2, 0.75))]),
        ]
    )
    shaft = Cone((0, 0, 0.6), (0, 0, 2.4), 0.72, 0.5)
    collar = Cone((0, 0, 2.3), (0, 0, 2.5), 0.75, 0.75)
    bars = [bar(np.pi * number / settings.bars) for number in range(settings.bars)]
    head = Difference(
        [
            Cone((0, 0, 2.5), (0, 0, 3.4), 0.68, 0.85),
            Cone((0, 0, 2.9), (0, 0, 6.0), 0.55, 0.55),
            Union(bars),
        ]
    )
    made_of = [IVORY] * 6 + [CUT] * (1 + settings.bars)
    squares = []
    for x in range(-2, 2):
        for y in range(-2, 2):
            low = np.array([1.5 * x, 1.5 * y, -0.25])
            square = Box(low, low + np.array([1.5, 1.5, 0.25]))
            material: Material = LIGHT if (x + y) % 2 else DARK
            squares.append(Part(f"square {x + 3}{y + 3}", square, [material]))
    return [Part("rook", Union([foot, shaft, collar, head]), made_of), *squares]


def count(settings: Settings) -> int:
    """Return the number of items: trees, and plain solids."""
    return len(parts(settings))


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of_parts(parts(settings), "csg_rook", CAMERA)


SAMPLE = Sample(
    "csg_rook",
    "Chess Piece (CSG)",
    "A rook turned from cones, its battlements cut by bars: a tree beside plain solids",
    Settings,
    count,
    generate,
    parts=parts,
)
