"""Lesson "morton_intervals": every node of the tree is an interval of the sorted Morton codes.

The curve runs through the centroids in the order of their codes. Level by level, as the build log
tells of it, every node has a colour of its own, the box around it, and below the model its
intervals as brackets over the sorted codes, from the root at the top down to the level that is
shown. A node of LBVH is one interval; one of HLBVH above the treelets has several.

Lecture, slide "Morton code based BVH tree": tree node = interval of indices [l_i, r_i).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..colours import ramp
from ..contract.build_log import SPLIT, BuildLog
from ..geometry.box_shape import box_segments
from ..parallel import Team
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.builders import BUILDERS
from ..structures.bvh.builders.morton.codes import MortonSettings, sort_by_code
from ..structures.bvh.builders.morton.hlbvh import boxes_around
from ..structures.bvh.hierarchy import BVH
from .drawing import Chart, Lines, chart_below, counted, opaque, picture_of
from .hierarchy import has_log, is_tree, tree_and_log
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

MOST_LEVELS = 8
"""Levels of the tree that are shown: the last has up to 128 nodes."""

MOST_BRACKETS = 128
"""Brackets of one level."""

MOST_PIECES = 5000
"""Pieces of the curve that are drawn."""

NUMBERED = 8
"""Intervals of the level up to which each has its ends written."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    level: int = setting(2, "Level", "Level of the tree; the root has 0", minimum=0)


class Sorted(NamedTuple):
    """The triangles along the curve: their codes (n,), numbers (n,) and centroids (n, 3)."""

    codes: np.ndarray
    order: np.ndarray
    centroids: np.ndarray


def sorted_along(bvh: BVH, progress: Progress) -> Sorted:
    """Return the triangles along the curve, as the builder sorts them.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    boxes = bvh.scene.boxes()
    with Team(progress, "Sorting along the curve") as team:
        codes, order = sort_by_code(boxes, bvh.settings, team)
    boxes = boxes[order]
    return Sorted(codes, order, 0.5 * (boxes[:, :3] + boxes[:, 3:]))


class Level(NamedTuple):
    """The nodes of a level, and the leaves above it, along the curve.

    Attributes
    ----------
    sizes : (k,) int64
        Triangles of each.
    boxes : (k, 6) float64
    middles : (k,) float64
        The middle of each, as a share of all triangles in the order of the tree.
    node : (n,) int64
        The node, by its place in the above, of every triangle along the curve.
    """

    sizes: np.ndarray
    boxes: np.ndarray
    middles: np.ndarray
    node: np.ndarray


class Intervals(Play):
    """The upper levels of one tree along the curve."""

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.bvh, self.found = bvh, sorted_along(bvh, progress)
        progress.report(0, 1, "Reading the splits")
        self.levels = levels_of(bvh, log, self.found.order, levels_shown(log))
        self.ends = {"level": len(self.levels) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of a level."""
        count, upper = len(self.bvh.scene), self.levels[: settings.level + 1]
        level = upper[-1]
        drawn = curve(self.found, level.middles[level.node], MOST_PIECES)
        chart = chart_below(self.bvh.scene, count, len(self.levels))
        boxes = Lines(box_segments(level.boxes), opaque(ramp(np.repeat(level.middles, 12))))
        lines, marks = brackets(chart, upper)
        n_runs = 1 + int(np.count_nonzero(np.diff(level.node)))
        caption = (
            f"Level {settings.level} of the tree: {counted(len(level.sizes), 'node', 'nodes')}, "
            f"{counted(n_runs, 'interval', 'intervals')} of the curve; the largest node has "
            f"{counted(int(level.sizes.max()), 'triangle', 'triangles')}"
        )
        if n_runs > MOST_BRACKETS:
            caption += f"; brackets: the {MOST_BRACKETS} longest intervals"
        if len(drawn.segments) < count - 1:
            pieces = counted(len(drawn.segments), "piece", "pieces")
            caption += f"; drawn: {pieces} of the curve"
        rows = [
            Row("Nodes", str(len(level.sizes)), "Nodes of the level, and leaves above it"),
            Row("Intervals", str(n_runs), "Runs of indices that they are made of"),
            Row("Largest Node", str(int(level.sizes.max())), "Triangles of it"),
            Row("Smallest Node", str(int(level.sizes.min())), "Triangles of it"),
        ]
        return picture_of([drawn, boxes, lines], caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first levels."""
        return [Settings(level) for level in (0, 1, 2, 4) if level <= self.ends["level"]]


def levels_shown(log: BuildLog) -> int:
    """Return how many levels there are to be seen."""
    splits = log.step[log.kind == SPLIT]
    return min(MOST_LEVELS, 1 + int(splits.max(initial=0)))


def levels_of(bvh: BVH, log: BuildLog, order: np.ndarray, levels: int) -> list[Level]:
    """Return the upper levels of a tree as it was split, a level a step.

    Parameters
    ----------
    order : (n,) int
        The triangles along the curve.
    """
    # Where the triangles of every node begin, in the order that the builder gave them.
    begin = np.zeros(len(log.cells), np.int64)
    begins = [np.zeros(1, np.int64)]
    is_split = log.kind == SPLIT
    step, node = log.step[is_split], log.node[is_split]
    (left, right), n_left = log.children[is_split].T, log.counts[is_split, 0]
    for number in range(1, int(step.max(initial=0)) + 1):
        these = slice(*np.searchsorted(step, [number, number + 1]))
        begin[left[these]] = begin[node[these]]
        begin[right[these]] = begin[node[these]] + n_left[these]
        begins.append(np.sort(np.append(begins[-1], begin[right[these]])))
    ids = bvh.geometry.ids
    if log.leaves is not None:  # they have been moved since
        ids = np.empty_like(ids)
        ids[begin[log.leaves]] = bvh.geometry.ids
    place = np.empty(len(ids), np.int64)
    place[ids] = np.arange(len(ids))
    boxes, places = bvh.scene.boxes()[ids], place[order]
    found = []
    for first in begins[:levels]:
        ends = np.append(first[1:], len(ids))
        found.append(
            Level(
                ends - first,
                boxes_around(boxes, first),
                0.5 * (first + ends) / len(ids),
                np.searchsorted(first, places, side="right") - 1,
            )
        )
    return found


def curve(found: Sorted, fractions: np.ndarray, most: int) -> Lines:
    """Return the curve with the ramp's colours at some fractions, (n,), at most `most` pieces."""
    step = -(-len(fractions) // most)
    points = found.centroids[::step]
    segments = np.stack([points[:-1], points[1:]], axis=1)
    return Lines(segments, opaque(ramp(fractions[::step][:-1])))


def brackets(chart: Chart, levels: list[Level]) -> tuple[Lines, list[Mark]]:
    """Return the intervals of levels as brackets in their nodes' colours, the root's on top.

    Where those of the last one are few, their ends are written below.
    """
    segments, colours, marks = [], [], []
    for number, level in enumerate(levels):
        begins = np.flatnonzero(np.diff(level.node, prepend=-1))
        ends = np.append(begins[1:], len(level.node))
        longest = np.sort(np.argsort(begins - ends, kind="stable")[:MOST_BRACKETS])
        begins, ends = begins[longest], ends[longest]
        gap = 0.1 * (ends - begins)
        y = np.full(len(begins), chart.top - number)
        left, right = chart.points(begins + gap, y), chart.points(ends - gap, y)
        left_foot = chart.points(begins + gap, y - 0.4)
        right_foot = chart.points(ends - gap, y - 0.4)
        pieces = [(left, right), (left, left_foot), (right, right_foot)]
        segments += [np.stack(piece, axis=1) for piece in pieces]
        colours += [opaque(ramp(level.middles[level.node[begins]]))] * 3
    if len(begins) <= NUMBERED:
        low = chart.top - len(levels) + 0.3
        for place, (begin, end) in enumerate(zip(begins.tolist(), ends.tolist(), strict=True)):
            # Every second one lower, so that they do not meet.
            marks.append(Mark(chart.place(begin, low - 0.7 * (place % 2)), f"[{begin}, {end})"))
    return Lines(np.concatenate(segments), np.concatenate(colours)), marks


def sorts_by_code(structure: Any) -> str:
    """Accept trees of builders that sort along the curve, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if not issubclass(BUILDERS[structure.settings.builder].Settings, MortonSettings):
        return "its builder does not sort by Morton codes; take lbvh, hlbvh or ploc"
    return has_log(structure)


def has_intervals(structure: Any) -> str:
    """Accept trees that were divided along the curve, see :attr:`.Lesson.suits`."""
    if reason := sorts_by_code(structure):
        return reason
    if structure.settings.builder == "ploc":
        return "its nodes are clusters, not intervals of the codes; take lbvh or hlbvh"
    if structure.settings.builder == "phr":
        return "its nodes were divided by their cost, not by codes; take lbvh or hlbvh"
    return ""


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Sort along the curve, and read the splits."""
    bvh, log = tree_and_log(subject, progress)
    return Intervals(bvh, log, progress)


LESSONS = (
    Lesson(
        name="morton_intervals",
        label="Nodes Are Intervals",
        slide="Morton code based BVH tree",
        begin="Once the codes are sorted, the tree is there: a node of LBVH is an interval of "
        "indices, one of HLBVH above its treelets is several",
        look_for="A node is split where the highest bit in which its codes differ changes, so "
        "that both children are intervals again; cells of one level are disjoint, boxes overlap by "
        "what triangles stick out of them",
        question="Why can all nodes of such a tree be found in parallel, not parents first?",
        answer="Where an interval is split depends on the sorted codes alone: for each index the "
        "bits that it shares with its neighbours say to which interval it belongs. A thread needs "
        "the codes, not the result of another thread",
        source="structures.bvh.builders.morton.lbvh",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=lbvh",),
        suits=has_intervals,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
