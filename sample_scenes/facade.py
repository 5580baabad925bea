"""The front of a house: rows of recessed windows, of flat polygons alone.

A wall with holes is a wall of rectangles: for each window there are the pier beside it, what is
below and above, the four sides of the recess, the pane, and the top and the front of the sill. The
panes mirror the street. Most polygons touch others in a plane or along an edge, nothing overlaps,
and from the pavement each recess hides part of its pane: a scene for beams, of 500 polygons.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Item, Polygon
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.settings import setting
from .sample import Sample
from .spd import SKY, scene_of

PLASTER = Material("plaster", (0.86, 0.78, 0.62))
REVEAL = Material("reveal", (0.95, 0.92, 0.84))
PANE = Material("pane", (0.25, 0.32, 0.4), diffuse=0.4, specular=0.6)
SILL = Material("sill", (0.6, 0.57, 0.53))
STREET = Material("street", (0.42, 0.42, 0.44))

BAY, STOREY = 2.4, 3.0
"""Width and height of what belongs to one window, in units."""
LEFT, RIGHT, LOW, HIGH = 0.7, 2.1, 0.9, 2.5
"""Sides of the window in it; the pier is what is left of it."""
RECESS, LEDGE = 0.35, 0.15
"""How far a pane lies behind the wall, and a sill before it."""

LIGHTS = point_lights((-30.0, -40.0, 50.0))


@dataclass(frozen=True)
class Settings:
    """Settings of the facade."""

    floors: int = setting(7, "Floors", "Rows of windows", minimum=1, maximum=60)
    bays: int = setting(7, "Bays", "Windows in each row", minimum=1, maximum=60)


def count(settings: Settings) -> int:
    """Return the number of polygons: ten for each window, a last pier a floor, and three."""
    return settings.floors * (10 * settings.bays + 1) + 3


def across(x0: float, x1: float, z0: float, z1: float, y: float = 0.0) -> Polygon:
    """Return an upright rectangle that faces the street."""
    return Polygon([(x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)])


def level(x0: float, x1: float, y0: float, y1: float, z: float) -> Polygon:
    """Return a level rectangle that faces up."""
    return Polygon([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])


def sideways(x: float, y0: float, y1: float, z0: float, z1: float) -> Polygon:
    """Return an upright rectangle along the way into the house."""
    return Polygon([(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)])


def described(settings: Settings) -> Iterator[tuple[Item, Material]]:
    """Yield the windows floor by floor from the left, then the street and the cornice."""
    width, height = settings.bays * BAY + LEFT, settings.floors * STOREY
    for floor in range(settings.floors):
        z = floor * STOREY
        low, high = z + LOW, z + HIGH
        for bay in range(settings.bays):
            x = bay * BAY
            left, right = x + LEFT, x + RIGHT
            yield across(x, left, z, z + STOREY), PLASTER
            yield across(left, x + BAY, z, low), PLASTER
            yield across(left, x + BAY, high, z + STOREY), PLASTER
            yield across(right, x + BAY, low, high), PLASTER
            yield level(left, right, 0.0, RECESS, low), REVEAL
            yield level(left, right, 0.0, RECESS, high), REVEAL
            yield sideways(left, 0.0, RECESS, low, high), REVEAL
            yield sideways(right, 0.0, RECESS, low, high), REVEAL
            yield across(left, right, low, high, RECESS), PANE
            yield level(left, right, -LEDGE, 0.0, low), SILL
        yield across(width - LEFT, width, z, z + STOREY), PLASTER
    yield level(-width, 2.0 * width, -width, 0.0, 0.0), STREET
    yield level(0.0, width, -3.0 * LEDGE, 0.0, height), SILL
    yield across(0.0, width, height, height + 0.5, -3.0 * LEDGE), SILL


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up, and the wall stands in the plane y = 0."""
    width, height = settings.bays * BAY + LEFT, settings.floors * STOREY
    far = 1.3 * max(width, height)
    camera = Camera(
        position=np.array([-0.2 * width, -far, 0.3 * height]),
        target=np.array([0.47 * width, 0.0, 0.47 * height]),
        up=np.array([0.0, 0.0, 1.0]),
        fov=60.0,
    )
    return scene_of(described(settings), "facade", camera, LIGHTS, SKY)


SAMPLE = Sample(
    "facade",
    "Facade (polygons)",
    "Recessed windows in rows, with panes that mirror: 500 flat polygons, for beams",
    Settings,
    count,
    generate,
    described,
)
