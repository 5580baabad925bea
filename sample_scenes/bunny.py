"""Bunny: the Stanford bunny in a coarse version, a closed surface from a range scan.

The usual subject of the literature: triangles of nearly equal size, evenly spread over a surface
without cracks. Registered from range images by Turk and Levoy (Zippered polygon meshes from range
images, SIGGRAPH 1994); simplified to 3674 triangles in the npm package named in ``data/README.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Scene
from .sample import Sample, load_data


@dataclass(frozen=True)
class Settings:
    """The bunny is what it is: no settings."""


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles, 3674."""
    return 3674


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up, the bunny is about 9.7 units high and its head points to -x."""
    data = load_data("bunny.npz")
    x, y, z = data["points"].astype(np.float64).T
    upright = np.stack([x, -z, y], axis=1)  # a quarter turn: y is up in the file
    return Scene.from_triangles(upright[data["triangles"]], "bunny")


SAMPLE = Sample(
    "bunny",
    "Stanford bunny",
    "Coarse range scan: closed, evenly dense, well shaped triangles",
    Settings,
    triangle_count,
    generate,
)
