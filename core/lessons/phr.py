"""Lesson "phr": nodes are divided between the clusters of a cut, and the cut is refined in between.

One split of the new tree. Grey are the clusters that were larger than the threshold of this depth:
their children, nodes of the auxiliary tree, have taken their place. Blue and orange are the
clusters of the refined cut to the left and to the right of the plane (red). To the right of the
model, on a logarithmic scale, the triangles (grey) and the clusters (blue) of every node that is
divided: the builder looks at the clusters alone.

Planes, counts and costs are those of the log. It has no cuts: the first splits are done again, by
the builder's own kernels over the auxiliary tree of the same triangles. J. Hendrich, D. Meister,
J. Bittner: Parallel BVH Construction using Progressive Hierarchical Refinement, CGF 2017.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.build_log import SPLIT, BuildLog
from ..contract.workspace import STACK_SIZE
from ..geometry.box_shape import box_segments, surface_area
from ..kernels import call
from ..progress import Progress
from ..settings import part_of, setting
from ..structures.bvh.builders.morton import phr
from ..structures.bvh.builders.top_down.recursion import build_subtree, room_for
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import Primitives
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    Chart,
    Colour,
    Lines,
    coloured,
    counted,
    cut_across,
    faint,
    picture_of,
    some_of,
)
from .hierarchy import has_log, is_tree, tree_and_log
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

MOST_SPLITS = 100
"""Splits that are shown, from the root on: six levels."""

MOST_CLUSTERS = 250
"""Clusters of a colour that are drawn."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    split: int = setting(2, "Split", "Which split, breadth-first; 0 divides the root", minimum=0)


class Split(NamedTuple):
    """One split.

    Attributes
    ----------
    depth, triangles : int
        Depth and triangles of the node that is divided.
    before, left, right : (k,) int
        Clusters before the cut is refined, and those of it on both sides, by their numbers in the
        auxiliary tree.
    """

    depth: int
    triangles: int
    before: np.ndarray
    left: np.ndarray
    right: np.ndarray


def first_splits(
    auxiliary: phr.Auxiliary, settings: phr.Settings, log: BuildLog, progress: Progress
) -> list[Split]:
    """Return the first splits of the log, done again.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    count = len(auxiliary.order)
    rule = phr.rule_over(auxiliary, np.empty((count, 6)), settings)
    (tree, notes), stack = room_for(count, False), np.empty((STACK_SIZE, 4), np.int64)
    sizes = auxiliary.end - auxiliary.begin

    def cut(first: int, size: int) -> np.ndarray:
        """Return the clusters of a node: as many as have so many triangles."""
        rows = rule.clusters[first : first + size]
        return rows[: 1 + int(np.searchsorted(np.cumsum(sizes[rows]), size))].copy()

    found: list[Split] = []
    where = {int(log.node[0]): (0, count, 0)} if len(log) else {}  # first, size, depth by name
    events = np.flatnonzero(log.kind == SPLIT)[:MOST_SPLITS]
    for event in events.tolist():
        progress.report(len(found), len(events), "Dividing the clusters")
        first, size, depth = where[int(log.node[event])]
        before = cut(first, size)
        call(build_subtree, rule, tree, notes, 0, first, size, depth, stack, True)
        n_left = int(log.counts[event, 0])
        left, right = cut(first, n_left), cut(first + n_left, size - n_left)
        found.append(Split(depth, size, before, left, right))
        for child, begin, n in zip(
            log.children[event].tolist(), (first, first + n_left), log.counts[event].tolist(),
            strict=True,
        ):  # fmt: skip
            where[child] = begin, n, depth + 1
    return found


class Refinement(Play):
    """The first splits of one tree.

    Attributes
    ----------
    splits : list of Split
    auxiliary : Auxiliary
    thresholds : (MAXIMUM_DEPTH,) float64
        By depth.
    """

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.scene, self.log = bvh.scene, log
        # What is a leaf is in no event; otherwise leaves have nothing to do with the splits.
        own = dataclasses.replace(part_of(bvh.settings, phr.Settings), max_leaf_size=1)
        primitives = Primitives(self.scene.geometry, self.scene.boxes())
        self.auxiliary = phr.auxiliary_tree(primitives, own, progress)
        self.surface = float(surface_area(self.auxiliary.boxes[:1])[0])
        self.thresholds = phr.thresholds_of(self.surface, own)
        self.splits = first_splits(self.auxiliary, own, log, progress)
        self.events = np.flatnonzero(log.kind == SPLIT)[: len(self.splits)]
        self.ends = {"split": max(len(self.splits) - 1, 0)}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one split."""
        boxes = self.auxiliary.boxes
        if not self.splits:
            return picture_of(
                [coloured(box_segments(boxes[:1]), BLUE)], "One leaf: nothing is divided"
            )
        split, event = self.splits[settings.split], self.events[settings.split]
        after = np.concatenate([split.left, split.right])
        opened = np.setdiff1d(split.before, after)
        axis, position = int(self.log.axis[event]), float(self.log.position[event])
        n_left, n_right = self.log.counts[event].tolist()
        around = np.concatenate([boxes[after, :3].min(axis=0), boxes[after, 3:].max(axis=0)])
        parts: list[Any] = [
            self._drawn(opened, faint(GREY, 0.6)),
            self._drawn(split.left, BLUE),
            self._drawn(split.right, ORANGE),
        ]
        if axis >= 0:
            parts += cut_across(around, axis, position)
        chart, marks = self._chart(settings.split)
        n_opened = len(after) - len(split.before)
        threshold = self.thresholds[split.depth]
        share = f"{threshold / self.surface:.2g} S" if threshold > 0.0 else "0"
        caption = (
            f"Split {settings.split}, depth {split.depth}, threshold {share}: "
            f"{counted(n_opened, 'cluster is', 'clusters are')} opened; the cut has "
            f"{counted(len(after), 'cluster', 'clusters')} in place of "
            f"{counted(split.triangles, 'triangle', 'triangles')}: {len(split.left)} go left "
            f"(blue), {len(split.right)} right (orange)"
        )
        if max(len(opened), len(split.left), len(split.right)) > MOST_CLUSTERS:
            caption += f"; drawn: {MOST_CLUSTERS} of a colour"
        cost = float(self.log.cost[event])
        rows = [
            Row("Threshold", share, "Of surface area, above which clusters are opened; S: scene's"),
            Row("Cut Before", str(len(split.before)), "Clusters that the node was given"),
            Row("Opened", str(n_opened), "Clusters that were replaced by their two children"),
            Row("Cut", str(len(after)), "Clusters that are divided"),
            Row("N_L", str(n_left), "Triangles in the clusters on the left"),
            Row("N_R", str(n_right), "Triangles in the clusters on the right"),
            Row("Cost", f"{cost:.3f}" if np.isfinite(cost) else "none", "Cost(V -> {L, R})"),
        ]
        return picture_of([*parts, *chart], caption, marks=marks, rows=rows)

    def _drawn(self, clusters: np.ndarray, colour: Colour) -> Lines:
        """Return some clusters in a colour."""
        return coloured(
            box_segments(self.auxiliary.boxes[some_of(clusters, MOST_CLUSTERS)]), colour
        )

    def _chart(self, number: int) -> tuple[list[Lines], list[Mark]]:
        """Return what nodes hold, in triangles and in clusters, split by split."""
        triangles = np.log10([split.triangles for split in self.splits])
        clusters = np.log10([len(split.left) + len(split.right) for split in self.splits])
        chart = Chart.beside(self.scene, 0.0, float(self.ends["split"]), float(triangles[0]))
        place = np.arange(len(self.splits))
        lines = [
            chart.axes(), chart.curve(place, triangles, GREY), chart.curve(place, clusters, BLUE),
            chart.mark(number, float(clusters[number]), BLUE),
        ]  # fmt: skip
        names = chart.named("split", "triangles, clusters (logarithmic)")
        split = self.splits[number]
        marks = [
            Mark(chart.at(0.45, 0.95), counted(split.triangles, "triangle", "triangles"), GREY[:3]),
            Mark(
                chart.at(0.45, 0.83),
                counted(len(split.left) + len(split.right), "cluster", "clusters"),
                BLUE[:3],
                line=1,
            ),
        ]
        return lines, [*names, *marks]

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the leftmost split of the first levels."""
        depths = [split.depth for split in self.splits]
        return [Settings(depths.index(depth)) for depth in (0, 1, 3, 5) if depth in depths] or [
            Settings(0)
        ]


def was_refined(structure: Any) -> str:
    """Accept trees that PHR has built, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if structure.settings.builder != "phr" or structure.is_refitted:
        return "it was not built by phr, or its triangles have moved since"
    return has_log(structure)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Build the auxiliary tree, and divide its clusters."""
    bvh, log = tree_and_log(subject, progress)
    return Refinement(bvh, log, progress)


LESSONS = (
    Lesson(
        name="phr",
        label="A Cut That Is Refined (PHR)",
        slide="Contemporary methods",
        begin="Nodes are divided by cost, but between clusters: nodes of a tree that was built "
        "quickly by Morton codes",
        look_for="The root is divided between a few hundred clusters, and a finer mesh has no more "
        "of them; with each level large clusters are opened, so that below, too, there are some to "
        "choose from",
        question="Why does the surface above which clusters are opened fall more slowly from level "
        "to level than the surface of nodes?",
        answer="So that cuts become shorter: most rays visit the upper nodes, where a good split "
        "pays most, and most nodes are further down, where many clusters would take most time. "
        "Where a node is no larger than the threshold, it keeps what the auxiliary tree has below",
        source="structures.bvh.builders.morton.phr",
        sample="suzanne:subdivisions=2",
        structures=("bvh:builder=phr",),
        suits=was_refined,
        Settings=Settings,
        play=play,
        film="split",
    ),
)
