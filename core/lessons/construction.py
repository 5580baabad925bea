"""Lesson "construction": three trees over one mesh come about, from above, from below, by codes.

The slide "BVH construction ideas". Each copy shows its building after the same share of its steps,
as its log tells (:mod:`..contract.build_log`): from the top down the leaves of the tree so far, of
which one is divided in every step; from the bottom up the clusters that are left, of which two are
joined; by Morton codes the intervals, of which all of a level are divided at once. The three have
the same colours: by the number of objects in a box, blue for few and red for all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import count_colours
from ..errors import InputError
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import ranges_of
from .around import beside_each_other
from .drawing import GREY, Lines, counted, items_in, opaque, picture_of, shifted
from .hierarchy import has_log, is_tree
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

BUILDERS = {
    "Top-down": "bvh:builder=sweep_sah,max_leaf_size=1",
    "Bottom-up": "bvh:builder=agglomerative,max_leaf_size=1",
    "Morton codes": "bvh:builder=lbvh,max_leaf_size=1",
}
"""Structures, by what the copies are called."""

MOST_BOXES = 100
"""Boxes that are drawn in a copy: those with the most objects."""

MOST_ITEMS = 4000
"""Items that stand for the mesh in a copy."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    percent: int = setting(
        50, "Built", "Share of the steps that are done", unit="%", minimum=0, maximum=100
    )


class Building:
    """How one tree came about.

    Attributes
    ----------
    made, replaced : (n_nodes,) int64
        From which step on a node is there, and when others take its place.
    count : (n_nodes,) int64
        References below.
    last : int
        The last step.
    boxes_at, tests_at : (last + 1,) float64
        How many boxes are there after each step, and the tests of a line through the root if those
        were the leaves.
    """

    def __init__(self, bvh: BVH, progress: Progress, text: str) -> None:
        progress.report(0, 4, text)
        log = bvh.build_log
        assert log is not None
        if log.is_rearranged:
            raise InputError(
                f"the tree of {bvh.settings.builder} was too deep over this scene and was balanced "
                "after it was built; take a scene with fewer triangles in one place"
            )
        progress.report(1, 4, text)
        self.bvh, self.boxes = bvh, bvh.arrays.volumes.boxes()
        self.made, self.replaced = log.steps(bvh.parents())
        progress.report(2, 4, text)
        begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
        self.count, self.last = end - begin, log.last_step
        # Those with the most objects first; of equals some here and there.
        chance = np.random.default_rng(1).random(len(self.count))
        self._order = np.lexsort([chance, -self.count])
        self._made, self._replaced = self.made[self._order], self.replaced[self._order]
        progress.report(3, 4, text)
        tests = bvh.areas * self.count / (float(bvh.areas[0]) or 1.0)
        self.boxes_at, self.tests_at = self.there(np.ones(len(tests))), self.there(tests)
        self.cost = float(bvh.efficiency().expected[0])

    def step(self, percent: int) -> int:
        """Return the step after which a share of all is done."""
        return -(-self.last * percent // 100)

    def there(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of values of the nodes that are there after each step, (last + 1,)."""
        steps, never = self.last + 2, self.last + 1
        come = np.bincount(self.made, values, steps)
        go = np.bincount(np.minimum(self.replaced, never), values, steps)
        return np.cumsum(come - go)[:never]

    def nodes_at(self, step: int, most: int | None = None) -> np.ndarray:
        """Return the nodes that are there after a step and not yet replaced: a partition.

        Those with the most objects come first.
        """
        is_there = (self._made <= step) & (step < self._replaced)
        return self._order[np.flatnonzero(is_there)[:most]]


class Construction(Play):
    """Several buildings of trees over one scene."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        self.scene = subject.scene
        self.buildings: dict[str, Building] = {}
        for name, structure in zip(BUILDERS, subject.structures, strict=True):
            assert isinstance(structure, BVH)
            self.buildings[name] = Building(structure, progress, f"Reading the log, {name.lower()}")
        self.body = items_in(self.scene, np.arange(len(self.scene)), GREY, 0.3, most=MOST_ITEMS)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after a share of the steps."""
        size = self.scene.upper - self.scene.lower
        above = self.scene.upper - np.array([size[0], 0.5 * size[1], -0.12 * size.max()])
        parts: list[Any] = []
        marks, rows, texts = [], [], []
        places = beside_each_other(self.scene, len(self.buildings))
        for (name, building), place in zip(self.buildings.items(), places, strict=True):
            step = building.step(settings.percent)
            number = round(building.boxes_at[step])
            drawn = building.nodes_at(step, MOST_BOXES)[::-1]
            colours = count_colours(building.count[drawn] - 1, len(self.scene) - 1)
            colours = opaque(colours).repeat(12, axis=0)
            if place.any():  # the mesh itself is there once
                parts.append(shifted(self.body, place))
            parts.append(shifted(Lines(box_segments(building.boxes[drawn]), colours), place))
            marks.append(Mark(above + place, f"{name}: {counted(number, 'box', 'boxes')}"))
            texts.append(f"{name.lower()} step {step} of {building.last}")
            rows.append(
                Row(name, f"{counted(number, 'box', 'boxes')}, {building.tests_at[step]:.1f} tests",
                    "Boxes that are there, and the tests of a line through the root if they "
                    "were the leaves")
            )  # fmt: skip
        rows += [
            Row(f"SAH Cost, {name}", f"{building.cost:.2f}", "Of the finished tree: less is better")
            for name, building in self.buildings.items()
        ]
        caption = f"{settings.percent}% of the building: {'; '.join(texts)}"
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the beginning, and some way through."""
        return [Settings(percent) for percent in (0, 2, 50, 99)]

    def film(self, lesson: Lesson) -> Sequence[int]:
        """Return all percents."""
        return range(101)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the logs of the three."""
    return Construction(subject, progress)


def keeps_a_log(structure: Any) -> str:
    """Accept hierarchies that say how they were built, see :attr:`.lesson.Lesson.suits`."""
    if reason := is_tree(structure) or has_log(structure):
        return reason
    done = structure.rearrangement
    if done is not None and done.made and structure.figures["optimise_pays"]:
        return "its tree was rearranged after it was built"
    return ""


LESSONS = (
    Lesson(
        name="construction",
        label="Ways to Build a Hierarchy",
        slide="BVH construction ideas",
        begin="A tree can be built from the root down, from single triangles up, or from an "
        "order along a curve",
        look_for="From above, large boxes are divided first and the last steps are all alike; from "
        "below, the last merger of all decides about the root; codes divide every level at once",
        question="Bottom-up looks at pairs of clusters and so at the triangles themselves. Why is "
        "its tree not always the better one?",
        answer="It is greedy, too: each merger is the best of its moment. The upper levels, which "
        "almost every ray visits, are left with what the lower ones did not want",
        source="structures.bvh.builders",
        sample="suzanne:subdivisions=0",
        structures=tuple(BUILDERS.values()),
        suits=keeps_a_log,
        Settings=Settings,
        play=play,
        film="percent",
    ),
)
