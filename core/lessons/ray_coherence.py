"""Lesson "ray coherence": two spheres, and the directions in which rays from one hit the other.

As on the lecture's slide "Ray coherence": the cone along the common inner tangents of both spheres
has all rays that leave the one and hit the other, and the slide's inequality says how wide it is
(:mod:`..structures.ray_coherence.condition`; REFERENCE.md 0.1 and A24).

Blue is the sphere that rays leave, green the one that they hit, orange the cone. Around the blue
one is its cube of directions: orange are the cells that list the green one, red those that list it
only by the slide's bound, which lacks a square. Circles on the cube are the caps themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.marks import cone_lines
from ..printing import show_integer
from ..progress import Progress
from ..settings import setting
from ..structures.ray_coherence import RayCoherence, RayCoherenceSettings
from ..structures.ray_coherence.condition import EXACT, LECTURE, cosine, solid_angle
from .around import SPHERE
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Colour,
    Faces,
    Lines,
    coloured,
    faint,
    halves,
    items_in,
    outlines,
    picture_of,
    tinted,
)
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Mark, Picture, Row

RAYS = 20_000
"""From points on one sphere to points on the other; how far they turn aside is a figure."""

AROUND = 96
"""Sides of a cap's circle."""

BEFORE = 1.02
"""How far before the cube the circles are drawn."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    source: int = setting(0, "From", "The object that rays leave", minimum=0)
    other: int = setting(
        2, "To", "Another one: that nearest to it is 0", minimum=0
    )  # fmt: skip
    cells: int = setting(
        8, "Cells", "Cells along an edge of a face of the cube", unit="cells", minimum=1,
        maximum=16,
    )  # fmt: skip


class TwoSpheres(Play):
    """The spheres around all objects, seen by both bounds."""

    def __init__(self, structures: dict[str, RayCoherence]) -> None:
        self.structures, self.scene = structures, structures[EXACT].scene
        count = len(self.scene)
        self.balls = structures[EXACT].arrays.balls[:count]
        self.ends = {"source": count - 1, "other": count - 2}

    def pair(self, settings: Settings) -> tuple[int, int]:
        """Return the object that rays leave, and the other one."""
        away = np.linalg.norm(self.balls[:, :3] - self.balls[settings.source, :3], axis=1)
        gaps = away - self.balls[:, 3]
        order = np.argsort(gaps, kind="stable")
        return settings.source, int(order[order != settings.source][settings.other])

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one pair."""
        source, other = self.pair(settings)
        one, two = self.balls[source], self.balls[other]
        way = two[:3] - one[:3]
        distance, radii = float(np.linalg.norm(way)), float(one[3] + two[3])
        cosines = {bound: float(cosine(radii, distance, bound)) for bound in (EXACT, LECTURE)}
        cells = {b: each.cells_that_see(source, other) for b, each in self.structures.items()}
        parts: list[Lines | Faces] = [*self.cube(source, cells)]
        parts.append(items_in(self.scene, np.array([source]), BLUE, 0.5))
        parts.append(items_in(self.scene, np.array([other]), GREEN, 0.5))
        for ball, colour in ((one, BLUE), (two, GREEN)):
            parts.append(tinted(ball[:3] + ball[3] * SPHERE, colour, 0.12))
        parts.append(coloured(np.array([[one[:3], two[:3]]]), GREY))
        least = least_cosine(one, two)
        if distance > radii:
            way = way / distance
            parts.append(coloured(tangent_cone(one, two, way, distance), (*ORANGE[:3], 0.8)))
            for bound, colour in ((LECTURE, RED), (EXACT, ORANGE)):
                parts.append(self.circle(source, way, cosines[bound], colour))
        marks = [
            Mark(one[:3], "S1", BLUE[:3]),
            Mark(two[:3], "S2", GREEN[:3]),
        ]
        rows = self.rows(radii, distance, cosines, cells, least)
        caption = self.words(source, other, radii, distance, cosines, cells)
        return picture_of(parts, caption, marks=marks, rows=rows)

    def cube(self, source: int, cells: dict[str, np.ndarray]) -> list[Lines | Faces]:
        """Return the cube of a sphere: its cells faint, those that list the other one tinted."""
        structure, number = self.structures[EXACT], np.arange(len(cells[EXACT]))
        corners = structure.corners_of(np.full(len(number), source), number)
        only = cells[LECTURE] & ~cells[EXACT]
        return [
            coloured(outlines(corners), faint(GREY, 0.25)),
            tinted(halves(corners[only]), RED, 0.25),
            coloured(outlines(corners[only]), faint(RED, 0.6)),
            tinted(halves(corners[cells[EXACT]]), ORANGE, 0.5),
            coloured(outlines(corners[cells[EXACT]]), faint(ORANGE, 0.8)),
        ]

    def circle(self, source: int, way: np.ndarray, least: float, colour: Colour) -> Lines:
        """Return the border of a cap of directions, as it lies on the cube."""
        across = np.cross(way, np.eye(3)[np.abs(way).argmin()])
        across /= np.linalg.norm(across)
        angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
        around = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * np.cross(way, across)
        directions = least * way + np.sqrt(1.0 - least * least) * around
        directions /= np.abs(directions).max(axis=1, keepdims=True)
        half = BEFORE * float(self.structures[EXACT].half_edges()[source])
        return coloured(outlines((self.balls[source, :3] + half * directions)[None]), colour)

    def rows(
        self,
        radii: float,
        distance: float,
        cosines: dict[str, float],
        cells: dict[str, np.ndarray],
        least: float,
    ) -> tuple[Row, ...]:
        """Return the figures of both bounds beside each other."""
        n_cells = show_integer(len(cells[EXACT]))
        angles = {bound: f"{np.degrees(np.arccos(each)):.4g}" for bound, each in cosines.items()}
        said = {
            bound: f"{each:.5f}" if distance > radii else "any" for bound, each in cosines.items()
        }
        caps = {bound: float(solid_angle(each)) for bound, each in cosines.items()}
        return (
            Row("(R1 + R2) / d", f"{radii / distance:.4g}" if distance else "no distance",
                "Radii of both spheres / distance of their centres"),
            Row("Cosine", said[EXACT], "Exact: sqrt(1 - ((R1 + R2) / d)^2)"),
            Row("Cosine, Slide", said[LECTURE], "sqrt(1 - (R1 + R2) / d)"),
            Row("Least Cosine of Rays", f"{least:.5f}",
                f"Of {show_integer(RAYS)} rays from one sphere to the other"),
            Row("Angle", f"{angles[EXACT]} deg", "Between such a ray and the line of centres"),
            Row("Angle, Slide", f"{angles[LECTURE]} deg", "By the slide's bound"),
            Row("Cap, Slide / Exact", f"{caps[LECTURE] / caps[EXACT]:.3g}",
                "Solid angles in which the other sphere is listed"),
            Row("Cells", f"{int(cells[EXACT].sum())} of {n_cells}", "That list it"),
            Row("Cells, Slide", f"{int(cells[LECTURE].sum())} of {n_cells}",
                "That list it by the slide's bound"),
        )  # fmt: skip

    def words(
        self,
        source: int,
        other: int,
        radii: float,
        distance: float,
        cosines: dict[str, float],
        cells: dict[str, np.ndarray],
    ) -> str:
        """Say in which directions the other one is listed."""
        item = self.scene.item_name
        which = f"{item} {other}", f"{item} {source}"
        if not distance > radii:
            return (
                f"The spheres around {which[1]} and {which[0]} overlap: rays may go from one into "
                "the other in any direction, and all cells list it"
            )
        exact, slide = (np.degrees(np.arccos(cosines[bound])) for bound in (EXACT, LECTURE))
        return (
            f"Rays that leave {which[1]} hit the sphere around {which[0]} within {exact:.1f} "
            f"degrees of the line of centres, {slide:.1f} by the slide's bound: "
            f"{int(cells[EXACT].sum())} and {int(cells[LECTURE].sum())} of "
            f"{len(cells[EXACT])} cells list it"
        )

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return pairs from near to far."""
        last = self.ends["other"]
        source = min(settings.source, self.ends["source"])
        others = sorted({0, min(settings.other, last), last // 2, last})
        return [Settings(source, other, settings.cells) for other in others]


def tangent_cone(one: np.ndarray, two: np.ndarray, way: np.ndarray, distance: float) -> np.ndarray:
    """Return the common inner tangents of two spheres, from where they touch the one to the other.

    They meet in a point between the spheres; the circles are those in which the cone touches them.
    """
    radii = one[3] + two[3]
    if not radii > 0.0:
        return np.array([[one[:3], two[:3]]])
    apex = one[:3] + way * distance * one[3] / radii
    sine = radii / distance
    # Of the way from the apex to a centre, r / sine, all but sine squared is up to the circle.
    begin, end = (ball[3] / sine * (1.0 - sine * sine) for ball in (one, two))
    return cone_lines(apex, way, float(np.arcsin(sine)), -begin, end)


def least_cosine(one: np.ndarray, two: np.ndarray) -> float:
    """Return the least cosine with the line of centres of many rays from one sphere to another."""
    points = np.random.default_rng(1).normal(size=(2, RAYS, 3))
    points /= np.linalg.norm(points, axis=2, keepdims=True)
    begin, end = (ball[:3] + ball[3] * unit for ball, unit in zip((one, two), points, strict=True))
    ways, line = end - begin, two[:3] - one[:3]
    lengths = np.linalg.norm(ways, axis=1) * np.linalg.norm(line)
    return float(((ways @ line)[lengths > 0.0] / lengths[lengths > 0.0]).min(initial=1.0))


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Put spheres around all objects, with cubes by both bounds."""
    scene = subject.scene
    if len(scene) < 2:
        raise InputError(f"{scene.name} has one {scene.item_name} only, and a pair is two; add one")
    structures = {
        bound: RayCoherence.build(
            scene, RayCoherenceSettings(cells=settings.cells, bound=bound), progress
        )
        for bound in (EXACT, LECTURE)
    }
    structures[EXACT].cells_that_see(0, 1)  # compiled now, and not at the first picture
    return TwoSpheres(structures)


LESSONS = (
    Lesson(
        name="ray_coherence",
        label="Ray Coherence",
        slide="Ray coherence",
        begin="A ray that leaves one sphere and hits another cannot turn far from the line of "
        "their centres: no farther than a common inner tangent",
        look_for="The cone touches both spheres, and no ray turns farther; the cap by the slide's "
        "bound, without the square, holds the exact one and is several times as large",
        question="The slide's bound lists the sphere in too many directions. Does that give wrong "
        "pictures?",
        answer="No: what is squared is at most 1, so its cap holds the exact one, and one object "
        "too many costs a test. The farther the spheres are apart, the more of them: 2.2 times "
        "the solid angle at (R1 + R2) / d = 0.5, 10.2 times at 0.1",
        source="structures.ray_coherence.condition",
        sample="soup:count=6,edge=0.22",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="other",
        replays=("cells",),
    ),
)
