"""Tetra: a pyramid of tetrahedra inside each other, the Sierpinski tetrahedron.

Four of the eight corners of a cube, every second one, span a regular tetrahedron. A cube is
replaced by the four cubes of half its size at those corners; after ``size - 1`` halvings, the
tetrahedron of each cube is emitted. All coordinates are dyadic fractions and therefore exact.

The halves of every level are congruent and their boxes touch without overlap, so the costs of
hierarchies have closed forms, and grids and octrees meet faces that lie in no axis-aligned plane.

Source: "tetra" of the Standard Procedural Databases (Haines, A proposal for standard graphics
environments, IEEE CG&A 7(11), 1987), with its camera, light and material; after Glassner, Space
subdivision for fast ray tracing, IEEE CG&A 4(10), 1984. Havran's tables of 1999 use size 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.settings import setting
from .sample import Sample
from .spd import of_one_material

# Every second corner of the cube: the sign triples of product +1, x varying slowest.
CORNERS = np.array([(-1, -1, 1), (-1, 1, -1), (1, -1, -1), (1, 1, 1)], dtype=np.float64)
RED = Material("tetra", (1.0, 0.2, 0.2))
FACES = np.array([(0, 1, 2), (3, 2, 1), (2, 3, 0), (1, 0, 3)])


@dataclass(frozen=True)
class Settings:
    """Settings of tetra."""

    size: int = setting(
        6, "Size", "Size factor of the SPD, the levels of recursion: 4^size triangles",
        unit="levels", minimum=1, maximum=12,
    )  # fmt: skip


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles, 4^size."""
    return 4**settings.size


def generate(settings: Settings) -> Scene:
    """Return the scene; triangles in the order of the recursion, in the cube [-1, 1]^3."""
    # One pass per level over all cubes of that level, children beside each other: the order of
    # the cubes is that of the recursion.
    centres, half_size = np.zeros((1, 3)), 1.0
    for _ in range(settings.size - 1):
        half_size /= 2.0
        centres = (centres[:, None] + CORNERS * half_size).reshape(-1, 3)
    triangles = (centres[:, None] + CORNERS * half_size)[:, FACES].reshape(-1, 3, 3)
    camera = Camera(
        position=np.array([1.022846, -3.177154, -2.174512]),
        target=np.array([-0.004103, -0.004103, 0.216539]),
        up=np.array([-0.816497, -0.816497, 0.816497]),
        fov=45.0,
    )
    lights = point_lights((2.0, -18.0, -5.0))
    scene = Scene.from_triangles(triangles, "tetra", camera=camera, lights=lights)
    return of_one_material(scene, RED)


SAMPLE = Sample(
    "tetra",
    "Tetra (SPD)",
    "Sierpinski tetrahedron; costs have closed forms and published tables",
    Settings,
    triangle_count,
    generate,
)
