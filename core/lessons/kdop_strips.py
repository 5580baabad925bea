"""Lesson "kdop_strips": a k-DOP is what strips leave of space, each with two numbers, d and D.

The slide "Convex shapes". One direction after the other, two parallel planes (red) slide from afar
until they touch the object (green): n . p is d where the one touches, and D where the other does.
Blue is what all strips so far leave. Lines through the middle are the directions of all strips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..geometry.geometry import hulls_of
from ..geometry.half_spaces import every_other, faces_of, measured
from ..geometry.marks import stars
from ..geometry.polygons import Polygons
from ..progress import SILENT, Progress
from ..sah.volume_around import volume_around
from ..scene import Scene
from ..settings import setting
from .around import edges_of, hull_surface, surface_of
from .drawing import BLUE, GREEN, GREY, RED, coloured, outlines, picture_of, quads, tinted
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

STEPS = 6
"""Pictures of a strip that slides; in the last one it touches."""

AFAR = 0.5
"""Where planes begin, in sizes of the scene before the object."""

KINDS = {"6": "Axes", "14": "Axes and corners", "18": "Axes and edges", "26": "All of them"}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    k: str = setting("14", "k", "How many half-spaces: twice the directions", choices=KINDS)
    frame: int = setting(0, "Frame", "How far the strips have come", minimum=0)


class Left(NamedTuple):
    """What half-spaces leave of space, as a list of one polyhedron; they need not be tight.

    Attributes
    ----------
    planes : (1, m, 4) float64
        Each [nx, ny, nz, h], for ``n . p <= h``.
    around : (1, 6) float64
        A box around it.
    """

    planes: np.ndarray
    around: np.ndarray

    def boxes(self) -> np.ndarray:
        """Return the box around it, (1, 6)."""
        return self.around

    def half_spaces(self, numbers: np.ndarray) -> np.ndarray:
        """Return the half-spaces, (k, m, 4)."""
        return self.planes[numbers]

    def neighbours(self) -> np.ndarray:
        """Return the half-spaces that may cut each face: all others."""
        return every_other(self.planes.shape[1])

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the faces."""
        return faces_of(self, numbers, progress)


class Strips(Play):
    """The strips of one k-DOP around a scene."""

    def __init__(self, scene: Scene, k: int, progress: Progress) -> None:
        self.scene, self.k = scene, k
        self.volume = volume_around(scene, f"kdop{k}", progress)
        self.normals = self.volume.directions
        self.low, self.high = self.volume.rows[0, 0::2], self.volume.rows[0, 1::2]
        corners, _ = hulls_of(scene.geometry)
        points = corners.reshape(-1, 3)
        self.hull = hull_surface(scene, progress)
        self.touched = []
        for done, normal in enumerate(self.normals):
            progress.report(done, len(self.normals), "Looking for what the planes touch")
            along = points @ normal
            self.touched.append(points[[along.argmin(), along.argmax()]])
        self.ends = {"frame": STEPS * len(self.normals)}
        surface_of(self.left(1))  # compiled here, not in a picture

    def bounds(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where the planes of all strips are, (k / 2,) each; infinite if not yet begun.

        The axes have begun: they are the box that all slide into.
        """
        size = float((self.scene.upper - self.scene.lower).max())
        away = AFAR * size * np.linalg.norm(self.normals, axis=1)
        share = 1.0 - np.clip(frame / STEPS - np.arange(len(self.normals)), 0.0, 1.0)
        away = np.where((share < 1.0) | (np.arange(len(away)) < 3), away, np.inf)
        with np.errstate(invalid="ignore"):
            rest = np.where(share > 0.0, share * away, 0.0)
        return self.low - rest, self.high + rest

    def left(self, frame: int) -> Left:
        """Return what is left by the strips, as far as they have come."""
        low, high = self.bounds(frame)
        begun = np.isfinite(low)
        normals = self.normals[begun]
        planes = np.concatenate([
            np.column_stack([-normals, -low[begun]]), np.column_stack([normals, high[begun]])
        ])  # fmt: skip
        around = np.concatenate([low[:3], high[:3]])
        return Left(planes[None], around[None])

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of the strips as far as they have come."""
        frame = settings.frame
        strip = max(frame - 1, 0) // STEPS
        touches = frame > 0 and frame % STEPS == 0
        normal = self.normals[strip]
        low, high = (float(bounds[strip]) for bounds in self.bounds(frame))
        left = self.left(frame)
        edges, _ = edges_of(left)
        squares = np.stack([self.square(normal, height) for height in (low, high)])
        middle = 0.5 * (self.scene.lower + self.scene.upper)
        units = self.normals / np.linalg.norm(self.normals, axis=1, keepdims=True)
        across = 0.75 * self.scene.diagonal * np.stack([-units, units], axis=1)
        parts: list[Any] = [
            coloured(middle + across, (*GREY[:3], 0.4)),
            coloured(middle + across[strip : strip + 1], RED),
            tinted(surface_of(left), BLUE, 0.18),
            coloured(edges, BLUE),
            quads(squares, RED, 0.18),
            coloured(outlines(squares), RED),
        ]
        if touches:
            size = 0.06 * self.scene.diagonal
            parts.append(coloured(stars(self.touched[strip], np.full(2, size)), GREEN))
        marks = [
            Mark(squares[0, 0], f"d = {self.low[strip]:.4g}" if touches else "d?", RED[:3]),
            Mark(squares[1, 2], f"D = {self.high[strip]:.4g}" if touches else "D?", RED[:3]),
        ]
        areas, contents = measured(left)
        n = f"({', '.join(f'{component:g}' for component in normal)})"
        state = (
            f"it touches at d = {self.low[strip]:.4g} and D = {self.high[strip]:.4g}"
            if touches
            else "it slides from afar"
        )
        caption = (
            f"Strip {strip + 1} of {len(self.normals)}, n = {n}: {state}; what is left has "
            f"a surface of {areas[0]:.4g}"
        )
        rows = (
            Row("Normal", n, "Direction of this strip"),
            Row("d", f"{self.low[strip]:.6g}", "The least n . p over all vertices"),
            Row("D", f"{self.high[strip]:.6g}", "The largest n . p over all vertices"),
            Row("Surface", f"{areas[0]:.4g}", "Of what the strips leave so far"),
            Row("Content", f"{contents[0]:.4g}", "Of what the strips leave so far"),
            Row(
                "Hull / Volume", f"{self.hull / areas[0] if areas[0] > 0.0 else 1.0:.3f}",
                "Surface of the convex hull in that of what is left: at most 1",
            ),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def square(self, normal: np.ndarray, height: float) -> np.ndarray:
        """Return a square in the plane n . p = height beside the middle of the scene, (4, 3)."""
        middle = 0.5 * (self.scene.lower + self.scene.upper)
        foot = middle + (height - normal @ middle) / (normal @ normal) * normal
        u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        u *= 0.3 * self.scene.diagonal / np.linalg.norm(u)
        v = np.cross(normal, u) / np.linalg.norm(normal)
        return np.stack([foot - u - v, foot + u - v, foot + u + v, foot - u + v])

    def on_page(self, lesson: Lesson, settings: Settings) -> list[Any]:
        """Return a strip that slides, two that touch, and the end."""
        last = self.ends["frame"]
        frames = sorted({2, STEPS, 3 * STEPS, min(4 * STEPS - 2, last), last})
        return [Settings(settings.k, frame) for frame in frames]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Find d and D of all strips."""
    return Strips(subject.scene, int(settings.k), progress)


LESSONS = (
    Lesson(
        name="kdop_strips",
        label="Strips That Make a k-DOP",
        slide="Convex shapes",
        begin="A strip is the space between two parallel planes: of an object it needs only two "
        "numbers, and the intersection of strips is convex",
        look_for="Each pair of planes stops at the first vertex it touches; a diagonal strip cuts "
        "off corners that the axes left, if the object does not fill them",
        question="How many operations does a strip take per vertex, and why have the normals "
        "components 0, 1 and -1?",
        answer="At most two additions, and two comparisons: with such normals n . p is a sum "
        "without any product. They need not have unit length, as d and D are in the same unit",
        source="geometry.kdop",
        sample="bunny",
        Settings=Settings,
        play=play,
        film="frame",
        replays=("k",),
    ),
)
