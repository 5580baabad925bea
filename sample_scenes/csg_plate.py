"""A plate with a hundred holes: cylinders that are ten times as long as the plate is thick.

From the leaves up nothing is known of where a cylinder matters, and a ray that comes in aslant
meets the bounds of many. Cut with the plate, each bound is a tenth as high, and so are those of
neighbours together.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..core.geometry.csg.description import Difference, Union
from ..core.geometry.solids.description import Box, Cone
from ..core.scene import Scene
from ..core.settings import setting
from .csg import Part, painted, scene_of_parts, seen_from
from .sample import Sample

STEEL = painted("plate", (0.62, 0.66, 0.72), specular=0.35)
BRASS = painted("holes", (0.85, 0.65, 0.25))

SIDE, THICKNESS = 20.0, 1.0

CAMERA = seen_from((15.0, -22.0, 17.0), (0.0, -0.5, 0.0), 48.0)


@dataclass(frozen=True)
class Settings:
    """Settings of the plate."""

    holes: int = setting(
        10, "Holes", "Holes along each side; all of them are the square", minimum=1, maximum=60
    )
    length: float = setting(
        10.0, "Length", "Length of the cylinders, in thicknesses of the plate",
        minimum=1.0, maximum=1000.0,
    )  # fmt: skip


def parts(settings: Settings) -> list[Part]:
    """Return the one tree; its holes are a union of unions, row by row."""
    half, step = 0.5 * SIDE, SIDE / settings.holes
    height, radius = 0.5 * THICKNESS * settings.length, 0.3 * step
    places = [-half + (number + 0.5) * step for number in range(settings.holes)]
    rows = [
        Union([Cone((x, y, -height), (x, y, height), radius, radius) for x in places])
        for y in places
    ]
    plate = Box((-half, -half, -0.5 * THICKNESS), (half, half, 0.5 * THICKNESS))
    made_of = [STEEL] + [BRASS] * settings.holes**2
    return [Part("plate", Difference([plate, Union(rows)]), made_of)]


def count(settings: Settings) -> int:
    """Return the number of items: trees, and plain solids."""
    return len(parts(settings))


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of_parts(parts(settings), "csg_plate", CAMERA)


SAMPLE = Sample(
    "csg_plate",
    "Plate with 100 Holes (CSG)",
    "Long cylinders taken away from a thin plate: what cutting saves most",
    Settings,
    count,
    generate,
    parts=parts,
)
