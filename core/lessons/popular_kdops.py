"""Lesson "popular_kdops": the four usual k-DOPs of one object side by side.

The slide "Most popular k-DOPs". Sides across an axis are blue, those that cut corners orange, those
that cut edges green.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.outlines import triangles_of
from ..geometry.kdop import KDOPs
from ..progress import Progress
from ..sah.volume_around import volume_around
from ..scene import Scene
from ..settings import setting
from .around import beside_each_other, edges_of, hull_surface
from .drawing import BLUE, GREEN, GREY, ORANGE, coloured, items_in, picture_of, shifted, tinted
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

KINDS = {
    "6": "The axes: an axis-aligned box",
    "14": "And the corners of a cube",
    "18": "And the edges of a cube, but no corners",
    "26": "Axes, corners and edges",
}

COLOURS = {1: BLUE, 2: GREEN, 3: ORANGE}
"""By the number of components of a normal that are not 0."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    k: str = setting("26", "k", "Which of them stands out", choices=KINDS)


class Popular(Play):
    """Four k-DOPs around one object."""

    def __init__(self, scene: Scene, progress: Progress) -> None:
        self.scene = scene
        self.hull = hull_surface(scene, progress)
        self.volumes = {k: volume_around(scene, f"kdop{k}", progress) for k in KINDS}
        self.areas = {k: float(each.areas()[0]) for k, each in self.volumes.items()}
        self.contents = {k: float(each.contents()[0]) for k, each in self.volumes.items()}
        self.edges = {k: edges_of(each)[0] for k, each in self.volumes.items()}
        self.sides = {k: sides_of(each) for k, each in self.volumes.items()}
        self.body = items_in(scene, np.arange(len(scene)), GREY, 0.3, most=4000)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture with one of them standing out."""
        size = self.scene.upper - self.scene.lower
        above = self.scene.upper - np.array([size[0], 0.5 * size[1], -0.08 * size.max()])
        parts: list[Any] = []
        marks = []
        for k, place in zip(KINDS, beside_each_other(self.scene, len(KINDS)), strict=True):
            bright = k == settings.k
            if place.any():  # the object itself is there once
                parts.append(shifted(self.body, place))
            for components, triangles in self.sides[k].items():
                colour = COLOURS[components]
                parts.append(tinted(triangles + place, colour, 0.45 if bright else 0.12))
            parts.append(coloured(self.edges[k] + place, BLUE if bright else (*GREY[:3], 0.7)))
            share = self.hull / self.areas[k] if self.areas[k] > 0.0 else 1.0
            marks.append(Mark(above + place, f"{k}-DOP: hull / volume {share:.2f}"))
        k = settings.k
        counts = "; ".join(f"{other}-DOP {self.areas[other]:.4g}" for other in KINDS)
        caption = (
            f"{k}-DOP, {KINDS[k][0].lower() + KINDS[k][1:]}: {int(k) // 2} strips; "
            f"surfaces of all: {counts}"
        )
        rows = [
            Row(
                f"{other}-DOP", f"S = {self.areas[other]:.4g}, V = {self.contents[other]:.4g}",
                f"Surface and content of {int(other) // 2} strips: {int(other)} numbers to store",
            )
            for other in KINDS
        ]  # fmt: skip
        rows.append(Row("Hull", f"S = {self.hull:.4g}", "Surface of the convex hull"))
        return picture_of(parts, caption, marks=marks, rows=rows)


def sides_of(volume: KDOPs) -> dict[int, np.ndarray]:
    """Return the sides of a k-DOP as triangles, by the kind of their normals, see COLOURS."""
    polygons = volume.polygons(np.arange(1))
    count = np.diff(polygons.offsets)
    first, points = polygons.offsets[:-1], polygons.points
    # The fan from the first corner, added up: robust where corners nearly coincide.
    following = np.arange(len(points)) + 1
    following[polygons.offsets[1:] - 1] = first
    owner = np.repeat(np.arange(len(count)), count)
    from_first = points - points[first][owner]
    normals = np.zeros((len(count), 3))
    np.add.at(normals, owner, np.cross(from_first, from_first[following]))
    units = volume.directions / np.linalg.norm(volume.directions, axis=1, keepdims=True)
    strip = np.abs(normals @ units.T).argmax(axis=1)
    components = np.abs(volume.directions).sum(axis=1).astype(int)[strip]
    triangles, side = triangles_of(polygons._replace(owners=np.arange(len(count))))
    return {n: triangles[components[side] == n] for n in COLOURS}


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit the four of them."""
    return Popular(subject.scene, progress)


LESSONS = (
    Lesson(
        name="popular_kdops",
        label="The Usual k-DOPs",
        slide="Most popular k-DOPs",
        begin="The axes alone make a box; a cube's corners and edges give the other directions "
        "that are in use",
        look_for="Orange sides have cut off corners, green ones edges; with both the volume is "
        "close to the convex hull",
        question="18 half-spaces are more than 14. Is an 18-DOP always tighter than a 14-DOP?",
        answer="No. Neither contains the directions of the other: the regular octahedron is its "
        "own 14-DOP, and its 18-DOP has 1.22 times its surface. Only 26 is at least as tight as "
        "all others",
        source="geometry.kdop",
        sample="bunny",
        Settings=Settings,
        play=play,
        film="k",
    ),
)
