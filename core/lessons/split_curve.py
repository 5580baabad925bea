"""Exhibit "cost curve": what every candidate of a split would have cost, and which was taken.

Three charts stand to the right of the model, for planes across x, y and z from top to bottom; each
runs along its axis from one side of the node to the other. Blue: the candidates of the builder, as
steps. Green: the line of the full sweep, which cuts between any two centroids. Grey: the cost of
testing all triangles. Red: the plane that was taken, in its chart and in the model, as the build
log has it; of the candidates that were not taken nobody keeps a log (:mod:`..sah.split_curve`).
"""

from __future__ import annotations

import numpy as np

from ..contract.build_log import BuildLog
from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..progress import SILENT, Progress
from ..sah.split_curve import SplitCurve, has_curves, split_curve
from ..structures.bvh.hierarchy import BVH
from .drawing import BLUE, GREEN, GREY, RED, Chart, Lines, coloured, frame_of, outlines
from .exhibit import Exhibit, Frame

MOST_NODES = 15
"""Nodes that have a frame: the root and those nearest to it."""

MOST_POINTS = 1500
"""Points of a curve that are drawn."""

WIDTH, HEIGHT, GAP = 0.9, 0.28, 0.08
"""Size of a chart and the distance to the next, as shares of the longest side of the scene."""


def cost_curve(bvh: BVH, log: BuildLog) -> list[Exhibit]:
    """Return the exhibit, if the builder chose among candidates by cost."""
    if not has_curves(bvh):
        return []
    inner = np.flatnonzero(bvh.arrays.size == 0)
    nearest = inner[np.argsort(bvh.depths()[inner], kind="stable")][:MOST_NODES]
    nodes = nearest.tolist() or [0]  # of one leaf, why it is one

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        return frame_of_node(bvh, log, nodes[number], progress)

    return [
        Exhibit(
            "cost_curve",
            "Cost Curve",
            "Cost of all candidates of a split, by their position; the one that was taken",
            len(nodes),
            frame,
        )
    ]


def frame_of_node(bvh: BVH, log: BuildLog, node: int, progress: Progress) -> Frame:
    """Return the picture of the candidates of a node, and of the one that was taken."""
    event = log.split_of(node)
    taken = event if event is not None and log.axis[event] >= 0 else None
    curve = split_curve(bvh, node, progress=progress)
    sweep = split_curve(bvh, node, "sweep_sah", progress)
    top = float(np.concatenate([curve.cost, sweep.cost]).max(initial=curve.leaf_cost))
    parts = [coloured(box_segments(curve.box[None]), GREY)]
    for axis in range(3):
        progress.report(axis, 3, "Drawing the curve")
        chart = chart_of(bvh, curve, axis, top)
        parts += [chart.axes(), chart.level(curve.leaf_cost, GREY)]
        parts.append(line_through(chart, sweep, axis))
        if bvh.settings.builder != "sweep_sah":
            parts.append(steps_through(chart, curve, axis))
        if taken is not None and axis == log.axis[taken] and np.isfinite(log.cost[taken]):
            parts.append(chart.mark(log.position[taken], log.cost[taken], RED))
    if taken is not None:
        position = log.position[taken : taken + 1]
        cut = planes_across(curve.box[None], int(log.axis[taken]), position)
        parts.append(coloured(np.concatenate([outlines(cut), cut[0, [[0, 2], [1, 3]]]]), RED))
    return frame_of(parts, caption_of(bvh, log, node, curve, sweep))


def caption_of(bvh: BVH, log: BuildLog, node: int, curve: SplitCurve, sweep: SplitCurve) -> str:
    """Return the figures of the split in words."""
    settings, event = bvh.settings, log.split_of(node)
    constants = f"(C_trav {settings.C_trav:g}, C_isect {settings.C_isect:g})"
    text = f"Node {node}: no split {curve.leaf_cost:.2f} {constants}; "
    if curve.best < 0:
        return f"{text}no plane tells its triangles apart"
    text += f"{len(curve.cost)} candidates, "
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
        text += f"; of all {len(sweep.cost)} cuts {sweep.cost[sweep.best]:.2f}"
    return text


def chart_of(bvh: BVH, curve: SplitCurve, axis: int, top: float) -> Chart:
    """Return the chart for planes across an axis."""
    low, high = bvh.scene.lower, bvh.scene.upper
    size = float((high - low).max())
    place = 2 - axis  # from below
    stack = 3 * HEIGHT + 2 * GAP
    origin = np.array([high[0] + 0.2 * size, 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])])
    origin[2] += size * (place * (HEIGHT + GAP) - 0.5 * stack)
    across, upwards = np.array([WIDTH * size, 0, 0]), np.array([0, 0, HEIGHT * size])
    return Chart(origin, across, upwards, curve.box[axis], curve.box[3 + axis], top)


def line_through(chart: Chart, curve: SplitCurve, axis: int) -> Lines:
    """Return the line through the candidates of an axis."""
    on_axis = np.flatnonzero(curve.axis == axis)
    drawn = np.unique(np.linspace(0, len(on_axis) - 1, MOST_POINTS).astype(np.int64))
    chosen = on_axis[drawn] if len(on_axis) else on_axis
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
