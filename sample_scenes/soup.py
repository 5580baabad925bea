"""Soup: equal triangles strewn uniformly at random, without any surface they belong to.

The opposite of a scanned model: nothing is coherent, neighbours overlap, and no split separates
anything cleanly. The larger the edge is against the distance of the triangles, the worse
every structure gets. Centroids are uniform in the unit cube and orientations uniform over all
rotations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Scene
from ..core.settings import setting
from .sample import Sample


@dataclass(frozen=True)
class Settings:
    """Settings of soup."""

    count: int = setting(
        10_000, "Count", "How many triangles", unit="triangles", minimum=1, maximum=1_000_000_000
    )
    edge: float = setting(
        0.05, "Edge", "Edge length of the equilateral triangles; the cube they lie in has edge 1",
        unit="units", minimum=1e-6, maximum=10.0,
    )  # fmt: skip
    seed: int = setting(
        1, "Seed", "Another seed gives another soup", minimum=0, maximum=2_147_483_647
    )


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles."""
    return settings.count


def generate(settings: Settings) -> Scene:
    """Return the scene; centroids in [0, 1]^3."""
    # Only uniform numbers are drawn: NumPy has changed its normal distribution before.
    u = np.random.default_rng(settings.seed).random((settings.count, 6))
    centroids = u[:, :3]
    # Uniform orientation: a normal uniform on the sphere, then a uniform turn about it.
    cosine, azimuth, turn = 2.0 * u[:, 3] - 1.0, 2.0 * np.pi * u[:, 4], 2.0 * np.pi * u[:, 5]
    sine = np.sqrt(1.0 - cosine**2)
    zero = np.zeros_like(azimuth)
    across = np.stack([-np.sin(azimuth), np.cos(azimuth), zero], axis=1)
    along = np.stack([cosine * np.cos(azimuth), cosine * np.sin(azimuth), -sine], axis=1)

    radius = settings.edge / np.sqrt(3.0)  # of the circle through the three corners
    triangles = np.empty((settings.count, 3, 3))
    for corner in range(3):
        angle = (turn + corner * 2.0 * np.pi / 3.0)[:, None]
        triangles[:, corner] = centroids + radius * (np.cos(angle) * along + np.sin(angle) * across)
    return Scene.from_triangles(triangles, "soup")


SAMPLE = Sample(
    "soup",
    "Triangle soup",
    "Random triangles that overlap: no structure finds order in it",
    Settings,
    triangle_count,
    generate,
)
