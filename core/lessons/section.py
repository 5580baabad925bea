"""Sections: what a plane sees of cells and of the object, laid out beside the model.

The lecture draws subdivisions of space in the plane. So do the lessons on them: an upright plane
through a ray, or through the middle of the scene, cuts the cells of a structure and the surfaces
of the object, and what it cuts is drawn beside the model, once for every structure. A ray that
lies in the plane passes all its cells there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
from .drawing import GREY, RED, Colour, Faces, Lines, coloured, counted, tinted

GAP = 1.15
"""Distance of two sections, in widths of the scene."""

AWAY = 0.73
"""How far to the back a section stands for each step to the right: as seen from the front right,
where pictures are made, all are equally far away."""

ROW_GAP = 1.6
"""Distance of two rows of sections, in heights of the scene."""

FEW_ITEMS = 100
"""Items up to which whole outlines stand for the object, as on slides; else its contour."""

MOST_SIDES = 10_000
"""Sides of cells that are drawn in all sections of a picture, of the largest cells: more of them
are a grey mass."""

MOST_PIECES = 3000
"""Pieces of contours that are drawn in all sections, evenly chosen."""

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

    def drawn(self, colour: Colour) -> Lines:
        """Return the sides, all in one colour."""
        return coloured(self.segments, colour)

    def filled(self, colour: Colour, opacity: float = 0.3) -> Faces:
        """Return the polygons, all in one colour."""
        return tinted(self.fans(), colour, opacity)

    def where(self, kept: np.ndarray) -> Section:
        """Return only some sides, by a mask over them, (k,) bool."""
        return Section(self.segments[kept], self.owners[kept], self.left_out)

    def of(self, places: np.ndarray) -> Section:
        """Return only what belongs to some cells."""
        return self.where(np.isin(self.owners, places))

    def faces(self, colours: np.ndarray) -> Faces:
        """Return the polygons in colours by place, (n, 4)."""
        return Faces(self.fans(), colours[self.owners])

    def fans(self) -> np.ndarray:
        """Return the polygons as fans of triangles around their middles, (k, 3, 3)."""
        found, which = np.unique(self.owners, return_inverse=True)
        counts = np.bincount(which, minlength=len(found))
        middles = np.empty((len(found), 3))
        for axis in range(3):
            along = self.segments[:, :, axis].mean(axis=1)
            middles[:, axis] = np.bincount(which, along, len(found)) / counts
        return np.concatenate([middles[which][:, None], self.segments], axis=1)

    def moved(self, shift: np.ndarray) -> Section:
        """Return the section beside itself."""
        return self._replace(segments=self.segments + shift)

    def raised(self, scene: Scene) -> Section:
        """Return the section a hair nearer to the viewer, so that it is drawn over others."""
        return self.moved(RAISED * (scene.upper - scene.lower).max() * TO_VIEWER)


def section_of(cells: Cells, places: np.ndarray, plane: Plane, sections: int = 1) -> Section:
    """Return what a plane cuts of some cells.

    Parameters
    ----------
    places : (m,) int
        Ascending.
    sections : int
        So many stand in the picture, and share what can be drawn.
    """
    boxes, up = cells.boxes[places], plane.normal > 0.0
    lowest = np.where(up, boxes[:, :3], boxes[:, 3:])
    highest = np.where(up, boxes[:, 3:], boxes[:, :3])
    cut = places[(plane.above(lowest) <= 0.0) & (plane.above(highest) > 0.0)]
    most = MOST_SIDES // sections
    sizes = (cells.boxes[cut, 3:] - cells.boxes[cut, :3]).sum(axis=1)
    largest_first = cut[np.argsort(-sizes, kind="stable")]
    # What is cut of a cell has three sides at least.
    looked_at = largest_first[: most // 3]
    shaped, boxed = by_shape(cells, np.sort(looked_at))
    triangles, of_triangles = faces_of(cells, shaped)
    sides = sides_of(corners_of(cells.boxes[boxed]))
    pieces = [
        _cut(of_equal_size(triangles, of_triangles), plane),
        _cut(sides._replace(owners=boxed[sides.owners]), plane),
    ]
    segments = np.concatenate([segments for segments, _ in pieces])
    owners = np.concatenate([owners for _, owners in pieces])
    counts = np.bincount(owners, minlength=len(cells))[looked_at]
    kept = looked_at[np.cumsum(counts) <= most]
    section = Section(segments, owners, len(cut) - len(kept))
    return section.of(kept) if section.left_out else section


def contour(scene: Scene, plane: Plane, sections: int = 1) -> np.ndarray:
    """Return what a plane cuts of the surfaces of triangles, (k, 2, 3).

    Of a few items, and of such as are no triangles, the outlines.

    Parameters
    ----------
    sections : int
        In so many of them it is drawn.
    """
    if len(scene) <= FEW_ITEMS:
        lines = lines_of_items(scene.geometry, np.arange(len(scene)))
    else:
        lines = cut_items(scene, plane)[0]
    return thinned(lines, sections)


def thinned(lines: np.ndarray, sections: int) -> np.ndarray:
    """Return every second, third, ... line, so that as many sections can have them."""
    return lines[:: max(-(-sections * len(lines) // MOST_PIECES), 1)]


def triangles_as_polygons(corners: np.ndarray) -> Polygons:
    """Return triangles (n, 3, 3) as polygons, each its own."""
    return of_equal_size(corners, np.arange(len(corners)))


def cut_items(scene: Scene, plane: Plane) -> tuple[np.ndarray, np.ndarray]:
    """Return what a plane cuts of triangles, (k, 2, 3), and of which, (k,).

    Of other kinds the outlines of the first few items, as if they were all of item 0.
    """
    if not isinstance(scene.geometry, Triangles):
        lines = lines_of_items(scene.geometry, np.arange(min(len(scene), FEW_ITEMS)))
        return lines, np.zeros(len(lines), np.int64)
    return _cut(triangles_as_polygons(scene.triangles), plane)


def left_out_text(sections: Iterable[Section]) -> str:
    """Return what a caption says of sections: empty if all cells are drawn that are cut."""
    count = sum(section.left_out for section in sections)
    return f"; {counted(count, 'small cell is', 'small cells are')} not drawn" if count else ""


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


class Across:
    """What planes across y cut of a scene and of leaves, found fast: for a plane that is moved.

    Parameters
    ----------
    scene : Scene
    cells : sequence of Cells
        Of each section.
    """

    def __init__(self, scene: Scene, cells: Sequence[Cells]) -> None:
        self.scene, self.cells = scene, cells
        self.ends = [(each.boxes[:, 1].copy(), each.boxes[:, 4].copy()) for each in cells]
        self.corners = np.empty((0, 3, 3))
        if len(scene) > FEW_ITEMS and isinstance(scene.geometry, Triangles):
            self.corners = scene.triangles
        y = self.corners[:, :, 1]
        self.low, self.high = y.min(axis=1), y.max(axis=1)

    def section(self, number: int, plane: Plane, shown: np.ndarray, sections: int) -> Section:
        """Return what a plane across y cuts of those cells that a mask says, (n,) bool."""
        low, high = self.ends[number]
        y = plane.point[1]
        places = np.flatnonzero(shown & (low <= y) & (high > y))
        return section_of(self.cells[number], places, plane, sections)

    def contour(self, plane: Plane) -> np.ndarray:
        """Return what a plane across y cuts of the scene, see :func:`contour`."""
        if not len(self.corners):
            return contour(self.scene, plane, len(self.cells))
        y = plane.point[1]
        met = self.corners[(self.low <= y) & (self.high > y)]
        return thinned(_cut(triangles_as_polygons(met), plane)[0], len(self.cells))


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
