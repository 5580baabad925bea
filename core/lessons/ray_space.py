"""Lesson "ray space": rays in a plane have two numbers, and their space can be drawn.

The toy of the slide "5D ray space". Rays begin at the left side of the scene, at heights z, and go
to the right in the plane y = const with the slope v; the other three numbers are the same for all.
So what of the cells of :mod:`..structures.ray_classification` these rays can come to is a picture
of z and v.

On the left the plane with the beam of one cell, on the right ray space: each rectangle is a cell,
its colour says how many candidates it lists. A point of the plane is a line there, for the rays
through it have z = p_z - v (p_x - x_0); so what is hit in the plane is a strip, between the lines
of both its ends. Green are the candidates of the orange cell, here and there.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..colours import ramp
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..geometry.triangles import Triangles
from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.ray_classification import RayClassification, RayClassificationSettings
from ..structures.ray_classification.ray_space import TIME, U, V, X, Y, Z
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    Chart,
    Faces,
    Lines,
    coloured,
    counted,
    faint,
    halves,
    items_in,
    outlines,
    picture_of,
    quads,
)
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Picture, Row

RAYS = 4000
"""Rays that are sent."""

ROOT = 2 * X
"""Of rays that run to the right, along x."""

MOST_RAYS, MOST_STRIPS = 12, 30
"""What is drawn: rays of a cell, and strips of candidates."""

STEPS = 48
"""Pieces of a strip, and of a beam, along the chart and along x."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    max_list_size: int = setting(
        2, "Max List Size", "A cell is divided if it lists more objects", unit="objects",
        minimum=1, maximum=1000,
    )  # fmt: skip
    cell: int = setting(0, "Cell", "Which cell: that with the most rays is the first", minimum=0)


class FlatRaySpace(Play):
    """Two dimensions of ray space, for rays of which all others are the same.

    Attributes
    ----------
    UP : int
        The dimension that goes upwards on the chart; across is Z.
    """

    UP: ClassVar[int]

    def __init__(self, structure: RayClassification, rays: Rays) -> None:
        self.structure, self.rays, self.scene = structure, rays, structure.scene
        self.hits, self.counts = structure.trace(rays)
        self.of_rays = structure.cells_of(rays)
        self.x, self.y = float(rays.origins[0, 0]), float(rays.origins[0, 1])
        self.cells = self.in_plane()
        in_each = np.array([(self.of_rays == cell).sum() for cell in self.cells])
        self.order = np.argsort(-in_each, kind="stable")
        self.ends = {"cell": len(self.cells) - 1}
        self.sizes = structure.sizes()[self.cells]

    def in_plane(self) -> np.ndarray:
        """Return the cells that these rays can come to, (k,)."""
        known = self.structure.known
        is_in = (self.structure.arrays.children < 0) & (known.root == ROOT)
        fixed = {X: self.x, Y: self.y, U: 0.0, V: 0.0, TIME: 0.0}
        del fixed[self.UP]
        for dimension, value in fixed.items():
            low, high = known.bounds[:, 0, dimension], known.bounds[:, 1, dimension]
            last = known.bounds[ROOT, 1, dimension]
            is_in &= (low <= value) & ((value < high) | (high == last))
        return np.flatnonzero(is_in)

    def chart(self) -> Chart:
        """Return the chart of both dimensions."""
        low, high = self.scene.lower[2], self.scene.upper[2]
        least, most = self.structure.known.bounds[ROOT, :, self.UP]
        return Chart.beside(self.scene, float(low), float(high), float(most - least))

    def above(self, values: np.ndarray) -> np.ndarray:
        """Return how high above its foot the chart has values of the dimension upwards."""
        return np.asarray(values - self.structure.known.bounds[ROOT, 0, self.UP])

    def rectangles(self, chart: Chart) -> np.ndarray:
        """Return where the cells stand on the chart, (k, 4, 3)."""
        low, high = (self.structure.known.bounds[self.cells, key] for key in range(2))
        return chart.rectangles(
            low[:, Z], high[:, Z], self.above(low[:, self.UP]), self.above(high[:, self.UP])
        )

    def candidates(self, cell: int) -> np.ndarray:
        """Return what a cell lists, in its order."""
        arrays = self.structure.arrays
        return np.asarray(arrays.references[arrays.first[cell] : arrays.last[cell]])

    def rays_of(self, cell: int) -> np.ndarray:
        """Return the rays in a cell, (k,)."""
        return np.flatnonzero(self.of_rays == cell)

    @abc.abstractmethod
    def lines(self, item: int, up: np.ndarray) -> np.ndarray | None:
        """Return the lines of both ends of what the plane cuts out of an item, (2, k): their z.

        None if it cuts nothing out.
        """

    def strip(self, chart: Chart, item: int) -> np.ndarray:
        """Return the rays that meet what the plane cuts out of an item, on the chart, (k, 4, 3)."""
        least, most = self.structure.known.bounds[ROOT, :, self.UP]
        up = np.linspace(least, most, STEPS + 1)
        lines = self.lines(item, up)
        if lines is None:
            return np.empty((0, 4, 3))
        left, right = (
            each.clip(chart.low, chart.low + chart.span)
            for each in (lines.min(axis=0), lines.max(axis=0))
        )
        y = self.above(up)
        corners = [(left[:-1], y[:-1]), (right[:-1], y[:-1]), (right[1:], y[1:]), (left[1:], y[1:])]
        return np.stack([chart.points(*corner) for corner in corners], axis=1)

    def on_chart(self, chart: Chart, cell: int, ups: np.ndarray) -> list[Lines | Faces]:
        """Return the chart with one of its cells, whose candidates are strips.

        Parameters
        ----------
        ups : (n,) float64
            Of all rays, the dimension upwards.
        """
        all_cells = self.rectangles(chart)
        own = all_cells[self.cells == cell]
        shades = ramp(self.sizes / max(int(self.sizes.max()), 1))
        colours = np.column_stack([shades, np.full(len(shades), 0.35)])
        some = self.rays_of(cell)[:MOST_RAYS]
        points = chart.points(self.rays.origins[some, 2], self.above(ups[some]))
        size = 0.02 * float(np.linalg.norm(chart.upwards))
        strips = [self.strip(chart, int(item)) for item in self.candidates(cell)[:MOST_STRIPS]]
        return [
            Faces(halves(all_cells), np.repeat(colours, 2, axis=0)),
            coloured(outlines(all_cells), faint(GREY, 0.5)),
            *(quads(strip, GREEN, 0.3) for strip in strips),
            coloured(stars(points, np.full(len(some), size)), BLUE),
            coloured(outlines(own), ORANGE),
            chart.axes(),
        ]

    def in_scene(self, cell: int, least: float, most: float) -> list[Lines | Faces]:
        """Return the beam of a cell within the plane and the scene, and rays of it.

        Parameters
        ----------
        least, most : float
            Slopes of its rays.
        """
        low, high = self.structure.known.bounds[cell, :, Z]
        bottom, top = self.scene.lower[2], self.scene.upper[2]
        x = np.linspace(self.x, self.scene.upper[0], STEPS + 1)
        lower, upper = (
            (z + slope * (x - self.x)).clip(bottom, top)
            for z, slope in ((low, least), (high, most))
        )
        edges = [np.column_stack([x, np.full(len(x), self.y), z]) for z in (lower, upper)]
        pieces = np.stack([edges[0][:-1], edges[0][1:], edges[1][1:], edges[1][:-1]], axis=1)
        some = self.rays_of(cell)[:MOST_RAYS]
        origins, ways = self.rays.origins[some], self.rays.directions[some]
        # To the hit, or to where they leave the box.
        limits = np.where(ways[:, 2] > 0.0, top, bottom) - origins[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            leave = np.where(ways[:, 2] == 0.0, np.inf, limits / ways[:, 2])
        ends = np.minimum(np.minimum(leave, self.scene.upper[0] - self.x), self.hits.t[some])
        return [
            quads(pieces, ORANGE, 0.15),
            coloured(outlines(np.concatenate([edges[0], edges[1][::-1]])[None]), ORANGE),
            coloured(np.stack([origins, origins + ends[:, None] * ways], axis=1), BLUE),
        ]

    def rows(self, cell: int) -> list[Row]:
        """Return the figures of a cell, and of all."""
        return [
            Row("Cells Here", show_integer(len(self.cells)),
                "That rays in this plane, from this line, can come to"),
            Row("Cells in All", show_integer(len(self.structure.arrays.children)),
                "Divided or not, in all dimensions"),
            Row("Candidates", show_integer(len(self.candidates(cell))), "Of this cell"),
            Row("Longest List", show_integer(int(self.sizes.max())), "Of the cells here"),
            Row("Rays", show_integer(len(self.rays_of(cell))),
                f"Of {show_integer(RAYS)}, in this cell"),
            Row("Tests", f"{self.counts['N_IT'].mean():.3g}", "Per ray, of all rays"),
        ]  # fmt: skip


class Slopes(FlatRaySpace):
    """Rays in a plane, with z and v."""

    UP = V

    def lines(self, item: int, up: np.ndarray) -> np.ndarray | None:
        """Return the lines z = p_z - v (p_x - x_0)."""
        if not isinstance(self.scene.geometry, Triangles):
            return None
        ends = cut_of_triangle(self.scene.geometry.corners[item], self.y)
        return None if ends is None else ends[:, 1:] - up * (ends[:, :1] - self.x)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one cell."""
        chart, cell = self.chart(), int(self.cells[self.order[settings.cell]])
        low, high = self.structure.known.bounds[cell]
        listed = self.candidates(cell)
        parts = [
            *self.on_chart(chart, cell, self.rays.directions[:, 2]),
            *self.in_scene(cell, low[V], high[V]),
            items_in(self.scene, listed, GREEN, 0.55),
        ]
        item = self.scene.item_name
        caption = (
            f"Rays from z = {low[Z]:.3g} to {high[Z]:.3g} with slopes v = {low[V]:.3g} to "
            f"{high[V]:.3g} may hit {counted(len(listed), item, f'{item}s')} of "
            f"{show_integer(len(self.scene))}"
        )
        marks = chart.named("z: where a ray begins", "v: its slope, from -1 to 1")
        return picture_of(parts, caption, marks=marks, rows=self.rows(cell))


def cut_of_triangle(corners: np.ndarray, y: float) -> np.ndarray | None:
    """Return the x and z of both ends of what a plane across y cuts out of a triangle, (2, 2).

    None if it cuts nothing out.
    """
    heights, points = corners[:, 1] - y, []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        if heights[i] == 0.0:
            points.append(corners[i, [0, 2]])
        if heights[i] * heights[j] < 0.0:
            share = heights[i] / (heights[i] - heights[j])
            points.append((corners[i] + share * (corners[j] - corners[i]))[[0, 2]])
    return np.array(points[:2]) if len(points) > 1 else None


def rays_in_plane(scene: Scene, slopes: np.ndarray, times: np.ndarray | float = 0.0) -> Rays:
    """Return rays to the right in the middle plane of a scene, from its left side, all seeded.

    Parameters
    ----------
    slopes : (RAYS,) float64
    times : (RAYS,) float64, optional
    """
    origins = np.empty((RAYS, 3))
    origins[:, 0] = scene.lower[0]
    origins[:, 1] = 0.5 * (scene.lower[1] + scene.upper[1])
    share = np.random.default_rng(1).random(RAYS)
    origins[:, 2] = scene.lower[2] + share * (scene.upper[2] - scene.lower[2])
    directions = np.column_stack([np.ones(RAYS), np.zeros(RAYS), slopes])
    return Rays.from_arrays(origins, directions, times=times)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Send rays in a plane, which make the cells that they need."""
    progress.report(0, 1, "Sending rays")
    chosen = RayClassificationSettings(
        max_list_size=settings.max_list_size, min_rays=4, truncate=False
    )
    structure = RayClassification.build(subject.scene, chosen, progress)
    slopes = np.random.default_rng(2).uniform(-1.0, 1.0, RAYS)
    return Slopes(structure, rays_in_plane(subject.scene, slopes))


LESSONS = (
    Lesson(
        name="ray_space",
        label="Ray Space",
        slide="5D ray space",
        begin="A ray is a point of ray space. In the plane that has two dimensions, where a ray "
        "begins and where it goes, and can be drawn",
        look_for="Orange is one cell: on the right a rectangle, on the left the beam of its rays. "
        "Strips of what is green reach into the rectangle, or pass it by where an object is met "
        "beside the plane: a cell has a depth in those dimensions, too, that are not drawn",
        question="Through one point of the plane there are many rays. What are they in ray space?",
        answer="A line, z = p_z - v (p_x - x_0): the farther away the point, the more it leans. An "
        "object is the strip between the lines of its ends; so a cell lists the strips that reach "
        "into it",
        source="structures.ray_classification.ray_space",
        sample="nonuniform",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="cell",
        replays=("max_list_size",),
    ),
)
