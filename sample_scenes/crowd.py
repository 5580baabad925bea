"""Crowd: one figure in many places, each a little turned and of another size.

The lecture's example of two levels is a scene of 3,447,421 triangles, in which "one stormtrooper"
has "555k triangles in 17 sub-boxes, the helmet alone 110k". Ours has as many parts, of which the
head, too, takes a fifth. The figure is one mesh, built once; or each part is a mesh of its own, and
every figure is seventeen instances.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.scene.placing import KEEP, Mesh, PlacedMesh, scene_of
from ..core.settings import setting
from .sample import Sample

SHELL, GROUND = Material("shell", (0.85, 0.85, 0.82)), Material("ground", (0.45, 0.42, 0.38))

PARTS: tuple[tuple[str, tuple[float, float, float], tuple[float, float, float], float], ...] = (
    ("head", (0.0, 0.0, 1.68), (0.12, 0.14, 0.16), 0.9),
    ("neck", (0.0, 0.0, 1.52), (0.06, 0.06, 0.08), 0.5),
    ("chest", (0.0, 0.0, 1.28), (0.21, 0.13, 0.24), 0.6),
    ("pack", (0.0, -0.18, 1.3), (0.14, 0.08, 0.2), 0.3),
    ("hips", (0.0, 0.0, 0.98), (0.18, 0.12, 0.12), 0.6),
    *(
        (f"{side} {name}", (sign * x, y, z), size, roundness)
        for side, sign in (("left", -1.0), ("right", 1.0))
        for name, (x, y, z), size, roundness in (
            ("upper arm", (0.27, 0.0, 1.33), (0.07, 0.07, 0.17), 0.8),
            ("forearm", (0.29, 0.05, 1.04), (0.06, 0.06, 0.16), 0.7),
            ("hand", (0.29, 0.09, 0.83), (0.04, 0.05, 0.08), 0.7),
            ("thigh", (0.11, 0.02, 0.72), (0.09, 0.09, 0.22), 0.8),
            ("shin", (0.11, 0.0, 0.32), (0.07, 0.08, 0.21), 0.7),
            ("foot", (0.11, 0.06, 0.07), (0.06, 0.14, 0.07), 0.5),
        )
    ),
)
"""Name, middle and half size of each part, and how round it is: 1 an ellipsoid, 0 a box."""


@dataclass(frozen=True)
class Settings:
    """Settings of the crowd."""

    figures: int = setting(100, "Figures", "How many figures there are", minimum=2, maximum=100_000)
    triangles: int = setting(
        20_000, "Triangles", "Of one figure, about", minimum=1000, maximum=2_000_000
    )
    parts: bool = setting(
        False, "Parts", "Each of its seventeen parts is an instance, not the figure as a whole"
    )
    spacing: float = setting(
        0.9, "Spacing", "From figure to figure; a figure is 1.8 high and 0.7 wide", minimum=0.01
    )
    seed: int = setting(1, "Seed", "Of places and sizes", minimum=0)


def count(settings: Settings) -> int:
    """Return the number of instances: of figures or of their parts, and the ground."""
    return settings.figures * (len(PARTS) if settings.parts else 1) + 1


def round_box(middle: tuple, half: tuple, roundness: float, rows: int) -> np.ndarray:
    """Return a box with round corners as triangles, (n, 3, 3), 4 rows (rows - 1) of them.

    Longitudes and latitudes of a sphere, moved outward to where powers of the coordinates add up
    to one (a superellipsoid).
    """
    power = 2.0 / roundness
    across, up = np.arange(2 * rows) * np.pi / rows, np.arange(rows + 1) * np.pi / rows
    flat = np.stack([np.cos(across), np.sin(across)], axis=1)
    points = np.concatenate(
        [
            np.sin(up)[:, None, None] * flat,
            np.broadcast_to(np.cos(up)[:, None, None], (rows + 1, 2 * rows, 1)),
        ],
        axis=2,
    )
    points[[0, -1], :, :2] = 0.0
    points /= (np.abs(points) ** power).sum(axis=2, keepdims=True) ** (1.0 / power)
    points = points * half + middle
    a, b = points[:-1], points[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    lower, upper = np.stack([a, b, c], axis=2)[:-1], np.stack([a, c, d], axis=2)[1:]
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def parts_of_figure(triangles: int) -> dict[str, np.ndarray]:
    """Return the parts of a figure, (n, 3, 3) each; the head has about a fifth of all triangles."""
    shares = {name: 0.8 / (len(PARTS) - 1) for name, *_ in PARTS} | {"head": 0.2}
    return {
        name: round_box(
            middle, half, roundness, max(3, round(0.5 + (0.25 * shares[name] * triangles) ** 0.5))
        )
        for name, middle, half, roundness in PARTS
    }


def mesh_of(triangles: np.ndarray) -> Mesh:
    """Return triangles, (n, 3, 3), as a mesh whose triangles share no vertices."""
    return Mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def places(settings: Settings) -> np.ndarray:
    """Return where figures stand, (n, 4, 4): in ranks, turned and scaled a little."""
    rng = np.random.default_rng(settings.seed)
    number = settings.figures
    ranks = int(np.ceil(number**0.5))
    rank, file = np.divmod(np.arange(number), ranks)
    angle, size = 0.5 * rng.normal(size=number), 1.0 + 0.06 * rng.normal(size=number)
    matrices = np.tile(np.eye(4), (number, 1, 1))
    matrices[:, 0, 0] = matrices[:, 1, 1] = size * np.cos(angle)
    matrices[:, 1, 0], matrices[:, 0, 1] = size * np.sin(angle), -size * np.sin(angle)
    matrices[:, 2, 2] = size
    middle = 0.5 * (ranks - 1)
    jitter = 0.15 * settings.spacing * rng.normal(size=(number, 2))
    matrices[:, :2, 3] = settings.spacing * np.stack([file - middle, rank - middle], 1) + jitter
    return matrices


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up, figures look along y."""
    parts = parts_of_figure(settings.triangles)
    if settings.parts:
        meshes = {f" {name}": mesh_of(triangles) for name, triangles in parts.items()}
    else:
        meshes = {"": mesh_of(np.concatenate(list(parts.values())))}
    objects = [
        PlacedMesh(f"figure {number}{name}", mesh, matrix, (SHELL,))
        for number, matrix in enumerate(places(settings))
        for name, mesh in meshes.items()
    ]
    half = settings.spacing * (0.5 * np.ceil(settings.figures**0.5) + 1.0)
    corners = half * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    ground = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    scene = scene_of([*objects, PlacedMesh("ground", ground, np.eye(4), (GROUND,))], KEEP, "crowd")
    camera = Camera(
        position=np.array([0.7 * half, 1.9 * half, 0.6 * half + 1.5]),
        target=np.array([0.0, 0.2 * half, 0.6]), up=np.array([0.0, 0.0, 1.0]), fov=40.0,
    )  # fmt: skip
    lights = point_lights((-2.0 * half, 2.0 * half, 3.0 * half), (3.0 * half, half, 2.0 * half))
    return replace(scene, camera=camera, lights=lights, background=(0.6, 0.7, 0.85))


SAMPLE = Sample(
    "crowd",
    "Crowd",
    "One figure in a hundred places: two levels",
    Settings,
    count,
    generate,
)
