"""Lesson "hierarchy_cost": with a hierarchy a ray costs O(log N), if the scene is well structured.

The slide "Hierarchy". The mesh is traced in parts, each twice as large as the one before
(:mod:`.growth`). In the chart beside it, log2 N goes to the right, the nodes that a ray enters in a
BVH go up (N_TS, blue), and so do its tests (N_IT, green); a straight line here is a + b log2 N.
The orange curve is the naive algorithm, y = N, as far as there is room for it. In the picture are
the nodes of this part's BVH that the violet ray enters: grey inner ones, green leaves, and orange
what is tested in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.events import TEST, VISIT_INNER, VISIT_LEAF
from ..geometry.box_shape import box_segments
from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Chart, coloured, items_in, picture_of, some_of
from .growth import Growth, fitted_line, growth_of
from .lesson import Lesson, Play, Subject
from .naive_cost import arrow
from .picture import Mark, Picture, Row

MOST_PARTS = 14
"""Parts, each twice as large as the one before."""

ROOM = 1.3
"""Height of the chart, in the largest N_TS."""

MOST_BOXES = 300
"""Nodes that are drawn."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    doubling: int = setting(
        11, "Doubling", "How often the part has been doubled", unit="times", minimum=0
    )


class HierarchyCost(Play):
    """The cost of a scene that is doubled again and again."""

    def __init__(self, scene: Scene, growth: Growth, progress: Progress) -> None:
        self.scene, self.growth = scene, growth
        self.ends = {"doubling": len(growth.counts) - 1}
        self.logarithm = np.log2(growth.counts)
        self.steps, self.tests = growth.steps.mean(axis=1), growth.tests.mean(axis=1)
        self.line = fitted_line(self.logarithm, self.steps)
        self.walks = []
        for done, tree in enumerate(growth.trees):
            progress.report(done, len(growth.trees), "Recording a ray")
            self.walks.append(tree.record(growth.rays, growth.middle))

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one part."""
        growth, place = self.growth, settings.doubling
        n, tree, walk = int(growth.counts[place]), growth.trees[place], self.walks[place]
        boxes = tree.arrays.volumes.boxes()
        inner = some_of(walk.cell[walk.events_of(VISIT_INNER)], MOST_BOXES)
        leaves = some_of(walk.cell[walk.events_of(VISIT_LEAF)], MOST_BOXES)
        tested = np.unique(walk.primitive[walk.events_of(TEST)])

        top = ROOM * float(max(self.steps.max(), self.tests.max()))
        chart = Chart.beside(self.scene, 0.0, float(max(self.logarithm[-1], 1.0)), top)
        curve = np.linspace(0.0, self.logarithm[-1], 200)
        naive = np.where(2.0**curve <= top, 2.0**curve, np.nan)
        a, b = self.line
        ends = self.logarithm[[0, -1]]
        x = float(self.logarithm[place])
        parts: list[Any] = [
            items_in(self.scene, growth.order[:n], GREY, 0.2, most=3000),
            items_in(self.scene, growth.order[tested], ORANGE, 0.9),
            coloured(box_segments(boxes[inner]), (*GREY[:3], 0.8)),
            coloured(box_segments(boxes[leaves]), GREEN),
            arrow(growth.chord(self.scene)),
            chart.axes(),
            chart.curve(curve, naive, ORANGE),
            coloured(chart.curve(ends, a + b * ends, BLUE).segments, (*BLUE[:3], 0.5)),
            chart.stars(self.logarithm, self.steps, BLUE),
            chart.curve(self.logarithm, self.tests, GREEN),
            chart.mark(x, float(self.steps[place]), RED),
        ]
        steps, tests = self.steps[place], self.tests[place]
        marks = [
            *chart.named(f"log2 N = {x:.1f}", "for one ray"),
            Mark(chart.at(0.35, 0.98), "naive: N", ORANGE[:3]),
            Mark(chart.at(0.6, 0.86), f"N_TS = {steps:.1f}", BLUE[:3]),
            Mark(chart.at(0.6, 0.12), f"N_IT = {tests:.1f}", GREEN[:3]),
        ]
        ray = len(walk.events_of(VISIT_INNER)) + len(walk.events_of(VISIT_LEAF))
        caption = (
            f"N = {show_integer(n)}, log2 N = {x:.1f}: a ray enters {steps:.1f} nodes in the mean "
            f"and tests {tests:.1f} objects; the violet one enters {ray} and tests {len(tested)}"
        )
        rows = (
            Row("N", show_integer(n), "Objects in this part of the mesh"),
            Row("N_TS", f"{steps:.2f}", "Nodes that a ray enters, in the mean"),
            Row("N_IT", f"{tests:.2f}", "Tests of objects for a ray, in the mean"),
            Row("N_IT, Naive", show_integer(n), "What it takes without a hierarchy"),
            Row(
                "Fitted Line", f"{a:.2f} + {b:.2f} log2 N",
                "Least squares to N_TS of all parts: what each doubling adds",
            ),
            Row(
                "Time of a Ray", f"{1e6 * growth.seconds_bvh[place]:.3g} µs",
                f"Measured here; the naive algorithm takes {1e6 * growth.seconds[place]:.3g} µs",
            ),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Trace the parts of the scene."""
    scene = subject.scene.flat()
    n = len(scene)
    halvings = min(int(np.log2(n)), MOST_PARTS - 1)
    counts = [-(-n // 2**k) for k in range(halvings, -1, -1)]
    return HierarchyCost(scene, growth_of(scene, counts, progress), progress)


LESSONS = (
    Lesson(
        name="hierarchy_cost",
        label="What a Ray Costs in a Hierarchy",
        slide="Hierarchy",
        begin="A hierarchy of twice as many objects is about one level deeper, so doubling the "
        "scene adds a little to each ray instead of doubling its cost",
        look_for="The naive cost leaves the chart at once; the stars of the hierarchy stay near a "
        "line over log2 N",
        question="Is it O(log N) in the worst case, too?",
        answer="No. Where objects overlap much, or a ray passes along many of them without "
        "hitting any, it enters many leaves: in the worst case all of them, O(N). The logarithm "
        "is the ideal, of scenes with many small objects that are well apart",
        source="structures.bvh.hierarchy",
        sample="suzanne:subdivisions=1",
        Settings=Settings,
        play=play,
        film="doubling",
    ),
)
