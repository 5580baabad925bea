"""Coloured lines and faces, the stuff of pictures, put together from parts; and charts of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..geometry.instances import lines_of_items
from ..geometry.marks import stars
from ..geometry.triangles import Triangles
from ..scene import Scene
from .picture import Image, Mark, Picture, Row

Colour = tuple[float, float, float, float]

BLUE: Colour = (0.03, 0.62, 0.93, 1.0)
ORANGE: Colour = (1.0, 0.57, 0.34, 1.0)
GREEN: Colour = (0.20, 0.75, 0.42, 1.0)
RED: Colour = (0.96, 0.30, 0.40, 1.0)
GREY: Colour = (0.55, 0.55, 0.60, 1.0)


@dataclass(frozen=True)
class Lines:
    """Lines and their colours.

    Attributes
    ----------
    segments : (k, 2, 3) float64
    colours : (k, 4) float64
        sRGB and opacity.
    """

    segments: np.ndarray
    colours: np.ndarray


@dataclass(frozen=True)
class Faces:
    """Translucent triangles and their colours.

    Attributes
    ----------
    triangles : (m, 3, 3) float64
    colours : (m, 4) float64
        sRGB and opacity.
    """

    triangles: np.ndarray
    colours: np.ndarray


def coloured(segments: np.ndarray, colour: Colour) -> Lines:
    """Return segments (k, 2, 3), all in one colour."""
    return Lines(segments, np.tile(np.array(colour), (len(segments), 1)))


def tinted(triangles: np.ndarray, colour: Colour, opacity: float = 0.25) -> Faces:
    """Return triangles (m, 3, 3), all in one colour."""
    return Faces(triangles, np.tile(np.array((*colour[:3], opacity)), (len(triangles), 1)))


def picture_of(
    parts: Sequence[Lines | Faces],
    caption: str,
    *,
    marks: Sequence[Mark] = (),
    rows: Sequence[Row] = (),
    images: Sequence[Image] = (),
) -> Picture:
    """Return parts as one picture; where lines coincide, the last is seen."""
    lines = [part for part in parts if isinstance(part, Lines)]
    faces = [part for part in parts if isinstance(part, Faces)]
    return Picture(
        caption,
        np.concatenate([np.empty((0, 2, 3)), *(part.segments for part in lines)]),
        np.concatenate([np.empty((0, 4)), *(part.colours for part in lines)]),
        np.concatenate([np.empty((0, 3, 3)), *(part.triangles for part in faces)]),
        np.concatenate([np.empty((0, 4)), *(part.colours for part in faces)]),
        tuple(marks), tuple(rows), tuple(images),
    )  # fmt: skip


def halves(rectangles: np.ndarray) -> np.ndarray:
    """Return rectangles, (n, 4, 3) once around, as triangles, (2 n, 3, 3)."""
    return rectangles[:, [(0, 1, 2), (0, 2, 3)]].reshape(-1, 3, 3)


def some_of(numbers: np.ndarray, most: int) -> np.ndarray:
    """Return not more than so many of some numbers, evenly chosen."""
    if len(numbers) <= most:
        return numbers
    return numbers[np.linspace(0, len(numbers) - 1, most).astype(np.int64)]


def shifted(part: Lines | Faces, by: np.ndarray) -> Lines | Faces:
    """Return a part elsewhere."""
    if isinstance(part, Lines):
        return Lines(part.segments + by, part.colours)
    return Faces(part.triangles + by, part.colours)


def items_in(
    scene: Scene, items: np.ndarray, colour: Colour, opacity: float = 0.25, most: int = 1500
) -> Lines | Faces:
    """Return some of a scene's items in a colour: triangles as faces, others by their lines.

    Parameters
    ----------
    items : (n,) int
    most : int
        Of more of them, so many are evenly chosen.
    """
    items = some_of(items, most)
    if isinstance(scene.geometry, Triangles):
        return tinted(scene.geometry.corners[items], colour, opacity)
    segments = lines_of_items(scene.geometry, items)
    return coloured(segments, (*colour[:3], 0.5 + 0.5 * opacity))


def faint(colour: Colour, opacity: float = 0.35) -> Colour:
    """Return a colour for what is not the subject."""
    return (*colour[:3], opacity)


def opaque(colours: np.ndarray) -> np.ndarray:
    """Return colours (k, 3) with an opacity of 1."""
    return np.concatenate([colours, np.ones((len(colours), 1))], axis=1)


def extent_of(scene: Scene) -> float:
    """Return the longest side of the box around a scene, or 1 if it has none."""
    return float((scene.upper - scene.lower).max()) or 1.0


def column(scene: Scene, texts: Sequence[tuple[str, Colour]]) -> list[Mark]:
    """Return texts in their colours below each other, above the left corner of a scene."""
    step = 0.08 * extent_of(scene)
    corner = np.array([scene.lower[0], scene.lower[1], scene.upper[2]])
    return [
        Mark(
            corner + np.array([0.0, 0.0, (len(texts) - line + 0.8) * step]), text, colour[:3], line
        )
        for line, (text, colour) in enumerate(texts)
    ]


def chart_below(scene: Scene, high: float, top: float, height: float = 0.4) -> Chart:
    """Return a chart below a scene, from 0 to `high` across and to `top` upwards."""
    size = extent_of(scene)
    width = max(float(scene.upper[0] - scene.lower[0]), 0.5 * size)
    corner = scene.lower - (0.1 + height) * size * np.array([0.0, 0.0, 1.0])
    across, upwards = np.array([width, 0.0, 0.0]), np.array([0.0, 0.0, height * size])
    return Chart(corner, across, upwards, 0.0, high, top)


def quads(corners: np.ndarray, colour: Colour, opacity: float = 0.25) -> Faces:
    """Return quadrilaterals (n, 4, 3), once around, all in one colour."""
    return tinted(halves(corners), colour, opacity)


def solid(boxes: np.ndarray, colour: Colour, opacity: float = 0.12) -> tuple[Lines, Faces]:
    """Return boxes (n, 6): their edges, and their faces translucent."""
    sides = [
        planes_across(boxes, axis, boxes[:, side]) for axis in range(3) for side in (axis, 3 + axis)
    ]
    return coloured(box_segments(boxes), colour), quads(np.concatenate(sides), colour, opacity)


def cut_across(box: np.ndarray, axis: int, position: float) -> tuple[Lines, Faces]:
    """Return the plane that divides a box (6,): red, with its diagonals."""
    cut = planes_across(box[None], axis, np.array([position]))
    lines = np.concatenate([outlines(cut), cut[0, [[0, 2], [1, 3]]]])
    return coloured(lines, RED), quads(cut, RED, 0.2)


def outlines(polygons: np.ndarray) -> np.ndarray:
    """Return the edges of polygons with k corners each, (n, k, 3), as segments (n k, 2, 3)."""
    edges = np.stack([polygons, np.roll(polygons, -1, axis=1)], axis=2)
    return edges.reshape(-1, 2, 3)


def counted(number: int, one: str, many: str) -> str:
    """Return a number with its noun: ``"1 node"``, ``"1 203 nodes"``."""
    return f"{number:,} {one if number == 1 else many}".replace(",", " ")


class Chart:
    """A chart in an upright plane beside the model.

    Parameters
    ----------
    origin : (3,) float64
        Its corner.
    across, upwards : (3,) float64
        Where from there x = `low` goes on to x = `high`, and y = 0 to y = `top`.
    low, high, top : float
    """

    def __init__(
        self,
        origin: np.ndarray,
        across: np.ndarray,
        upwards: np.ndarray,
        low: float,
        high: float,
        top: float,
    ) -> None:
        self.origin, self.across, self.upwards = origin, across, upwards
        self.low, self.span = low, (high - low) or 1.0
        self.top = top or 1.0

    @classmethod
    def beside(
        cls, scene: Scene, low: float, high: float, top: float, distance: float = 0.3
    ) -> Chart:
        """Return a chart to the right of a scene, as wide and nearly as high as that is long.

        Parameters
        ----------
        distance : float
            From the scene's box, in its longest side.
        """
        size = float((scene.upper - scene.lower).max())
        middle = 0.5 * (scene.lower + scene.upper)
        corner = np.array([scene.upper[0] + distance * size, middle[1], middle[2] - 0.4 * size])
        across, upwards = np.array([size, 0.0, 0.0]), np.array([0.0, 0.0, 0.8 * size])
        return cls(corner, across, upwards, low, high, top)

    def points(
        self, x: np.ndarray | Sequence[float], y: np.ndarray | Sequence[float]
    ) -> np.ndarray:
        """Return where values stand, (k, 3)."""
        along, above = (np.asarray(x) - self.low) / self.span, np.asarray(y) / self.top
        return self.origin + along[:, None] * self.across + above[:, None] * self.upwards

    def axes(self) -> Lines:
        """Return the two axes."""
        corner = self.origin
        ends = [[corner, corner + self.across], [corner, corner + self.upwards]]
        return coloured(np.array(ends), GREY)

    def named(self, x: str, y: str) -> list[Mark]:
        """Return the names of both axes: below the one, above the other."""
        return [Mark(self.at(0.5, -0.2), x), Mark(self.at(0.0, 1.08), y)]

    def at(self, along: float, above: float) -> np.ndarray:
        """Return a place, (3,), in shares of the chart's width and height."""
        return self.origin + along * self.across + above * self.upwards

    def stars(self, x: np.ndarray, y: np.ndarray, colour: Colour) -> Lines:
        """Return stars at points."""
        size = 0.05 * float(np.linalg.norm(self.upwards))
        return coloured(stars(self.points(x, y), np.full(len(x), size)), colour)

    def rectangles(
        self, left: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> np.ndarray:
        """Return rectangles from `left` to `right` and from `low` to `high`, (k, 4, 3)."""
        corners = [(left, low), (right, low), (right, high), (left, high)]
        return np.stack([self.points(x, y) for x, y in corners], axis=1)

    def bar(self, left: float, right: float, low: float, high: float, colour: Colour) -> Faces:
        """Return one bar, from `low` up to `high`."""
        return quads(self.rectangles(*np.array([[left], [right], [low], [high]])), colour, 0.8)

    def level(self, y: float, colour: Colour) -> Lines:
        """Return a line across the chart."""
        foot = self.origin + y / self.top * self.upwards
        return coloured(np.array([[foot, foot + self.across]]), colour)

    def curve(self, x: np.ndarray, y: np.ndarray, colour: Colour) -> Lines:
        """Return the curve through points; it is broken where y is not finite."""
        there = np.isfinite(y)
        points = self.points(x, np.where(there, y, 0.0))
        pieces = np.stack([points[:-1], points[1:]], axis=1)
        return coloured(pieces[there[:-1] & there[1:]], colour)

    def place(self, x: float, y: float) -> np.ndarray:
        """Return where one value stands, (3,)."""
        return self.points(np.array([x]), np.array([y]))[0]

    def blocks(
        self,
        left: np.ndarray,
        right: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        colour: Colour,
        opacity: float = 0.6,
    ) -> tuple[Lines, Faces]:
        """Return rectangles with their outlines; see :meth:`rectangles`."""
        found = self.rectangles(left, right, low, high)
        return coloured(outlines(found), colour), quads(found, colour, opacity)

    def mark(self, x: float, y: float, colour: Colour) -> Lines:
        """Return a star at a point, and the line from the axis up to it."""
        ends = self.points(np.array([x, x]), np.array([0.0, y]))
        size = 0.08 * float(np.linalg.norm(self.upwards))
        star = stars(ends[1:], np.array([size]))
        return coloured(np.concatenate([ends[None], star]), colour)
