"""A deep chain of differences: balls taken away one after the other, along a spiral.

Each node is a difference of all before it and one more ball: the tree is as deep as there are
balls, as it becomes where somebody carves. Those whose balls lie beside what is left are pruned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry.csg.description import Difference, Node
from ..core.geometry.solids.description import Cone, Sphere
from ..core.scene import Scene
from ..core.settings import setting
from .csg import Part, painted, scene_of_parts, seen_from
from .sample import Sample

COLUMN = painted("column", (0.8, 0.78, 0.74))
CARVED = painted("carved", (0.75, 0.35, 0.25))

CAMERA = seen_from((5.0, -7.5, 5.2), (0.0, 0.0, 2.0), 36.0)

HEIGHT, RADIUS = 4.0, 1.0


@dataclass(frozen=True)
class Settings:
    """Settings of the chain."""

    size: int = setting(
        64, "Size", "Balls that are taken away, one after the other", minimum=1, maximum=400
    )


def parts(settings: Settings) -> list[Part]:
    """Return the column; every eighth ball misses it."""
    node: Node = Cone((0, 0, 0), (0, 0, HEIGHT), RADIUS, RADIUS)
    turns = 4.0
    for number in range(settings.size):
        share = (number + 0.5) / settings.size
        angle = 2.0 * np.pi * turns * share
        away = 2.5 * RADIUS if number % 8 == 7 else 1.1 * RADIUS
        at = away * np.cos(angle), away * np.sin(angle), HEIGHT * share
        node = Difference([node, Sphere(at, 0.42)])
    return [Part("column", node, [COLUMN] + [CARVED] * settings.size)]


def count(settings: Settings) -> int:
    """Return the number of items: trees, and plain solids."""
    return len(parts(settings))


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of_parts(parts(settings), "csg_chain", CAMERA)


SAMPLE = Sample(
    "csg_chain",
    "Chain of Differences (CSG)",
    "Balls carved from a column one after the other: a tree as deep as there are balls",
    Settings,
    count,
    generate,
    parts=parts,
)
