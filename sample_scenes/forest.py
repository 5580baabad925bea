"""Forest: a few trees in many places, on a hilly ground. Their crowns reach into each other.

Trees fork as the "tree" of the Standard Procedural Databases does, and bear leaves of two triangles
at their twigs. Every tree in the forest is one of a few, turned, scaled, and leaning a little, so
that none looks like another, and none is stored twice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.scene.placing import KEEP, Mesh, PlacedMesh, scene_of
from ..core.settings import setting
from .sample import Sample
from .spd import rotation
from .tree import THINNING, TRUNK_RADIUS, branch

BARK, LEAF = Material("bark", (0.4, 0.28, 0.16)), Material("leaf", (0.25, 0.55, 0.2))
EARTH = Material("earth", (0.35, 0.4, 0.22))

SIDES = 6
"""Of a branch."""

LEAVES = 6
"""At the tip of a twig."""

GROUND = 24
"""Squares of the ground along each side."""


@dataclass(frozen=True)
class Settings:
    """Settings of the forest."""

    trees: int = setting(200, "Trees", "How many trees there are", minimum=2, maximum=100_000)
    kinds: int = setting(3, "Kinds", "Of which as many are different", minimum=1, maximum=100)
    forks: int = setting(
        5, "Forks", "From root to twig: 2^(forks+1)-1 branches", minimum=1, maximum=12
    )
    spacing: float = setting(
        2.0, "Spacing", "From tree to tree; a tree is about 3 high", minimum=0.01
    )
    seed: int = setting(1, "Seed", "Of trees and places", minimum=0)


def count(settings: Settings) -> int:
    """Return the number of instances: the trees, and the ground."""
    return settings.trees + 1


def tree(forks: int, rng: np.random.Generator) -> Mesh:
    """Return a tree whose foot is at the origin: its branches, then its leaves.

    It has 12 (2^(forks+1) - 1) triangles of bark and 12 times 2^forks of leaves.
    """
    turned = [
        branch(angle + 8.0 * rng.normal(), divergence + 30.0 * rng.normal(), contraction)
        for angle, divergence, contraction in ((40.0, 90.0, 0.7), (25.0, 230.0, 0.75))
    ]
    feet, spaces, radius = np.zeros((1, 3)), np.eye(3)[None], TRUNK_RADIUS
    bark = []
    for level in range(forks + 1):
        tips = feet + spaces[:, :, 2]
        bark.append(_cones(feet, tips, spaces, radius, THINNING * radius))
        radius *= THINNING
        if level < forks:
            feet = np.repeat(tips, 2, axis=0)
            spaces = np.stack([spaces @ each for each in turned], axis=1).reshape(-1, 3, 3)
    directions = rng.normal(size=(len(tips), LEAVES, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    across = np.cross(directions, rng.normal(size=directions.shape))
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    size = 0.16
    root = tips[:, None] + 0.02 * directions
    middle, end = root + 0.5 * size * directions, root + size * directions
    left, right = middle - 0.3 * size * across, middle + 0.3 * size * across
    leaves = np.stack([root, right, end, root, end, left], axis=2).reshape(-1, 3, 3)
    triangles = np.concatenate([*bark, leaves])
    slots = np.repeat([0, 1], [len(triangles) - len(leaves), len(leaves)])
    return Mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), slots)


def _cones(
    feet: np.ndarray, tips: np.ndarray, spaces: np.ndarray, lower: float, upper: float
) -> np.ndarray:
    """Return branches as open cones of SIDES sides, (2 n SIDES, 3, 3)."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.stack([np.cos(angle), np.sin(angle)])
    axes = spaces[:, :, :2] / np.linalg.norm(spaces[:, :, :2], axis=1, keepdims=True)
    around = (axes @ ring).transpose(0, 2, 1)
    low, high = feet[:, None] + lower * around, tips[:, None] + upper * around
    next_low, next_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    return np.stack([low, next_low, next_high, low, next_high, high], axis=2).reshape(-1, 3, 3)


def height(x: np.ndarray, y: np.ndarray, side: float) -> np.ndarray:
    """Return how high the ground is."""
    return 0.05 * side * (np.sin(5.0 * x / side) + np.cos(4.0 * y / side + 1.0))


def places(settings: Settings, side: float, rng: np.random.Generator) -> np.ndarray:
    """Return where trees stand, (n, 4, 4): turned, scaled unevenly, and leaning."""
    number = settings.trees
    files = int(np.ceil(number**0.5))
    rank, file = np.divmod(np.arange(number), files)
    middle = 0.5 * (files - 1)
    grid = settings.spacing * np.stack([file - middle, rank - middle], axis=1)
    spot = grid + 0.3 * settings.spacing * rng.normal(size=(number, 2))
    angle = 2.0 * np.pi * rng.random(number)
    size = 0.8 + 0.5 * rng.random((number, 2))
    matrices = np.tile(np.eye(4), (number, 1, 1))
    for matrix, turn, (wide, high), lean in zip(
        matrices, angle, size, 5.0 * rng.normal(size=(number, 2)), strict=True
    ):
        # Scaled, then turned: what Blender, too, has of an object.
        leaning = rotation((1.0, 0.0, 0.0), lean[0]) @ rotation((0.0, 1.0, 0.0), lean[1])
        upright = rotation((0.0, 0.0, 1.0), np.degrees(turn))
        matrix[:3, :3] = leaning @ upright @ np.diag([wide, wide, high])
    matrices[:, :2, 3] = spot
    matrices[:, 2, 3] = height(spot[:, 0], spot[:, 1], side) - 0.05
    return matrices


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up."""
    rng = np.random.default_rng(settings.seed)
    side = settings.spacing * (np.ceil(settings.trees**0.5) + 4.0)
    kinds = [tree(settings.forks, rng) for _ in range(settings.kinds)]
    chosen = rng.integers(0, len(kinds), settings.trees)
    objects = [
        PlacedMesh(f"tree {number}", kinds[kind], matrix, (BARK, LEAF))
        for number, (kind, matrix) in enumerate(
            zip(chosen, places(settings, side, rng), strict=True)
        )
    ]
    line = np.linspace(-0.5 * side, 0.5 * side, GROUND + 1)
    x, y = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x, y, height(x, y, side)], axis=-1).reshape(-1, 3)
    corner = (np.arange(GROUND)[:, None] * (GROUND + 1) + np.arange(GROUND)).ravel()
    a, b, c, d = corner, corner + GROUND + 1, corner + GROUND + 2, corner + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    ground = PlacedMesh("ground", Mesh(vertices, faces), np.eye(4), (EARTH,))
    scene = scene_of([*objects, ground], KEEP, "forest")
    camera = Camera(
        position=np.array([0.1 * side, -0.62 * side, 0.22 * side + 2.0]),
        target=np.array([0.0, 0.0, 0.02 * side + 1.0]), up=np.array([0.0, 0.0, 1.0]), fov=45.0,
    )  # fmt: skip
    lights = point_lights((-side, -side, 2.0 * side), (0.5 * side, -side, side))
    return replace(scene, camera=camera, lights=lights, background=(0.6, 0.75, 0.9))


SAMPLE = Sample(
    "forest",
    "Forest",
    "A few trees in many places, whose crowns overlap: two levels",
    Settings,
    count,
    generate,
)
