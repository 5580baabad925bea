"""Nonuniform: the lecture's picture "octree: 13 cells, grid: 17 cells, 3 objects tested".

Nine objects in a cube of side 16, most of them near one ray that passes all of them. The grid has
16 x 16 cells of side 1. The octree's smallest cells are as large, but where there is little it has
larger ones: the ray passes 13 cells instead of 17. In both it is tested against 3 objects, each
once, since the mailbox is on.

The lecture's picture is a plane one, and so is this scene seen along y: an object is a triangle
that reaches through the whole cube, so that what a cell holds does not depend on y. The scene's
own camera looks along y. The ray is a picture of one pixel from elsewhere. N_ETS of these two
records are the numbers of cells, N_IT the tests; with ``--pictures`` the ray is drawn::

    accelscope evaluate sample:nonuniform --structure
        octree:max_depth=4,max_leaf_size=1,padding=0,mailbox=true
        grid:resolution=16x1x16,padding=0,mailbox=true
        --rays camera:width=1,height=1,from=-4.85x6.1x4.9,at=9.7x6.1x16

Source: J. Pelikan, Acceleration Techniques for Ray-Tracing, "Nonuniform subdivision of space".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Camera, Scene
from .sample import Sample

SIDE = 16.0

OBJECTS = np.array(
    [
        (0.0, 0.3, 1.2, 1.4),
        (14.8, 0.0, 1.2, 1.0),
        (13.0, 14.8, 1.4, 1.2),
        (5.8, 13.9, 1.2, 1.2),
        (1.1, 10.4, 0.9, 1.0),
        (3.4, 11.9, 1.1, 1.3),
        (10.3, 14.3, 1.3, 1.1),
        (7.0, 0.9, 1.2, 1.2),
        (6.8, 11.3, 1.4, 1.5),
    ]
)
"""Per object the lowest x and z, and its extent along x and z."""

EYE = np.array([0.5 * SIDE, -24.0 * SIDE, 0.5 * SIDE])
"""Where the camera stands: far away, so that what lies behind one another is seen as one."""


@dataclass(frozen=True)
class Settings:
    """The scene has no settings: its numbers are those of the picture."""


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles, one per object."""
    return len(OBJECTS)


def generate(settings: Settings) -> Scene:
    """Return the scene, in the cube [0, 16]^3."""
    x, z, width, height = OBJECTS.T
    front, back = np.zeros(len(x)), np.full(len(x), SIDE)
    corners = [(x, front, z), (x + width, back, z), (x, front, z + height)]
    triangles = np.stack([np.stack(corner, axis=1) for corner in corners], axis=1)
    # Rounding of 14.8 + 1.2 must not move the border of the cube.
    triangles = np.minimum(triangles, SIDE)
    centre = np.full(3, 0.5 * SIDE)
    camera = Camera(EYE, centre, np.array([0.0, 0.0, 1.0]), 2.8)
    return Scene.from_triangles(
        triangles,
        "nonuniform",
        object_ids=np.arange(len(x)),
        object_names=tuple(f"object {i}" for i in range(len(x))),
        camera=camera,
    )


SAMPLE = Sample(
    "nonuniform",
    "Nonuniform Subdivision",
    "The lecture's picture of one ray: 13 cells of an octree, 17 of a grid, 3 objects tested",
    Settings,
    triangle_count,
    generate,
)
