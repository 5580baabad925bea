"""Sections: what a plane sees of cells and of the object, laid out beside the model.

The lecture draws subdivisions of space in the plane. So do the lessons on them: an upright plane
through a ray, or through the middle of the scene, cuts the cells of a structure and the surfaces
of the object, and what it cuts is drawn beside the model, once for every structure. A ray that
lies in the plane passes all its cells there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.cells import Cells, planes_across
from ..contract.outlines import by_shape, faces_of
from ..geometry.box_shape import corners_of
from ..geometry.instances import lines_of_items
from ..geometry.polygons import Polygons, of_equal_size, sides_of
from ..geometry.triangles import Triangles
from ..scene import Scene
from .drawing import GREY, RED, Faces, Lines, coloured, tinted

GAP = 1.15
"""Distance of two sections, in widths of the scene."""

AWAY = 0.73
"""How far to the back a section stands for each step to the right: as seen from the front right,
where pictures are made, all are equally far away."""

ROW_GAP = 1.6
"""Distance of two rows of sections, in heights of the scene."""

FEW_ITEMS = 100
"""Items up to which whole outlines stand for the object, as on slides; else its contour."""

MOST_CELLS = 4000
"""Cells of one section that are drawn, the largest; more of them are a grey mass."""

TO_VIEWER = np.array([0.55, -0.75, 0.42])
"""Where pictures are seen from: the front right, from above."""

RAISED = 0.004
"""By how much what stands out is raised, in sizes of the scene."""

FAINT = 0.4
"""Opacity of what is not the subject."""


@dataclass(frozen=True)
class Plane:
    """A plane through a point.

    Attributes
    ----------
    point, normal : (3,) float64
        The normal has unit length.
    """

    point: np.ndarray
    normal: np.ndarray

    @classmethod
    def through_ray(cls, origin: np.ndarray, direction: np.ndarray) -> Plane:
        """Return the upright plane in which a ray runs; for an upright ray that along x."""
        beside = np.eye(3)[0 if not direction[:2].any() else 2]
        normal = np.cross(beside, direction / np.abs(direction).max())
        return cls(np.asarray(origin, np.float64), normal / np.linalg.norm(normal))

    @classmethod
    def across(cls, scene: Scene, share: float) -> Plane:
        """Return the plane across y at a share of the scene's depth, from the front."""
        point = (1.0 - share) * scene.lower + share * scene.upper
        return cls(point, np.array([0.0, 1.0, 0.0]))

    def above(self, points: np.ndarray) -> np.ndarray:
        """Return the heights of points (..., 3) above the plane."""
        return (points - self.point) @ self.normal


class Section(NamedTuple):
    """What a plane cuts of cells.

    Attributes
    ----------
    segments : (k, 2, 3) float64
        The sides of the polygons in which cells are cut.
    owners : (k,) int64
        Place in `Cells` of each side's cell.
    left_out : int
        Cells that are cut and were left out.
    """

    segments: np.ndarray
    owners: np.ndarray
    left_out: int

    def lines(self, colours: np.ndarray) -> Lines:
        """Return the sides in colours by place, (n, 4)."""
        return Lines(self.segments, colours[self.owners])

    def of(self, places: np.ndarray) -> Section:
        """Return only what belongs to some cells."""
        kept = np.isin(self.owners, places)
        return Section(self.segments[kept], self.owners[kept], self.left_out)

    def faces(self, colours: np.ndarray) -> Faces:
        """Return the polygons as fans around their middles, in colours by place, (n, 4)."""
        found, which = np.unique(self.owners, return_inverse=True)
        counts = np.bincount(which, minlength=len(found))
        middles = (
            np.stack(
                [
                    np.bincount(which, self.segments[:, :, a].mean(axis=1), len(found))
                    for a in range(3)
                ],
                axis=1,
            )
            / np.maximum(counts, 1)[:, None]
        )
        fans = np.concatenate([middles[which][:, None], self.segments], axis=1)
        return Faces(fans, colours[self.owners])

    def moved(self, shift: np.ndarray) -> Section:
        """Return the section beside itself."""
        return self._replace(segments=self.segments + shift)

    def raised(self, scene: Scene) -> Section:
        """Return the section a hair nearer to the viewer, so that it is drawn over others."""
        return self.moved(RAISED * (scene.upper - scene.lower).max() * TO_VIEWER)


def section_of(cells: Cells, places: np.ndarray, plane: Plane) -> Section:
    """Return what a plane cuts of some cells.

    Parameters
    ----------
    places : (m,) int
        Ascending.
    """
    boxes, up = cells.boxes[places], plane.normal > 0.0
    lowest = np.where(up, boxes[:, :3], boxes[:, 3:])
    highest = np.where(up, boxes[:, 3:], boxes[:, :3])
    cut = places[(plane.above(lowest) <= 0.0) & (plane.above(highest) > 0.0)]
    left_out = max(len(cut) - MOST_CELLS, 0)
    if left_out:
        sizes = (cells.boxes[cut, 3:] - cells.boxes[cut, :3]).sum(axis=1)
        cut = np.sort(cut[np.argsort(-sizes, kind="stable")[:MOST_CELLS]])
    shaped, boxed = by_shape(cells, cut)
    triangles, of_triangles = faces_of(cells, shaped)
    sides = sides_of(corners_of(cells.boxes[boxed]))
    fans = np.concatenate([[0], np.cumsum(np.full(len(triangles), 3))])
    pieces = [
        _cut(Polygons(triangles.reshape(-1, 3), fans, of_triangles), plane),
        _cut(sides._replace(owners=boxed[sides.owners]), plane),
    ]
    return Section(
        np.concatenate([segments for segments, _ in pieces]),
        np.concatenate([owners for _, owners in pieces]),
        left_out,
    )


def contour(scene: Scene, plane: Plane) -> np.ndarray:
    """Return what a plane cuts of the surfaces of triangles, (k, 2, 3).

    Of a few items, and of such as are no triangles, the outlines.
    """
    if len(scene) <= FEW_ITEMS:
        return lines_of_items(scene.geometry, np.arange(len(scene)))
    return cut_items(scene, plane)[0]


def cut_items(scene: Scene, plane: Plane) -> tuple[np.ndarray, np.ndarray]:
    """Return what a plane cuts of triangles, (k, 2, 3), and of which, (k,).

    Of the first few items of other kinds the outlines, each of item 0.
    """
    if not isinstance(scene.geometry, Triangles):
        lines = lines_of_items(scene.geometry, np.arange(min(len(scene), FEW_ITEMS)))
        return lines, np.zeros(len(lines), np.int64)
    corners = scene.triangles
    offsets = 3 * np.arange(len(corners) + 1)
    return _cut(Polygons(corners.reshape(-1, 3), offsets, np.arange(len(corners))), plane)


def walls_in(box: np.ndarray, axis: int, positions: np.ndarray, plane: Plane) -> np.ndarray:
    """Return where a plane cuts walls across an axis in a box (6,), (k, 2, 3)."""
    count = len(positions)
    corners = planes_across(np.broadcast_to(box, (count, 6)), axis, positions)
    return _cut(of_equal_size(corners, np.arange(count)), plane)[0]


def sideways(plane: Plane, direction: np.ndarray) -> np.ndarray:
    """Return the level direction in an upright plane, (3,), in which a ray goes on."""
    along = np.cross(plane.normal, [0.0, 0.0, 1.0])
    return along * (-1.0 if (along @ direction or along[0]) < 0.0 else 1.0)


def frame_of_plane(scene: Scene, plane: Plane) -> np.ndarray:
    """Return where a plane cuts the box around the scene, (k, 2, 3)."""
    sides = sides_of(corners_of(np.concatenate([scene.lower, scene.upper])[None]))
    return _cut(sides, plane)[0]


def _cut(polygons: Polygons, plane: Plane) -> tuple[np.ndarray, np.ndarray]:
    """Return where a plane cuts convex polygons, (k, 2, 3), and whose each piece is, (k,)."""
    points = polygons.points
    following = np.arange(len(points)) + 1
    following[polygons.offsets[1:] - 1] = polygons.offsets[:-1]
    height = plane.above(points)
    is_above = height > 0.0
    crossed = np.flatnonzero(is_above != is_above[following])
    a, b = height[crossed], height[following[crossed]]
    share = (a / (a - b))[:, None]
    met = (1.0 - share) * points[crossed] + share * points[following[crossed]]
    # The border of a convex polygon crosses the plane twice or not at all.
    polygon = np.searchsorted(polygons.offsets, crossed, side="right") - 1
    return met.reshape(-1, 2, 3), polygons.owners[polygon[::2]]


# ---------------------------------------------------------------------------- beside the model


def place_beside(scene: Scene, number: int, columns: int = 8) -> np.ndarray:
    """Return by how much the section of a number from 0 on is moved, (3,): right of the model.

    After so many columns a new row begins below.
    """
    size = scene.upper - scene.lower
    row, column = divmod(number, columns)
    wide, high = max(size[0], 0.3 * size.max()), max(size[2], 0.3 * size.max())
    right = (column + 1) * GAP * wide
    return np.array([right, AWAY * right, -row * ROW_GAP * high])


def title_place(scene: Scene, plane: Plane, shift: np.ndarray) -> np.ndarray:
    """Return where the name of a section stands: above its left end, (3,)."""
    frame = frame_of_plane(scene, plane).reshape(-1, 3)
    left = frame[frame[:, 0].argmin()] if len(frame) else scene.lower
    size = float((scene.upper - scene.lower).max())
    return np.array([left[0], left[1], scene.upper[2] + 0.06 * size]) + shift


def model_with(scene: Scene, plane: Plane) -> list[Lines | Faces]:
    """Return the plane of the section within the model."""
    frame = frame_of_plane(scene, plane)
    if not len(frame):
        return []
    middle = np.broadcast_to(frame.mean(axis=(0, 1)), (len(frame), 1, 3))
    return [coloured(frame, RED), tinted(np.concatenate([middle, frame], axis=1), RED, 0.12)]


def outline_beside(contour_lines: np.ndarray, shift: np.ndarray) -> Lines:
    """Return the object's contour in a section."""
    return coloured(contour_lines + shift, (*GREY[:3], 0.9))
