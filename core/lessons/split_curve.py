"""Lesson "cost_curve": what every candidate of a split would have cost, and which was taken.

Three charts stand to the right of the model, for planes across x, y and z from top to bottom; each
runs along its axis from one side of the node to the other. Blue: the candidates of the builder, as
steps. Green: the line of the full sweep, which cuts between any two centroids. Grey: the cost of
testing all triangles. Red: the plane that was taken, in its chart and in the model, as the build
log has it; of the candidates that were not taken nobody keeps a log (:mod:`..sah.split_curve`).

Lecture, slide "Top-down SAH construction": the plane of minimum expected cost has to be found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.build_log import BuildLog
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..sah.split_curve import SplitCurve, split_curve
from ..scene import Scene
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    RED,
    Chart,
    Faces,
    Lines,
    coloured,
    counted,
    cut_across,
    extent_of,
    picture_of,
    some_of,
)
from .hierarchy import tree_and_log
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .splits import was_split_by_cost

MOST_NODES = 15
"""Nodes that are shown: the root and those nearest to it."""

MOST_POINTS = 1500
"""Points of a curve that are drawn."""

WIDTH, HEIGHT, GAP = 0.9, 0.28, 0.12
"""Size of a chart and the distance to the next, as shares of the longest side of the scene."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    node: int = setting(0, "Node", "Which node, level by level; the root is 0", minimum=0)


class Considered(NamedTuple):
    """A node with all that was considered.

    Attributes
    ----------
    node : int
    curve : SplitCurve
        The builder's candidates.
    sweep : SplitCurve
        Those of a full sweep.
    event : int or None
        Of the log, if it was split.
    """

    node: int
    curve: SplitCurve
    sweep: SplitCurve
    event: int | None


class CostCurve(Play):
    """The curves of cost of the upper nodes of one tree."""

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.bvh, self.log, self.scene = bvh, log, bvh.scene
        self.nodes = [
            Considered(
                node,
                split_curve(bvh, node, progress=progress),
                split_curve(bvh, node, "sweep_sah", progress),
                log.split_of(node),
            )
            for node in nodes_of(bvh)
        ]
        self.ends = {"node": len(self.nodes) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of the candidates of a node, and of the one that was taken."""
        this, log = self.nodes[settings.node], self.log
        curve, event = this.curve, this.event
        taken = event if event is not None and log.axis[event] >= 0 else None
        top = float(np.concatenate([curve.cost, this.sweep.cost]).max(initial=curve.leaf_cost))
        parts: list[Lines | Faces] = [coloured(box_segments(curve.box[None]), GREY)]
        marks = []
        for axis in range(3):
            chart = chart_of(self.scene, curve.box, axis, top)
            parts += [chart.axes(), chart.level(curve.leaf_cost, GREY)]
            parts.append(line_through(chart, this.sweep, axis))
            if self.bvh.settings.builder != "sweep_sah":
                parts.append(steps_through(chart, curve, axis))
            marks.append(Mark(chart.at(-0.09, 0.5), "xyz"[axis]))
            if axis == 0:
                height = curve.leaf_cost / top if top > 0.0 else 0.0
                marks.append(Mark(chart.at(0.8, height + 0.25), f"no split: {curve.leaf_cost:.6g}"))
            if taken is not None and axis == log.axis[taken] and np.isfinite(log.cost[taken]):
                cost = float(log.cost[taken])
                parts.append(chart.mark(float(log.position[taken]), cost, RED))
                below = chart.place(float(log.position[taken]), 0.0) - 0.05 * chart.upwards
                marks.append(Mark(below, f"Cost = {cost:.2f}", RED[:3]))
        if taken is not None:
            parts += cut_across(curve.box, int(log.axis[taken]), float(log.position[taken]))
        return picture_of(parts, self._caption(this), marks=marks, rows=self._rows(this))

    def _caption(self, this: Considered) -> str:
        """Return the figures of the split in words."""
        settings, log, curve, event = self.bvh.settings, self.log, this.curve, this.event
        constants = f"(C_trav {settings.C_trav:g}, C_isect {settings.C_isect:g})"
        text = f"Node {this.node}: no split {curve.leaf_cost:.2f} {constants}; "
        if curve.best < 0:
            return f"{text}no plane tells its triangles apart"
        text += f"{counted(len(curve.cost), 'candidate', 'candidates')}, "
        if event is None:
            return f"{text}the best costs {curve.cost[curve.best]:.2f}: a leaf"
        n_left, n_right = log.counts[event]
        if log.axis[event] < 0:
            return f"{text}none of them divides it: split by index into {n_left} and {n_right}"
        text += (
            f"taken {'xyz'[log.axis[event]]} = {log.position[event]:.5g}: "
            f"N_L = {n_left}, N_R = {n_right}"
        )
        if np.isfinite(log.cost[event]):
            text += f", Cost = {log.cost[event]:.2f}"
        if settings.builder != "sweep_sah":
            text += f"; of all {len(this.sweep.cost)} cuts {this.sweep.cost[this.sweep.best]:.2f}"
        return text

    def _rows(self, this: Considered) -> list[Row]:
        """Return the cheapest candidate across every axis, and what there is besides."""
        rows = [Row("Candidates", str(len(this.curve.cost)), "Planes that the builder compared")]
        for axis in range(3):
            costs = this.curve.cost[this.curve.axis == axis]
            text = f"{costs.min():.2f}" if len(costs) else "none"
            meaning = "Cost of the cheapest plane across this axis"
            rows.append(Row(f"Cheapest across {'xyz'[axis]}", text, meaning))
        best = f"{this.sweep.cost[this.sweep.best]:.2f}" if this.sweep.best >= 0 else "none"
        rows.append(Row("Cheapest of All Cuts", best, "Between any two centroids: the full sweep"))
        rows.append(Row("No Split", f"{this.curve.leaf_cost:.2f}", "C_isect N"))
        return rows


def nodes_of(bvh: BVH) -> list[int]:
    """Return the inner nodes nearest to the root; of one leaf, that: why it is one."""
    inner = np.flatnonzero(bvh.arrays.size == 0)
    nearest = inner[np.argsort(bvh.depths()[inner], kind="stable")][:MOST_NODES]
    return nearest.tolist() or [0]


def chart_of(scene: Scene, box: np.ndarray, axis: int, top: float) -> Chart:
    """Return the chart for planes across an axis of a box."""
    low, high, size = scene.lower, scene.upper, extent_of(scene)
    place = 2 - axis  # from below
    stack = 3 * HEIGHT + 2 * GAP
    origin = np.array([high[0] + 0.25 * size, 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])])
    origin[2] += size * (place * (HEIGHT + GAP) - 0.5 * stack)
    across, upwards = np.array([WIDTH * size, 0, 0]), np.array([0, 0, HEIGHT * size])
    return Chart(origin, across, upwards, box[axis], box[3 + axis], top)


def line_through(chart: Chart, curve: SplitCurve, axis: int) -> Lines:
    """Return the line through the candidates of an axis."""
    chosen = some_of(np.flatnonzero(curve.axis == axis), MOST_POINTS)
    return chart.curve(curve.position[chosen], curve.cost[chosen], GREEN)


def steps_through(chart: Chart, curve: SplitCurve, axis: int) -> Lines:
    """Return the candidates of an axis as steps, each halfway to its neighbours."""
    on_axis = np.flatnonzero(curve.axis == axis)
    on_axis = on_axis[np.argsort(curve.position[on_axis], kind="stable")]
    position = curve.position[on_axis]
    between = 0.5 * (position[:-1] + position[1:])
    ends = np.concatenate([curve.box[axis : axis + 1], between, curve.box[3 + axis : 4 + axis]])
    x = np.stack([ends[:-1], ends[1:]], axis=1).ravel() if len(on_axis) else position
    return chart.curve(x, np.repeat(curve.cost[on_axis], 2), BLUE)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Ask the builder for all its candidates once more."""
    bvh, log = tree_and_log(subject, progress)
    return CostCurve(bvh, log, progress)


LESSONS = (
    Lesson(
        name="cost_curve",
        label="The Curve of Cost",
        slide="Top-down SAH construction",
        begin="At every node the builder compares planes across x, y and z and takes the cheapest",
        look_for="A few planes at even distances come close to the lowest point of the whole "
        "curve; the curve is steep at its ends and flat around its lowest point",
        question="Why are 15 candidates per axis enough, when the full curve of a large node has "
        "thousands?",
        answer="Around its lowest point the curve is flat, so that a plane somewhat beside it "
        "costs hardly more. Comparing all cuts takes longer, and of most meshes the whole tree "
        "gains less than three hundredths by it: the choice is greedy",
        source="structures.bvh.builders.top_down.binned_sah",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=binned_sah",),
        suits=was_split_by_cost,
        Settings=Settings,
        play=play,
        film="node",
    ),
)
