"""Suzanne: Blender's monkey, subdivided by Catmull-Clark.

A mesh everybody who uses Blender knows: some parts (ears, eyes) are dense, the eyes are separate
pieces inside their sockets, and the triangles are well shaped but of different sizes.

Source: the base mesh of ``bpy.ops.mesh.primitive_monkey_add`` (see ``data/README.md``), refined as
Blender's Subdivision Surface modifier does with "Use Limit Surface" off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Scene
from ..core.settings import setting
from .catmull_clark import subdivide, triangulate
from .sample import Sample, load_data


@dataclass(frozen=True)
class Settings:
    """Settings of Suzanne."""

    subdivisions: int = setting(
        2, "Subdivisions", "Steps of Catmull-Clark; each makes four times the triangles",
        unit="steps", minimum=0, maximum=6,
    )  # fmt: skip


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles: 968 in the base mesh, then 984 * 4^subdivisions."""
    return 984 * 4**settings.subdivisions if settings.subdivisions else 968


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up and the face looks along -y, as in Blender."""
    data = load_data("suzanne.npz")
    points = data["points"] / 128.0
    corners, sizes = data["corners"].astype(np.int64), data["sizes"].astype(np.int64)
    for _ in range(settings.subdivisions):
        points, corners, sizes = subdivide(points, corners, sizes)
    return Scene.from_triangles(points[triangulate(points, corners, sizes)], "suzanne")


SAMPLE = Sample(
    "suzanne",
    "Suzanne",
    "Blender's monkey, as smooth as you like",
    Settings,
    triangle_count,
    generate,
)
