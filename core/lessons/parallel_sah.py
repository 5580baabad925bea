"""Exhibits of the data-parallel builder: its work queues, and how a minimum is found by reduction.

"Split queues": three queues stand below the model. On top the input, one square for each node; in
the middle the output, two places for each node, those of leaves left empty; at the bottom what
compaction makes of it. Nodes in the queues have the colours of their boxes in the model.

"Min-reduction": the candidates of the root as bars as high as their costs, and above them the
places that they are compared in. Each step compares pairs of places, and the cheaper candidate goes
on (blue); in the model are the planes still in the game. The log has the one that was taken only;
the builder's own rule evaluates the candidates of the root once more, over the same triangles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..colours import ramp
from ..contract.build_log import BuildLog
from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..kernels import call
from ..progress import SILENT, Progress
from ..sah.split_curve import has_curves, look_at_candidates
from ..structures.bvh.builders.top_down.parallel_split import data_parallel_rules, reduction_step
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import Primitives, ranges_of
from .drawing import BLUE, GREY, RED, Chart, Lines, coloured, frame_of, outlines
from .exhibit import Exhibit, Frame, Once

EMPTY = -1
"""The node in a gap of a queue."""

MOST_SLOTS = 64
"""Places of a queue that are drawn."""

GAP_COLOUR = 0.55, 0.55, 0.60, 0.45

CORNERS = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], dtype=float)
FRAME = outlines(CORNERS[None])
"""A square in the x-z plane, and with hatching."""
HATCHING = np.array([[[s, 0, -1], [s, 0, 1]] for s in (-0.6, -0.2, 0.2, 0.6)])
SQUARE = np.concatenate([FRAME, HATCHING])


def parallel_exhibits(bvh: BVH, log: BuildLog) -> list[Exhibit]:
    """Return the exhibits, if the tree is as this builder made it."""
    if bvh.settings.builder != "parallel_sah" or not has_curves(bvh):
        return []
    return [split_queues(bvh, log), min_reduction(bvh, log)]


# -------------------------------------------------------------------------------------- queues


class Slots(NamedTuple):
    """A queue as it is drawn: its first places.

    Attributes
    ----------
    filled : (k,) bool
        Whether there is a node.
    boxes : (k, 6) float64
        Of the nodes; of gaps, anything.
    total : int
        Places of the whole queue.
    """

    filled: np.ndarray
    boxes: np.ndarray
    total: int


class DrawnLevel(NamedTuple):
    """The three queues of a level."""

    input: Slots
    output: Slots
    compacted: Slots


class Queues(NamedTuple):
    """The queues of a level: nodes, and EMPTY in gaps."""

    input: np.ndarray
    output: np.ndarray
    compacted: np.ndarray


def queues_of(log: BuildLog) -> list[Queues]:
    """Return the queues of every level: the log has a step for each, from left to right.

    The last one has nothing but leaves, and no step.
    """
    found, queue = [], np.zeros(1, np.int64)
    for step in range(1, log.last_step + 2):
        these = slice(*np.searchsorted(log.step, [step, step + 1]))
        output = np.full((len(queue), 2), EMPTY)
        output[np.isin(queue, log.node[these])] = log.children[these]
        found.append(Queues(queue, output.ravel(), output[output != EMPTY]))
        queue = found[-1].compacted
    return found


def drawn_levels(bvh: BVH, log: BuildLog, progress: Progress) -> list[DrawnLevel]:
    """Return of each level what can be drawn.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    text = "Reading the queues"
    progress.report(0, 1, text)
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    boxes = bvh.reference_boxes()

    def slots(nodes: np.ndarray, most: int) -> Slots:
        shown = nodes[:most]
        around = np.zeros((len(shown), 6))
        for i in np.flatnonzero(shown != EMPTY).tolist():
            below = boxes[begin[shown[i]] : end[shown[i]]]
            around[i, :3], around[i, 3:] = below[:, :3].min(axis=0), below[:, 3:].max(axis=0)
        return Slots(shown != EMPTY, around, len(nodes))

    levels = queues_of(log)
    drawn = []
    for done, level in enumerate(levels):
        progress.report(done, len(levels), text)
        output = slots(level.output, MOST_SLOTS)
        compacted = slots(level.compacted, int(output.filled.sum()))
        drawn.append(DrawnLevel(slots(level.input, MOST_SLOTS // 2), output, compacted))
    return drawn


def split_queues(bvh: BVH, log: BuildLog) -> Exhibit:
    """Return the work queues, two frames a level: after splitting, and after compaction."""
    levels = Once(lambda progress: drawn_levels(bvh, log, progress))

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        depth, is_compacted = divmod(number, 2)
        level = levels(progress)[depth]
        shown = level.compacted if is_compacted else level.input
        colours = rainbow(len(shown.filled))
        parts = [Lines(box_segments(shown.boxes), colours.repeat(12, axis=0))]
        parts += drawn_queues(bvh, level, bool(is_compacted))
        return frame_of(parts, caption_of_queues(bvh, depth, level, bool(is_compacted)))

    lengths, n_split = (np.array(bvh.figures[f"queue_{name}"]) for name in ("lengths", "splits"))
    half_empty = int(np.argmin(np.abs(n_split / lengths - 0.5)))
    return Exhibit(
        "split_queues",
        "Split Queues",
        "Nodes of a level, the children they write with gaps for leaves, and compaction",
        2 * len(lengths),
        frame,
        on_page=(2 * half_empty, 2 * half_empty + 1),
    )


def caption_of_queues(bvh: BVH, depth: int, level: DrawnLevel, is_compacted: bool) -> str:
    """Return the lengths of the queues, and how full the output is."""
    m, n_children = level.input.total, level.compacted.total
    share = f"{100 * n_children / (2 * m):.0f}% occupied"
    text = f"Level {depth} of {len(bvh.figures['queue_lengths']) - 1}: "
    if is_compacted:
        text += f"compaction closes the gaps, {2 * m} places become {n_children}"
    else:
        text += f"{m} in the input queue, {n_children} of {2 * m} places of the output, {share}"
    if m > len(level.input.filled):
        text += f"; drawn: what the first {len(level.input.filled)} nodes are and write"
    return text


def rainbow(count: int) -> np.ndarray:
    """Return a colour for each place of a queue, (count, 4)."""
    colours = np.ones((count, 4))
    colours[:, :3] = ramp(np.arange(count) / max(count - 1, 1))
    return colours


def drawn_queues(bvh: BVH, level: DrawnLevel, is_compacted: bool) -> list[Lines]:
    """Return the queues as rows of squares below the model, and lines from row to row."""
    low, high = bvh.scene.lower, bvh.scene.upper
    size = float((high - low).max())
    n_slots = len(level.output.filled)
    width = min(1.8 * size / n_slots, 0.12 * size)
    origin = np.array(
        [0.5 * (low[0] + high[0] - n_slots * width), 0.5 * (low[1] + high[1]), low[2]]
    )

    def row(
        slots: Slots, step: float, number: int, colours: np.ndarray
    ) -> tuple[Lines, np.ndarray]:
        """Return squares, `step` widths from one to the next, and their middles."""
        middle = np.repeat(origin[None], len(slots.filled), axis=0)
        middle[:, 0] += width * step * (np.arange(len(middle)) + 0.5)
        middle[:, 2] -= size * (0.15 + 0.22 * number)
        # Nodes are hatched, gaps are empty frames.
        shapes = np.where(slots.filled[:, None, None, None], SQUARE, np.concatenate([FRAME, FRAME]))
        segments = middle[:, None, None] + 0.42 * width * shapes
        return Lines(segments.reshape(-1, 2, 3), colours.repeat(len(SQUARE), axis=0)), middle

    there = level.output.filled
    n_children = int(there.sum())
    children = rainbow(len(level.compacted.filled))
    of_output = np.tile(np.array(GAP_COLOUR), (n_slots, 1))
    of_output[there] = children[:n_children]
    if is_compacted:
        of_input = np.tile(np.array(GAP_COLOUR), (len(level.input.filled), 1))
    else:
        of_input = rainbow(len(level.input.filled))
        of_output[there] = of_input[np.flatnonzero(there) // 2]
    input_row, inputs = row(level.input, 2.0, 0, of_input)
    output_row, outputs = row(level.output, 1.0, 1, of_output)
    written = np.stack([inputs[np.flatnonzero(there) // 2], outputs[there]], axis=1)
    parts = [Lines(written, of_output[there]), input_row, output_row]
    if is_compacted:
        compacted, places = row(level.compacted, 1.0, 2, children)
        moved = np.stack([outputs[there], places[:n_children]], axis=1)
        parts = [
            coloured(written, GAP_COLOUR),
            Lines(moved, of_output[there]),
            *parts[1:],
            compacted,
        ]
    return parts


# ----------------------------------------------------------------------------------- reduction


def min_reduction(bvh: BVH, log: BuildLog) -> Exhibit:
    """Return the reduction of the root's candidates, one frame a step."""
    scene, settings = bvh.scene, bvh.settings
    event = log.split_of(0)
    taken = None
    if event is not None and log.axis[event] >= 0:
        taken = int(log.axis[event]), float(log.position[event])
    n_candidates = 3 * settings.bins

    @Once
    def reduced(progress: Progress) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Return planes and costs of the candidates, and who is left after each step."""
        progress.report(0, 1, "Looking at all candidates")
        make_rule, order = data_parallel_rules(Primitives(scene.geometry, scene.boxes()), settings)
        rule = make_rule()
        progress.report(0, 1, "Looking at all candidates")
        call(look_at_candidates, rule, len(order), 0)
        progress.report(1, 1, "Looking at all candidates")
        winners, left, stride = np.arange(n_candidates), [np.arange(n_candidates)], 1
        while stride < n_candidates:
            call(reduction_step, rule.costs, winners, stride)
            stride *= 2
            left.append(winners[::stride].copy())
        return 0.5 * rule.planes, rule.costs, left

    def frame(step: int, progress: Progress = SILENT) -> Frame:
        planes, costs, left = reduced(progress)
        return frame_of_reduction(bvh, planes, costs, left[: step + 1], len(left) - 1, taken)

    return Exhibit(
        "min_reduction",
        "Min-Reduction",
        "How the cheapest of all candidates of the root is found by comparing pairs",
        (n_candidates - 1).bit_length() + 1,
        frame,
    )


def frame_of_reduction(
    bvh: BVH,
    planes: np.ndarray,
    costs: np.ndarray,
    left: list[np.ndarray],
    n_steps: int,
    taken: tuple[int, float] | None,
) -> Frame:
    """Return the picture after some steps.

    Parameters
    ----------
    planes, costs : (3 k,) float64
    left : list of int arrays
        The candidates that are left at the start and after each step so far.
    taken : (int, float) or None
        Axis and position of the plane by which the root was split, if it was.
    """
    low, high = bvh.scene.lower, bvh.scene.upper
    box = np.concatenate([low, high])
    size, k = float((high - low).max()), len(planes) // 3
    finite = np.isfinite(costs)
    winners = left[-1][finite[left[-1]]]

    # Bars, above them the rounds of the tournament.
    origin = np.array([high[0] + 0.2 * size, 0.5 * (low[1] + high[1]), low[2]])
    across, upwards = np.array([1.4 * size, 0, 0]), np.array([0, 0, 0.5 * size])
    top = float(costs[finite].max(initial=0.0))
    chart = Chart(origin, across, upwards, -0.5, len(planes) - 0.5, top)
    number = np.arange(len(planes))
    bars = np.stack(
        [chart.points(number, 0 * number), chart.points(number, np.where(finite, costs, 0.0))],
        axis=1,
    )
    parts = [chart.axes(), coloured(bars[finite], GREY), coloured(bars[winners], BLUE)]
    above = top * (1.1 + np.arange(n_steps + 1) / max(n_steps, 1))
    for step in range(1, len(left)):
        before, after = left[step - 1], left[step]
        # Every place stands in the middle above the candidates that it stands for.
        from_x = middles_of(np.arange(len(before)), 1 << (step - 1), len(planes))
        to = np.arange(len(before)) // 2
        to_x = middles_of(to, 1 << step, len(planes))
        levels = np.repeat(above[step - 1 : step + 1, None], len(before), axis=1)
        rounds = np.stack([chart.points(from_x, levels[0]), chart.points(to_x, levels[1])], axis=1)
        won = before == after[to]
        parts += [coloured(rounds[~won], GREY), coloured(rounds[won], BLUE)]
    shown, colour = [(c // k, float(planes[c])) for c in winners.tolist()], BLUE
    if len(left[-1]) == 1 and taken:
        shown, colour = [taken], RED
    for axis, position in shown:
        cut = planes_across(box[None], axis, np.array([position]))
        parts.append(coloured(outlines(cut), colour))
    return frame_of(parts, caption_of_reduction(planes, costs, left, n_steps, taken))


def middles_of(places: np.ndarray, width: int, count: int) -> np.ndarray:
    """Return the middles of the groups of `width` candidates, of `count`, that places stand for."""
    return 0.5 * (places * width + np.minimum((places + 1) * width, count) - 1)


def caption_of_reduction(
    planes: np.ndarray,
    costs: np.ndarray,
    left: list[np.ndarray],
    n_steps: int,
    taken: tuple[int, float] | None,
) -> str:
    """Return how many candidates are left, and the last in words."""
    step, n_left, k = len(left) - 1, len(left[-1]), len(planes) // 3
    text = f"Step {step} of {n_steps}: {n_left} of {len(planes)} candidates left"
    if n_left > 1:
        return text
    winner = int(left[-1][0])
    if not np.isfinite(costs[winner]):
        return f"{text}; no plane tells the triangles apart"
    if taken is None:
        plane = f"{'xyz'[winner // k]} = {planes[winner]:.5g}"
        return f"{text}: {plane}; it was not taken, since it costs no less than a leaf"
    return f"{text}: {'xyz'[taken[0]]} = {taken[1]:.5g}"
