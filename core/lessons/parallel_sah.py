"""Lesson "data_parallel_split": how the cheapest of all candidates is found by binary reduction.

The candidates of the root stand as bars as high as their costs, and above them the places that they
are compared in. Each step compares pairs of places, and the cheaper candidate goes on (blue); in
the model are the planes still in the game. Red: the plane that was taken, as the build log has it.

The log has the one that was taken only; the builder's own rule evaluates the candidates of the root
once more, over the same triangles, and its own kernel reduces them. Lecture, slide "Data-Parallel
SAH split", 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.build_log import BuildLog
from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..kernels import call
from ..progress import Progress
from ..sah.split_curve import look_at_candidates
from ..settings import setting
from ..structures.bvh.builders.top_down.parallel_split import data_parallel_rules, reduction_step
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import Primitives
from .drawing import (
    BLUE,
    GREY,
    Chart,
    Faces,
    Lines,
    coloured,
    counted,
    cut_across,
    extent_of,
    faint,
    outlines,
    picture_of,
)
from .hierarchy import tree_and_log
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .queues import is_data_parallel


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    step: int = setting(0, "Step", "Steps of the reduction that are done", minimum=0)


class Reduction(Play):
    """The reduction of the root's candidates.

    Attributes
    ----------
    planes, costs : (3 k,) float64
        Of the candidates, k of each axis; a cost is SA(L) N_L + SA(R) N_R.
    left : list of int arrays
        The candidates that are left at the start and after each step.
    taken : (int, float) or None
        Axis and position of the plane by which the root was split, if it was.
    """

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.scene, settings = bvh.scene, bvh.settings
        event = log.split_of(0)
        self.taken = None
        if event is not None and log.axis[event] >= 0:
            self.taken = int(log.axis[event]), float(log.position[event])
        n_candidates = 3 * settings.bins
        text = "Looking at all candidates"
        progress.report(0, 2, text)
        primitives = Primitives(self.scene.geometry, self.scene.boxes())
        make_rule, order = data_parallel_rules(primitives, settings)
        rule = make_rule()
        rule.planes.fill(np.nan)  # of one triangle there are no candidates
        rule.costs.fill(np.inf)
        progress.report(1, 2, text)
        call(look_at_candidates, rule, len(order), 0)
        progress.report(2, 2, text)
        winners, stride = np.arange(n_candidates), 1
        self.left = [np.arange(n_candidates)]
        while stride < n_candidates:
            call(reduction_step, rule.costs, winners, stride)
            stride *= 2
            self.left.append(winners[::stride].copy())
        self.planes, self.costs = 0.5 * rule.planes, rule.costs
        self.ends = {"step": len(self.left) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after some steps."""
        left, planes, costs = self.left[: settings.step + 1], self.planes, self.costs
        low, high = self.scene.lower, self.scene.upper
        box = np.concatenate([low, high])
        size, k = extent_of(self.scene), len(planes) // 3
        finite = np.isfinite(costs)
        winners = left[-1][finite[left[-1]]]

        # Bars, above them the rounds of the tournament.
        origin = np.array([high[0] + 0.2 * size, 0.5 * (low[1] + high[1]), low[2]])
        across, upwards = np.array([1.4 * size, 0, 0]), np.array([0, 0, 0.5 * size])
        top = float(costs[finite].max(initial=0.0)) or 1.0
        chart = Chart(origin, across, upwards, -0.5, len(planes) - 0.5, top)
        number = np.arange(len(planes))
        heights = np.where(finite, costs, 0.0)
        feet = chart.points(number, np.zeros(len(planes)))
        bars = np.stack([feet, chart.points(number, heights)], axis=1)
        parts: list[Lines | Faces] = [
            chart.axes(),
            coloured(bars[finite], GREY),
            coloured(bars[winners], BLUE),
        ]
        parts += self._rounds(chart, left, top)
        marks = [
            Mark(chart.place(axis * k + 0.4 * k, -0.12 * top), f"across {'xyz'[axis]}")
            for axis in range(3)
        ]
        if len(left[-1]) == 1 and self.taken:
            parts += cut_across(box, *self.taken)
        else:
            opacity = 1.0 if len(winners) <= 12 else 0.4
            for winner in winners.tolist():
                cut = planes_across(box[None], winner // k, planes[winner : winner + 1])
                parts.append(coloured(outlines(cut), faint(BLUE, opacity)))
        parts.append(coloured(box_segments(box[None]), GREY))
        rows = [
            Row("3 k", str(len(planes)), "Candidates, k of each axis, a thread for each"),
            Row("Steps", f"{settings.step} of {len(self.left) - 1}", "log2 of that, rounded up"),
            Row("Left", str(len(left[-1])), "Candidates that can still win"),
        ]
        return picture_of(parts, self._caption(left), marks=marks, rows=rows)

    def _rounds(self, chart: Chart, left: list[np.ndarray], top: float) -> list[Lines]:
        """Return the lines by which candidates go on from round to round."""
        n_steps, count, parts = len(self.left) - 1, len(self.planes), []
        above = top * (1.1 + np.arange(n_steps + 1) / max(n_steps, 1))
        for step in range(1, len(left)):
            before, after = left[step - 1], left[step]
            # Every place stands in the middle above the candidates that it stands for.
            from_x = middles_of(np.arange(len(before)), 1 << (step - 1), count)
            to = np.arange(len(before)) // 2
            to_x = middles_of(to, 1 << step, count)
            levels = np.repeat(above[step - 1 : step + 1, None], len(before), axis=1)
            starts, ends = chart.points(from_x, levels[0]), chart.points(to_x, levels[1])
            rounds = np.stack([starts, ends], axis=1)
            won = before == after[to]
            parts += [coloured(rounds[~won], faint(GREY, 0.6)), coloured(rounds[won], BLUE)]
        return parts

    def _caption(self, left: list[np.ndarray]) -> str:
        """Return how many candidates are left, and the last in words."""
        step, n_left, k = len(left) - 1, len(left[-1]), len(self.planes) // 3
        text = (
            f"Step {step} of {len(self.left) - 1}: {n_left} of "
            f"{counted(len(self.planes), 'candidate', 'candidates')} left"
        )
        if n_left > 1:
            return text
        winner = int(left[-1][0])
        if not np.isfinite(self.costs[winner]):
            return f"{text}; no plane tells the triangles apart"
        if self.taken is None:
            plane = f"{'xyz'[winner // k]} = {self.planes[winner]:.5g}"
            return f"{text}: {plane}; it was not taken, since it costs no less than a leaf"
        return f"{text}: {'xyz'[self.taken[0]]} = {self.taken[1]:.5g}"


def middles_of(places: np.ndarray, width: int, count: int) -> np.ndarray:
    """Return the middles of the groups of `width` candidates, of `count`, that places stand for."""
    return 0.5 * (places * width + np.minimum((places + 1) * width, count) - 1)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Evaluate the candidates of the root once more, and reduce them."""
    bvh, log = tree_and_log(subject, progress)
    return Reduction(bvh, log, progress)


LESSONS = (
    Lesson(
        name="data_parallel_split",
        label="Data-Parallel SAH Split",
        slide="Data-Parallel SAH split",
        begin="Each thread computes the cost of a plane; a binary reduction finds the cheapest",
        look_for="Every step compares pairs at the same time and halves the number of candidates, "
        "so log2 of them steps are enough",
        question="A loop over all costs makes one comparison fewer than there are candidates. How "
        "many does the reduction make, and why is it used all the same?",
        answer="Just as many: each comparison removes one candidate. But those of a step are made "
        "at the same time, so it waits for about log2 of the candidates comparisons in a row "
        "instead of for all",
        source="structures.bvh.builders.top_down.parallel_split",
        sample="suzanne:subdivisions=0",
        structures=("bvh:builder=parallel_sah",),
        suits=is_data_parallel,
        Settings=Settings,
        play=play,
        film="step",
    ),
)
