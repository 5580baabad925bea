"""Lesson "classification": the ways to fewer and faster tests, with figures of this very scene.

The slide "Classification". Bars are the tests of a ray, in the mean over the same random lines
through a ball around the scene, on a logarithmic scale: without any structure, with one bounding
volume, with several that are sorted, with a hierarchy and with divisions of space. Of the chosen
one the picture shows what the violet ray tests: orange.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.events import TEST
from ..contract.structure import Structure
from ..geometry.instances import lines_of_items
from ..printing import show_integer
from ..progress import Progress
from ..sah.line_sample import Ball, random_lines_through
from ..settings import setting
from .drawing import BLUE, ORANGE, Chart, coloured, counted, items_in, picture_of, some_of
from .growth import number_of_lines
from .lesson import Lesson, Play, Subject
from .one_ray import RAY, point_at, rays_from_the_front
from .picture import Mark, Picture, Row
from .solid_efficiency import SPREAD

MOST_LINES = 300
"""Objects whose outlines are drawn: they are seen behind the mesh as well."""

WAYS = {
    "naive": ("naive", "naive", "Every ray against every object"),
    "volume": ("volume", "sorted_volumes:parts=1", "Faster tests: a volume around each object"),
    "sorted": ("sorted volumes", "sorted_volumes", "Fewer tests: volumes in the ray's order"),
    "hierarchy": ("BVH", "bvh", "Fewer tests: volumes of volumes"),
    "space": ("grid", "grid", "Fewer tests: cells in the ray's order"),
    "adaptive": ("kd-tree", "kdtree", "Fewer tests: small cells where there is much"),
}
"""Name in the chart, structure, and what is done about the cost."""

LESSON_OF = {
    "naive": "naive_cost",
    "volume": "bounding_volume",
    "sorted": "sorted_volumes",
    "hierarchy": "levels",
    "space": "uniform_subdivision",
    "adaptive": "kdtree_static",
}
"""Where to go on."""

OTHER_WAYS = (
    ("Directional Techniques", "Directional acceleration techniques", "Structures of directions"),
    (
        "Less Rays",
        "Classification",
        "Recursion control, adaptive anti-aliasing. Go on to less_rays_recursion",
    ),
    ("Generalized Rays", "Generalized rays", "Bundles, cones: one ray carries more"),
)
"""What is no bar: name, slide, meaning."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    way: str = setting(
        "hierarchy", "Way", "What is done about the cost",
        choices={name: text for name, (_, _, text) in WAYS.items()},
    )  # fmt: skip


class Ways(Play):
    """Structures over one scene, and what the same rays test in each."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        scene = self.scene = subject.scene
        number = number_of_lines(scene)
        ball = Ball.around(scene.lower, scene.upper, SPREAD)
        lines = random_lines_through(ball, number, seed=1)
        structures: dict[str, Structure] = dict(zip(WAYS, subject.structures, strict=True))
        self.tests, self.volumes = {}, {}
        for way, structure in structures.items():
            _, counts = structure.trace(lines, progress=progress)
            means = counts.means()
            self.tests[way] = sum(n for name, n in means.items() if name.startswith("N_IT"))
            self.volumes[way] = means.get("volume_tests", 0.0)
        self.lines = number
        if subject.rays is not None:
            self.ray = subject.rays.select(np.array([subject.ray]))
        else:
            rays = rays_from_the_front(scene)
            hits, counts = structures["hierarchy"].trace(rays)
            score = np.where(hits.primitive >= 0, counts["N_TS"], -1)
            self.ray = rays.select(np.array([int(score.argmax())]))
        self.tested: dict[str, np.ndarray] = {}
        self.count: dict[str, int] = {}
        for way, structure in structures.items():
            progress.report(len(self.tested), len(WAYS), "Recording a ray")
            steps = structure.record(self.ray, 0)
            tests = steps.events_of(TEST)
            own = tests[steps.level[tests] == 0]
            self.tested[way], self.count[way] = np.unique(steps.primitive[own]), len(tests)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one way."""
        chosen = settings.way
        lengths = {way: np.log10(1.0 + tests) for way, tests in self.tests.items()}
        rows_of_chart = len(WAYS) + 0.2
        chart = Chart.beside(self.scene, 0.0, 1.6 * max(lengths.values()), rows_of_chart, 0.6)
        tested = self.tested[chosen]
        parts: list[Any] = [
            items_in(self.scene, tested, ORANGE, 0.7, most=5000),
            coloured(lines_of_items(self.scene.geometry, some_of(tested, MOST_LINES)), ORANGE),
            self.line(),
            chart.axes(),
        ]
        marks = []
        for place, (way, length) in enumerate(lengths.items()):
            low, high = rows_of_chart - place - 0.8, rows_of_chart - place - 0.2
            parts.append(chart.bar(0.0, length, low, high, ORANGE if way == chosen else BLUE))
            end = chart.place(length, 0.5 * (low + high))
            marks.append(Mark(end, f"{WAYS[way][0]} {shown(self.tests[way])}",
                              ORANGE[:3] if way == chosen else None))  # fmt: skip
        marks.append(chart.named("", "tests for a ray, logarithmic")[1])
        name = WAYS[chosen][0]
        caption = (
            f"{name[0].upper()}{name[1:]}: {shown(self.tests[chosen])} tests for a ray in the mean "
            f"of {self.lines}; "
            f"the violet one takes {counted(self.count[chosen], 'test', 'tests')}"
        )
        rows = [
            Row(
                label[0].upper() + label[1:], f"{shown(self.tests[way])} tests",
                f"{text}; {shown(self.volumes[way])} tests of volumes. Go on to {LESSON_OF[way]}",
            )
            for way, (label, _, text) in WAYS.items()
        ]  # fmt: skip
        rows += [Row(label, f"slide {slide}", text) for label, slide, text in OTHER_WAYS]
        return picture_of(parts, caption, marks=marks, rows=rows)

    def line(self) -> Any:
        """Return the ray, as it passes the scene."""
        direction = self.ray.directions[0]
        length = float(np.linalg.norm(direction))
        middle = 0.5 * (self.scene.lower + self.scene.upper) - self.ray.origins[0]
        t, reach = float(middle @ direction) / length**2, 0.5 * self.scene.diagonal / length
        ends = np.clip([t - reach, t + reach], 0.0, float(self.ray.t_max[0]))
        return coloured(point_at(self.ray, ends)[None], RAY)


def shown(number: float) -> str:
    """Return a mean in few digits."""
    return show_integer(number) if number >= 100.0 else f"{number:.1f}"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Trace the same rays through all structures."""
    return Ways(subject, progress)


LESSONS = (
    Lesson(
        name="classification",
        label="Ways to Fewer and Faster Tests",
        slide="Classification",
        begin="A ray through a scene becomes cheaper by faster tests, by fewer tests, by fewer "
        "rays, or by rays that carry more",
        look_for="Each bar is a chapter of the lecture, measured on this scene; the scale is "
        "logarithmic: equal differences are equal factors",
        question="One bounding volume around everything: which rays does it help?",
        answer="Those that miss it. The others take one more test than before; the bar sinks by "
        "the share of rays that miss, no further",
        source="contract.structure",
        sample="suzanne:subdivisions=1",
        structures=tuple(spec for _, spec, _ in WAYS.values()),
        Settings=Settings,
        play=play,
        film="way",
        takes_ray=True,
    ),
)
