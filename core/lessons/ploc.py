"""Lesson "ploc": clusters merge with their nearest neighbours along the Morton curve.

The clusters after every iteration, coloured along the curve; bright are those that have merged just
now. To the right of the model how many are left, on a logarithmic scale. Mergers and boxes are
those of the build log. D. Meister, J. Bittner: Parallel Locally-Ordered Clustering for Bounding
Volume Hierarchy Construction, TVCG 2018.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..colours import ramp
from ..contract.build_log import MERGE, BuildLog
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.build_log import tree_as_built
from .drawing import BLUE, ORANGE, Chart, Lines, counted, picture_of
from .hierarchy import has_log, is_tree, tree_and_log
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

FAINT = 0.3
"""Opacity of clusters that have not merged in this iteration."""

MOST_CLUSTERS = 400
"""Clusters that are drawn, evenly along the curve."""

TELLING = 1000, 100, 20, 5
"""A page shows where there are that many clusters for the first time."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    iteration: int = setting(
        8, "Iteration", "Iterations that are done; 0 has the triangles themselves", minimum=0
    )


class Snapshot(NamedTuple):
    """Some of the clusters after an iteration.

    Attributes
    ----------
    boxes : (k, 6) float64
    places : (k,) float64
        Where on the curve each begins, as a share of it.
    is_new : (k,) bool
        Whether it has been merged in this iteration.
    total : int
        Number of all clusters.
    """

    boxes: np.ndarray
    places: np.ndarray
    is_new: np.ndarray
    total: int


def take_snapshots(bvh: BVH, log: BuildLog, progress: Progress) -> list[Snapshot]:
    """Return what one picture can show of every iteration; the log has the mergers of each.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    text = "Reading the mergers"
    progress.report(0, 1, text)
    n, boxes = len(bvh.scene), tree_as_built(log, bvh.reference_boxes()).boxes
    merges = np.flatnonzero(log.kind == MERGE)
    made, children, step = log.node[merges], log.children[merges], log.step[merges]
    # Names begin with those of the triangles, along the curve. A cluster is known by the place of
    # its first triangle: that is in the left one of the two that it was merged of.
    begins, now = np.arange(len(log.cells)), np.arange(n)  # now: the cluster that begins there
    is_new = np.ones(len(log.cells), bool)

    def snapshot() -> Snapshot:
        nodes = now[now >= 0]
        some = nodes[:: -(-len(nodes) // MOST_CLUSTERS)]
        return Snapshot(boxes[some], begins[some] / n, is_new[some], len(nodes))

    shots, last = [snapshot()], int(step[-1]) if len(step) else 0
    for iteration in range(1, last + 1):
        progress.report(iteration - 1, last, text)
        these = slice(*np.searchsorted(step, [iteration, iteration + 1]))
        left, right = children[these].T
        begins[made[these]] = begins[left]
        now[begins[right]] = -1
        now[begins[left]] = made[these]
        is_new[:] = False
        is_new[made[these]] = True
        shots.append(snapshot())
    return shots


class Clusters(Play):
    """The clusters of one tree after every iteration."""

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.scene, self.shots = bvh.scene, take_snapshots(bvh, log, progress)
        self.ends = {"iteration": len(self.shots) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the clusters after some iterations."""
        number, last = settings.iteration, self.ends["iteration"]
        shot = self.shots[number]
        opacity = np.where(shot.is_new, 1.0, FAINT)
        colours = np.concatenate([ramp(shot.places), opacity[:, None]], axis=1)
        lines = Lines(box_segments(shot.boxes), np.repeat(colours, 12, axis=0))
        totals = np.log10([each.total for each in self.shots])
        chart = Chart.beside(self.scene, 0.0, float(last), float(totals[0]))
        iterations = np.arange(len(totals))
        parts = [
            lines, chart.axes(), chart.curve(iterations, totals, BLUE),
            chart.mark(number, float(totals[number]), ORANGE),
        ]  # fmt: skip
        text = counted(shot.total, "cluster", "clusters")
        marks = [
            *chart.named("iterations", "clusters left (logarithmic)"),
            Mark(chart.at(0.5, 0.9), text, ORANGE[:3]),
        ]
        if number == 0:
            merged = 0
            caption = f"{counted(shot.total, 'triangle', 'triangles')}, each a cluster"
        else:
            merged = self.shots[number - 1].total - shot.total
            caption = (
                f"Iteration {number} of {last}: {counted(merged, 'merger leaves', 'mergers leave')}"
                f" {text}; bright: merged just now"
            )
        if len(shot.boxes) < shot.total:
            caption += f"; drawn: {len(shot.boxes)} of them, evenly along the curve"
        rows = [
            Row("Clusters", str(shot.total), "Left after this iteration"),
            Row("Mergers", str(merged), "Pairs that found each other in this iteration"),
            Row("Iterations", str(last), "Until one cluster is left, the root"),
        ]
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return where there are few enough clusters to tell them apart."""
        totals = [shot.total for shot in self.shots]
        return [Settings(number) for number in telling(totals)]


def telling(totals: list[int]) -> list[int]:
    """Return the iterations of a page."""
    return list(dict.fromkeys(sum(n > most for n in totals) for most in TELLING))


def was_clustered(structure: Any) -> str:
    """Accept trees that PLOC has built, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if structure.settings.builder != "ploc" or structure.is_refitted:
        return "it was not built by ploc, or its triangles have moved since"
    return has_log(structure)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the mergers of every iteration."""
    bvh, log = tree_and_log(subject, progress)
    return Clusters(bvh, log, progress)


LESSONS = (
    Lesson(
        name="ploc",
        label="Clusters That Merge (PLOC)",
        slide="Contemporary methods",
        begin="From the bottom up, all clusters that are each other's nearest merge at once",
        look_for="Neighbours are looked for in a small window along the Morton curve only; most "
        "iterations leave about four fifths of the clusters, since few pairs are each other's "
        "nearest at once",
        question="Why must both clusters of a pair be the nearest to each other, and is there "
        "always such a pair?",
        answer="So that no cluster is wanted by two others at once, and threads need not agree. "
        "The pair with the smallest distance of all is always such a pair, so each iteration "
        "merges at least one",
        source="structures.bvh.builders.bottom_up.ploc",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=ploc",),
        suits=was_clustered,
        Settings=Settings,
        play=play,
        film="iteration",
    ),
)
