"""Tree: a tree of cones that forks at every joint, on a field.

Branches shrink by a third with every fork, so that most items are tiny, and the field is thirty
times as wide as the tree: what adapts to that wins by an order of magnitude over what does not.

Source: "tree" of the Standard Procedural Databases (``spd.py``), with its camera, lights and
materials: all matt, a brown tree on a green field before the sky; after Aono and Kunii, Botanical
tree image generation, IEEE CG&A 4(5), 1984. Seven lights make it a test of shadow rays.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Cone, Sphere
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material
from ..core.settings import setting
from .sample import Sample
from .spd import Described, level_square, rotation, scene_of

FIELD = Material("field", (0.2, 0.7, 0.2))
WOOD = Material("tree", (0.55, 0.4, 0.2))

TRUNK_RADIUS = 0.15  # at its foot, in lengths of the trunk
THINNING = 0.67  # radius of a branch's tip by that of its foot
CAMERA = Camera(
    position=np.array([4.5, 0.4, 2.0]),
    target=np.array([0.0, 0.0, 1.5]),
    up=np.array([0.0, 0.0, 1.0]),
    fov=45.0,
)
LIGHTS = point_lights(
    (-5.0, 5.0, 50.0), (30.0, -30.0, 30.0), (-40.0, -30.0, 20.0), (10.0, 30.0, 40.0),
    (-30.0, 40.0, 10.0), (50.0, 25.0, 20.0), (-10.0, -60.0, 30.0),
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """Settings of tree."""

    size: int = setting(
        11, "Size", "Size factor of the SPD, forks from root to twig: 2^(size+1)-1 branches",
        unit="levels", minimum=1, maximum=18,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: 2^(size+1) - 1 cones and spheres each, and the field."""
    return 2 * (2 ** (settings.size + 1) - 1) + 1


def branch(angle: float, divergence: float, contraction: float) -> np.ndarray:
    """Return the linear part of the way from a branch's space to its parent's, (3, 3) float64.

    Parameters
    ----------
    angle, divergence : float
        By how much it leans away from its parent, and where to around it, in degrees.
    contraction : float
        Its length by its parent's.
    """
    lean, around = rotation((1.0, 0.0, 0.0), angle), rotation((0.0, 0.0, 1.0), divergence)
    return contraction * around @ lean


BRANCHES = (branch(40.0, 90.0, 0.65), branch(25.0, 230.0, 0.70))


def items(settings: Settings) -> Described:
    """Yield the field, then every branch before those that grow from its tip."""
    yield level_square(50.0, 0.0), FIELD
    for item in grow(np.zeros(3), np.eye(3), TRUNK_RADIUS, settings.size):
        yield item, WOOD


def generate(settings: Settings) -> Scene:
    """Return the scene."""
    return scene_of(items(settings), "tree", CAMERA, LIGHTS)


def grow(foot: np.ndarray, space: np.ndarray, radius: float, forks: int) -> Iterator[Cone | Sphere]:
    """Yield the cone of a branch, the sphere at its tip, and what grows from there.

    Parameters
    ----------
    foot : (3,) float64
        Where the branch begins.
    space : (3, 3) float64
        Its space's axes as columns; the branch is the third one.
    radius : float
        At its foot.
    forks : int
        Still to come.
    """
    tip, tip_radius = foot + space[:, 2], radius * THINNING
    yield Cone(foot, tip, radius, tip_radius, is_capped=False)
    yield Sphere(tip, tip_radius)
    if forks:
        for turned in BRANCHES:
            yield from grow(tip, space @ turned, tip_radius, forks - 1)


SAMPLE = Sample(
    "tree",
    "Tree (SPD)",
    "Branching tree of cones on a large field: tiny items far apart",
    Settings,
    count,
    generate,
    items,
)
