"""How volumes are drawn, by edges and surface; the hull of a scene, and where copies stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..contract.cells import Cells
from ..contract.outlines import triangles_of, wires_of
from ..geometry.combined import Intersection, Union, is_polyhedral
from ..geometry.geometry import hulls_of
from ..geometry.hull import TEXT, hull_area, hull_faces
from ..geometry.icosphere import icosphere
from ..geometry.kdop import DIRECTIONS
from ..geometry.sphere import Spheres
from ..progress import SILENT, Progress
from ..scene import Scene

SPHERE = icosphere(4)
"""What a sphere's surface is drawn by, (1280, 3, 3)."""

WITHIN = 1e-9
"""How far inside of a hull a point has to be, in sizes of the scene, to be left out."""

HALVINGS = 3
"""How often a side's triangles are cut in four where only a part of it is drawn."""


def hull_surface(scene: Scene, progress: Progress = SILENT) -> float:
    """Return the surface area of the convex hull of all items.

    What lies inside the hull of the points that are farthest in 26 directions is no corner of it,
    and is left out.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    corners, _ = hulls_of(scene.geometry)
    points = corners.reshape(-1, 3)
    progress.report(0, len(DIRECTIONS[26]), TEXT)
    # A vertex comes once for each of its triangles: equal points have equal sums.
    sums = points[:, 0] + np.sqrt(2.0) * points[:, 1] + np.pi * points[:, 2]
    points = points[np.unique(sums, return_index=True)[1]]
    farthest = []
    for done, direction in enumerate(DIRECTIONS[26]):
        progress.report(done, len(DIRECTIONS[26]), TEXT)
        along = points @ np.array(direction, dtype=np.float64)
        farthest += [int(along.argmin()), int(along.argmax())]
    faces = hull_faces(points[np.unique(farthest)], progress)
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 0.0
    is_outside = np.full(len(points), not proper.any())
    reach = WITHIN * float((scene.upper - scene.lower).max())
    for done, (face, normal) in enumerate(
        zip(faces[proper], normals[proper] / lengths[proper, None], strict=True)
    ):
        progress.report(done, len(faces), TEXT)
        is_outside |= points @ normal > face[0] @ normal - reach
    progress.report(len(faces), len(faces), TEXT)
    return hull_area(points[is_outside], progress)


def edges_of(
    volumes: Any, numbers: np.ndarray | None = None, progress: Progress = SILENT
) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of some volumes, of all by default, (k, 2, 3), and whose each is, (k,).

    Spheres have three great circles, combined volumes that are no polyhedra the edges of all their
    members.

    Returns
    -------
    segments : (k, 2, 3) float64
    owners : (k,) int
        Place among `numbers`.
    """
    boxes = volumes.boxes()
    numbers = np.arange(len(boxes)) if numbers is None else numbers
    places, zero = np.arange(len(numbers)), np.zeros(len(numbers), np.int32)
    cells = Cells(
        boxes[numbers], zero, zero, np.ones(len(numbers), dtype=bool), zero,
        faces=volumes.polygons(numbers, progress),
    )  # fmt: skip
    wires = wires_of(cells, places, progress)
    return wires.segments(), wires.edge_owners()


def surface_of(volumes: Any, number: int = 0) -> np.ndarray:
    """Return the surface of a volume as triangles, (m, 3, 3).

    Of a combination with a sphere, or of a union, it is what belongs to it of that of its members,
    in small triangles.
    """
    if isinstance(volumes, Spheres):
        row = volumes.rows[number]
        return row[:3] + row[3] * SPHERE
    if isinstance(volumes, Intersection | Union) and not is_polyhedral(volumes):
        side = 1.0 if isinstance(volumes, Intersection) else -1.0
        members = volumes.first, volumes.second
        parts = []
        for member, other in (members, members[::-1]):
            triangles = finer(surface_of(member, number))
            heights = outside_of(other, number, triangles.reshape(-1, 3)).reshape(-1, 3)
            parts.append(below(triangles, side * heights))
        return np.concatenate(parts)
    triangles, _ = triangles_of(volumes.polygons(np.array([number])))
    return triangles


def finer(triangles: np.ndarray) -> np.ndarray:
    """Return triangles cut into four HALVINGS times; those that are many already, as they are."""
    if len(triangles) >= len(SPHERE):
        return triangles
    for _ in range(HALVINGS):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return triangles


def below(triangles: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Return the parts of triangles (n, 3, 3) where heights, (n, 3) at the corners, are below 0."""
    count = (heights < 0.0).sum(axis=1)
    # Corners below come first; the order along a side does not matter for what is translucent.
    order = np.argsort(heights, axis=1, kind="stable")
    corners = np.take_along_axis(triangles, order[:, :, None], axis=1)
    heights = np.take_along_axis(heights, order, axis=1)

    def crossing(low: int, high: int, which: np.ndarray) -> np.ndarray:
        a, b = heights[which, low, None], heights[which, high, None]
        share = a / (a - b)
        return corners[which, low] + share * (corners[which, high] - corners[which, low])

    one, two = np.flatnonzero(count == 1), np.flatnonzero(count == 2)
    a, b = corners[two, 0], corners[two, 1]
    ac, bc = crossing(0, 2, two), crossing(1, 2, two)
    tip = np.stack([corners[one, 0], crossing(0, 1, one), crossing(0, 2, one)], axis=1)
    return np.concatenate([
        corners[count == 3], tip, np.stack([a, b, ac], axis=1), np.stack([b, bc, ac], axis=1)
    ])  # fmt: skip


def outside_of(volumes: Any, number: int, points: np.ndarray) -> np.ndarray:
    """Return how far points (n, 3) are outside of a volume, (n,); negative inside."""
    if isinstance(volumes, Intersection | Union):
        members = [outside_of(member, number, points) for member in volumes]
        return (np.maximum if isinstance(volumes, Intersection) else np.minimum)(*members)
    if isinstance(volumes, Spheres):
        row = volumes.rows[number]
        return np.linalg.norm(points - row[:3], axis=1) - row[3]
    planes = volumes.half_spaces(np.array([number]))[0]
    lengths = np.linalg.norm(planes[:, :3], axis=1)
    return ((points @ planes[:, :3].T - planes[:, 3]) / lengths).max(axis=1)


def beside_each_other(scene: Scene, columns: int, gap: float = 1.65) -> Sequence[np.ndarray]:
    """Return where copies of a scene stand, the first where it is, others to its right and below.

    Parameters
    ----------
    columns : int
        Copies in a row; there are two rows if they are an even number of at least four.
    gap : float
        Distance of two copies, in sizes of the scene.
    """
    size = scene.upper - scene.lower
    across = np.array([gap * max(size[0], 0.4 * size.max()), 0.0, 0.0])
    down = np.array([0.0, 0.0, -gap * max(size[2], 0.4 * size.max())])
    per_row = columns // 2 if columns >= 4 and columns % 2 == 0 else columns
    return [across * (i % per_row) + down * (i // per_row) for i in range(columns)]


def kind_in_words(kind: str) -> str:
    """Return what a kind of volume is called: ``"kdop14"`` is ``"14-DOP"``."""
    if kind.startswith("kdop"):
        return f"{kind.removeprefix('kdop')}-DOP"
    return kind.upper() if kind in ("aabb", "obb") else kind.replace("_", " ")
