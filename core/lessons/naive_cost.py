"""Lesson "naive_cost": the naive algorithm tests every ray against every object, O(N) for one ray.

The slide "Ray-scene intersection". The mesh is traced in growing parts (:mod:`.growth`). In the
chart beside it N, the objects of a part, goes to the right, and the tests of one ray go up: orange
the naive algorithm, whose line is y = N, blue the mean of a BVH over the same part for comparison.
In the picture the part is blue, and so many tests has the violet ray.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from .drawing import BLUE, ORANGE, RED, Chart, Lines, coloured, items_in, picture_of
from .growth import Growth, growth_of, slope_through_zero
from .lesson import Lesson, Play, Subject
from .one_ray import RAY
from .picture import Mark, Picture, Row

PARTS = 8
"""Parts, each an eighth of the scene larger than the one before."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    part: int = setting(
        8, "Part", "How much of the mesh, in eighths", unit="eighths", minimum=1, maximum=PARTS
    )


class NaiveCost(Play):
    """The cost of a scene in eighths."""

    def __init__(self, scene: Scene, growth: Growth) -> None:
        self.scene, self.growth = scene, growth
        self.tests = growth.naive.mean(axis=1)
        self.with_bvh = growth.tests.mean(axis=1)
        self.slope = slope_through_zero(growth.counts.astype(float), self.tests)
        self.nanoseconds = 1e9 * slope_through_zero(growth.counts.astype(float), growth.seconds)
        self.ray = growth.chord(scene)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one part."""
        growth, place = self.growth, settings.part - 1
        n = int(growth.counts[place])
        chart = Chart.beside(self.scene, 0.0, float(growth.counts[-1]), float(growth.counts[-1]))
        x = growth.counts.astype(float)
        ends = np.array([0.0, x[-1]])
        parts: list[Any] = [
            items_in(self.scene, growth.order[:n], BLUE, 0.5, most=5000),
            arrow(self.ray),
            chart.axes(),
            coloured(chart.curve(ends, self.slope * ends, ORANGE).segments, (*ORANGE[:3], 0.5)),
            chart.stars(x, self.tests, ORANGE),
            chart.curve(x, self.with_bvh, BLUE),
            chart.mark(float(n), float(self.tests[place]), RED),
        ]
        naive, bvh = show_integer(self.tests[place]), f"{self.with_bvh[place]:.1f}"
        marks = [
            *chart.named(f"N = {show_integer(n)}", "tests for one ray"),
            Mark(chart.at(0.2, 0.85), f"naive: {naive}", ORANGE[:3]),
            Mark(chart.at(0.5, 0.1), f"BVH: {bvh}", BLUE[:3]),
        ]
        noun = f"{self.scene.primitive_name}{'' if n == 1 else 's'}"
        caption = (
            f"{settings.part} of {PARTS} parts: N = {show_integer(n)} {noun}, and every ray takes "
            f"{naive} tests; a BVH over the same takes {bvh} in the mean"
        )
        rows = (
            Row("N", show_integer(n), "Objects in this part of the mesh"),
            Row("N_IT, Naive", naive, "Tests for each ray: every object, hit or not"),
            Row("N_IT, BVH", bvh, "The mean over the same rays, in a BVH over the same part"),
            Row(
                "Fitted Line", f"{self.slope:.4g} N", "Least squares through all parts: it is O(N)"
            ),
            Row(
                "Time of a Ray", f"{1e6 * growth.seconds[place]:.3g} µs",
                "Measured here, with one thread and the naive algorithm",
            ),
            Row(
                "Time of a Ray, Fitted", f"{self.nanoseconds:.3g} ns N",
                "Least squares through the measured times of all parts",
            ),
            Row(
                "Time of a Ray, BVH", f"{1e6 * growth.seconds_bvh[place]:.3g} µs",
                "Measured in the same way",
            ),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return a small part, the half and the whole."""
        return [Settings(part) for part in (1, 4, 8)]

    def film(self, lesson: Lesson) -> Sequence[int]:
        """Return all parts."""
        return range(1, PARTS + 1)


def arrow(chord: np.ndarray) -> Lines:
    """Return a line with a head in its middle."""
    begin, end = chord
    along = end - begin
    middle = begin + 0.3 * along
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across *= 0.02 * np.linalg.norm(along) / np.linalg.norm(across)
    heads = [[middle, middle - 0.05 * along + side] for side in (across, -across)]
    return coloured(np.array([[begin, end], *heads]), RAY)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Trace the parts of the scene."""
    scene = subject.scene.flat()
    counts = [-(-len(scene) * part // PARTS) for part in range(1, PARTS + 1)]
    return NaiveCost(scene, growth_of(scene, counts, progress))


LESSONS = (
    Lesson(
        name="naive_cost",
        label="What a Ray Costs without Structure",
        slide="Ray-scene intersection",
        begin="To find what a ray hits first, the naive algorithm tests it against every object",
        look_for="Twice the objects are twice the tests, for each ray, whether it hits anything or "
        "not; the blue curve at the bottom is what this lecture is about",
        question="A picture of a million pixels shows a million triangles. How many tests does the "
        "naive algorithm take for its primary rays alone, and how long if one takes 5 ns?",
        answer="A million million, 10^12 tests: 5000 seconds, almost an hour and a half. Shadows, "
        "reflections and antialiasing multiply it. Whitted measured up to 95% of the time there",
        source="structures.naive",
        sample="suzanne:subdivisions=1",
        Settings=Settings,
        play=play,
        film="part",
    ),
)
