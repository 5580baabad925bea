"""Teapot: Newell's teapot on a chessboard, both divided equally finely.

The curved patches become a closed mesh of triangles of very different size, which are smallest at
the knob and the spout; the board has as many squares as a patch has quads.

Source: "teapot" of the Standard Procedural Databases (``spd.py``), with its camera, lights and
materials, all of them mirrors, before the sky. The published figures are those of size 12. The lid
does not fit tightly: some rays pass into the pot and see it from inside. The patches are those of
the teapot in a stadium (``data/README.md``), the triangles without area at their poles left out.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Polygon, Triangle
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, scene_of
from .teapot_in_stadium import teapot

WHITE = Material("white squares", (1.0, 1.0, 1.0), 0.5, 0.5, shine_of(30.0))
GREY = Material("grey squares", (0.5, 0.5, 0.5), 0.5, 0.5, shine_of(30.0))
POT = Material("teapot", (1.0, 0.5, 0.1), 0.75, 0.25, shine_of(37.0))

BOARD_HALF_SIDE = 4.0
CAMERA = Camera(
    position=np.array([4.86, 7.2, 5.4]),
    target=np.zeros(3),
    up=np.array([0.0, 0.0, 1.0]),
    fov=45.0,
)
LIGHTS = point_lights((-3.1, 9.8, 12.1), (11.3, 5.1, 8.8))


@dataclass(frozen=True)
class Settings:
    """Settings of teapot."""

    size: int = setting(
        12, "Size", "Size factor of the SPD: n = size quads a side, 64 n^2 - 8 n triangles and n^2",
        unit="quads", minimum=1, maximum=100,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: 64 n^2 - 8 n triangles and n^2 squares, n being the size."""
    n = settings.size
    return 64 * n * n - 8 * n + n * n


def items(settings: Settings) -> Described:
    """Yield the white squares, the grey ones, and the teapot."""
    n = settings.size
    for material, remainder in ((WHITE, 1), (GREY, 0)):
        for column, row in itertools.product(range(n), repeat=2):
            if (column + row) % 2 == remainder:
                yield square(column, row, n), material
    for corners in teapot(n):
        yield Triangle(corners), POT


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "teapot", CAMERA, LIGHTS)


def square(column: int, row: int, n: int) -> Polygon:
    """Return a square of the board of n x n squares."""
    x0, x1, y0, y1 = (
        BOARD_HALF_SIDE * (2.0 * i / n - 1.0) for i in (column, column + 1, row, row + 1)
    )
    return Polygon([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])


SAMPLE = Sample(
    "teapot",
    "Teapot (SPD)",
    "Newell's teapot on a chessboard: curved patches in triangles",
    Settings,
    count,
    generate,
    items,
)
