"""Lesson "reordering": triangles of a node are reordered by a parallel sum.

Every triangle of the node gets a flag, 1 if it goes left. A parallel sum over the flags, in steps
that add what is 1, 2, 4, ... places before, says how many go left up to each place: that is where a
triangle that goes left belongs, and the last sum is the size of the left child. The others follow
behind, in the order in which they were.

Row by row below the model: the triangles in order, the sums, the triangles reordered. Blue: flag 1,
goes left. Orange: flag 0, goes right. The node is shown once more enlarged beside the model. The
plane is that of the build log, and its triangles are divided by the builder's own kernel once more.
Lecture, slide "Data-Parallel SAH split", 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.build_log import SPLIT
from ..errors import InputError
from ..geometry.instances import lines_of_items
from ..kernels import call
from ..progress import Progress
from ..sah.split_curve import look_at_candidates, look_at_division
from ..settings import setting
from ..structures.bvh.builders.top_down.parallel_split import data_parallel_rules
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import Primitives, ranges_of
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    Faces,
    Lines,
    chart_below,
    coloured,
    cut_across,
    faint,
    picture_of,
)
from .hierarchy import tree_of
from .lesson import Lesson, Play, Subject
from .magnifier import enlarged_beside
from .moves import around
from .picture import Picture, Row
from .queues import is_data_parallel
from .scattering import (
    SUMS,
    TOP,
    drawn_items,
    drawn_result,
    drawn_sums,
    names_of_rows,
)
from .splits import box_around

MOST_TRIANGLES = 16
"""Triangles of a node that is shown; a real block has some hundreds."""

MOST_NODES = 12
"""Nodes that are shown, those with the most triangles."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    step: int = setting(9, "Step", "Flags, steps of the sum, reordering", minimum=0)
    node: int = setting(0, "Node", "Which node, the largest first", minimum=0)


class Division(NamedTuple):
    """A node that was divided.

    Attributes
    ----------
    node : int
    axis : int
    position : float
    box : (6,) float64
    ids : (n,) int
        Its triangles in order.
    flags : (n,) int
        1 for those that go left.
    sums : list of (n,) int
        The flags, and the sums after each step.
    scan : (n,) int
        How many go left before each, as the builder has it.
    places : (n,) int
        Where every triangle goes.
    """

    node: int
    axis: int
    position: float
    box: np.ndarray
    ids: np.ndarray
    flags: np.ndarray
    sums: list[np.ndarray]
    scan: np.ndarray
    places: np.ndarray


def division_of(bvh: BVH, node: int, ids: np.ndarray) -> Division:
    """Divide the triangles of a node once more, by the builder's own kernels.

    Parameters
    ----------
    ids : (n,) int
        Its triangles, ascending, as the builder had them.
    """
    log, boxes = bvh.build_log, bvh.scene.boxes()[ids]
    assert log is not None
    event = log.split_of(node)
    axis, position = int(log.axis[event]), float(log.position[event])
    primitives = Primitives(bvh.scene.items(ids), boxes.copy())
    make_rule, order = data_parallel_rules(primitives, bvh.settings)
    rule = make_rule()
    call(look_at_candidates, rule, len(ids), int(bvh.depths()[node]))
    last = int(rule.lasts[rule.winners[0]])
    n_left = int(call(look_at_division, rule, len(ids), axis, last, position))
    places = np.empty(len(ids), np.int64)
    places[order] = np.arange(len(ids))
    flags = (places < n_left).astype(np.int64)
    return Division(
        node, axis, position, box_around(boxes), ids, flags, parallel_sum(flags),
        rule.scan[: len(ids)].copy(), places,
    )  # fmt: skip


def parallel_sum(values: np.ndarray) -> list[np.ndarray]:
    """Return values, (n,), and their sums after each step of the parallel sum.

    In step j every place adds what is 2^j before it; after the last, each has the sum up to it.
    W. D. Hillis, G. L. Steele: Data Parallel Algorithms, 1986.
    """
    found, stride = [values], 1
    while stride < len(values):
        now = found[-1].copy()
        now[stride:] += found[-1][:-stride]
        found.append(now)
        stride *= 2
    return found


class Reordering(Play):
    """Some nodes whose triangles were reordered."""

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.scene = bvh.scene
        self.divisions = [division_of(bvh, node, ids) for node, ids in small_nodes(bvh, progress)]
        if not self.divisions:
            raise InputError(
                f"no node of 2 to {MOST_TRIANGLES} triangles was divided by a plane; choose a mesh "
                "of more triangles, or smaller leaves"
            )
        steps = max(len(division.sums) for division in self.divisions)
        self.ends = {"node": len(self.divisions) - 1, "step": steps}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of a node after some steps."""
        this = self.divisions[settings.node]
        step = min(settings.step, len(this.sums))
        is_moved, sums = step == len(this.sums), this.sums[min(step, len(this.sums) - 1)]
        count, is_left = len(this.ids), this.flags == 1
        chart = chart_below(self.scene, count, TOP, height=0.95)
        bars, numbers = drawn_sums(chart, sums, is_left)
        parts = [*drawn_items(chart, is_left), *bars]
        names = ["triangles", "sum of flags" if step else "flags"]
        if is_moved:
            parts += drawn_result(chart, this.places, is_left)
            names.append("reordered")
        elif step > 0:
            x, stride = np.arange(count) + 0.5, 1 << (step - 1)
            floor = np.full(count - stride, SUMS)
            ends = chart.points(x[:-stride], floor + 1.15), chart.points(x[stride:], floor)
            parts.append(coloured(np.stack(ends, axis=1), faint(GREY, 0.7)))
        marks = [*numbers, *names_of_rows(chart, count, *names)]
        parts += self._in_the_model(this, is_left)
        return picture_of(parts, self._caption(this, step), marks=marks, rows=self._rows(this))

    def _in_the_model(self, this: Division, is_left: np.ndarray) -> list[Lines | Faces]:
        """Return the node in the model, and enlarged beside it."""
        lines = [
            coloured(lines_of_items(self.scene.geometry, this.ids[side]), colour)
            for side, colour in ((is_left, BLUE), (~is_left, ORANGE))
        ]
        box, plane = around(this.box, GREY), cut_across(this.box, this.axis, this.position)[0]
        own = [box, *lines, plane]
        return [*own, *enlarged_beside(own, this.box, self.scene)]

    def _caption(self, this: Division, step: int) -> str:
        """Return what the step did, in words."""
        count, n_left = len(this.ids), int(this.flags.sum())
        text = (
            f"Node {this.node}, {count} triangles, plane {'xyz'[this.axis]} = {this.position:.4g}: "
        )
        last = len(this.sums) - 1
        if step == 0:
            return f"{text}flag 1 (blue) for what goes left, 0 (orange) for what goes right"
        if step <= last:
            before = 1 << (step - 1)
            return f"{text}step {step} of {last}, every place adds what is {before} before it"
        return (
            f"{text}the last sum is N_L = {n_left}; triangles that go left take the place of their "
            "sum, the others follow in order"
        )

    def _rows(self, this: Division) -> list[Row]:
        """Return the figures of the node."""
        n_left = int(this.flags.sum())
        return [
            Row("N", str(len(this.ids)), "Triangles of the node"),
            Row("N_L", str(n_left), "The last sum: the size of the left child"),
            Row("N_R", str(len(this.ids) - n_left), "The size of the right child"),
            Row("Steps", str(len(this.sums) - 1), "log2 N, rounded up"),
        ]


def small_nodes(bvh: BVH, progress: Progress) -> list[tuple[int, np.ndarray]]:
    """Return the largest nodes that can be shown, and their triangles, ascending.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    log = bvh.build_log
    assert log is not None
    progress.report(0, 1, "Looking for small nodes")
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    nodes = log.cells[log.node[(log.kind == SPLIT) & (log.axis >= 0)]]
    counts = (end - begin)[nodes]
    nodes, counts = nodes[counts <= MOST_TRIANGLES], counts[counts <= MOST_TRIANGLES]
    largest = nodes[np.argsort(-counts, kind="stable")][:MOST_NODES]
    return [(node, np.sort(bvh.geometry.ids[begin[node] : end[node]])) for node in largest.tolist()]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Divide some small nodes once more."""
    return Reordering(tree_of(subject), progress)


LESSONS = (
    Lesson(
        name="reordering",
        label="Reordering by a Parallel Sum",
        slide="Data-Parallel SAH split",
        begin="Triangles are sorted into two children by flags, of which a parallel sum is made",
        look_for="After each step every place knows the sum of twice as many flags; the last one "
        "is the size of the left child, and each triangle finds its place without asking another",
        question="Why is no triangle moved before the sum is complete, when its flag is known?",
        answer="Its place depends on how many before it go the same way, and in parallel nobody "
        "has counted those. The sum tells all places at once, so that all can be written in "
        "parallel without two threads meeting",
        source="structures.bvh.builders.top_down.parallel_split",
        sample="suzanne:subdivisions=0",
        structures=("bvh:builder=parallel_sah",),
        suits=is_data_parallel,
        Settings=Settings,
        play=play,
        film="step",
    ),
)
