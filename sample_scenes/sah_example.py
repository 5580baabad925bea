"""The worked example of the surface area heuristic: 76 triangles that cost what the slides say.

Four closed solids: an octahedron (8 faces) left of plane I, a tetrahedron (4) between I and II,
nothing between II and III, and right of III a tetrahedron (4) below and a pentakis dodecahedron
(60) above plane X. The box around them has just the proportions for the printed p, see
:mod:`..core.sah.worked_example`.

Source: J. Pelikan, Acceleration Techniques for Ray-Tracing, "SAH decision", "One more level".
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..core.scene import Camera, Scene
from .sample import Sample

GOLDEN = 0.5 * (1.0 + np.sqrt(5.0))


@dataclass(frozen=True)
class Settings:
    """The scene has no settings: its numbers are those of the slides."""


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles."""
    return 76


def tetrahedron() -> np.ndarray:
    """Return the faces of the tetrahedron on every second corner of the cube [-1, 1]^3."""
    corners = np.array([(-1, -1, -1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)], dtype=np.float64)
    return corners[[(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]]


def octahedron() -> np.ndarray:
    """Return the faces of the octahedron in the cube [-1, 1]^3."""
    faces = []
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        x, y, z = np.diag(signs)
        faces.append((x, y, z) if np.prod(signs) > 0.0 else (x, z, y))
    return np.array(faces)


def pentakis_dodecahedron() -> np.ndarray:
    """Return the 60 faces of a dodecahedron with a pyramid on each side, in [-1, 1]^3.

    All its corners lie on one sphere.
    """
    cube = itertools.product((-1.0, 1.0), repeat=3)
    flat = [
        np.roll((0.0, a / GOLDEN, b * GOLDEN), shift)
        for shift in range(3)
        for a, b in itertools.product((-1.0, 1.0), repeat=2)
    ]
    corners = np.array([*cube, *flat]) / GOLDEN
    tips = [
        np.roll((0.0, a * GOLDEN, b), shift)
        for shift in range(3)
        for a, b in itertools.product((-1.0, 1.0), repeat=2)
    ]
    radius = np.linalg.norm(corners[0])
    faces = []
    for tip in np.array(tips) * radius / np.hypot(1.0, GOLDEN):
        side = corners[np.argsort(-corners @ tip)[:5]]
        # Once around, counter-clockwise seen from the tip.
        u = side[0] - tip * (side[0] @ tip) / (tip @ tip)
        v = np.cross(tip, u) / np.linalg.norm(tip)
        side = side[np.argsort(np.arctan2(side @ v, side @ u))]
        faces += [(tip, side[i], side[(i + 1) % 5]) for i in range(5)]
    return np.array(faces)


def placed(faces: np.ndarray, low: tuple, high: tuple) -> np.ndarray:
    """Return faces in [-1, 1]^3 stretched into a box; what touches the cube touches the box."""
    share = 0.5 * (faces + 1.0)
    return (1.0 - share) * np.array(low) + share * np.array(high)


def generate(settings: Settings) -> Scene:
    """Return the scene; its solids touch all sides of the example's box."""
    # Not above: it would bring Numba in, and make Blender start slower.
    from ..core.sah.worked_example import DEPTH, HEIGHT, LENGTH, PLANES

    plane_x = PLANES["X"][1]
    ball = HEIGHT - plane_x - 1.0  # its diameter: a unit of room below
    solids = {
        "octahedron": placed(octahedron(), (0.0, 0.0, 0.0), (8.0, 16.0, 16.0)),
        "tetrahedron": placed(tetrahedron(), (11.0, DEPTH - 20.0, 8.0), (31.0, DEPTH, 28.0)),
        "small tetrahedron": placed(tetrahedron(), (72.0, 4.0, 6.0), (80.0, 12.0, 14.0)),
        "ball": placed(
            pentakis_dodecahedron(),
            (LENGTH - ball, 0.5 * DEPTH, HEIGHT - ball),
            (LENGTH, 0.5 * DEPTH + ball, HEIGHT),
        ),
    }
    centre = 0.5 * np.array([LENGTH, DEPTH, HEIGHT])
    camera = Camera(
        centre + np.array([20.0, -150.0, 45.0]), centre, np.array([0.0, 0.0, 1.0]), 38.0
    )
    return Scene.from_triangles(
        np.concatenate(list(solids.values())),
        "sah_example",
        object_ids=np.repeat(np.arange(len(solids)), [len(faces) for faces in solids.values()]),
        object_names=tuple(solids),
        camera=camera,
    )


SAMPLE = Sample(
    "sah_example",
    "SAH Worked Example",
    "The lecture's 76 triangles and planes I, II, III and X with their printed costs",
    Settings,
    triangle_count,
    generate,
)
