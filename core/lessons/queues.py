"""Lesson "split_queues": the work queues of a level, before and after compaction.

Three queues stand below the model. On top the input, one square for each node; in the middle the
output, two places for each node, those of leaves left empty; at the bottom what compaction makes of
it. Nodes in the queues have the colours of their boxes in the model.

Everything is read from the build log of the data-parallel builder: all splits of a level are one
step. Lecture, slide "Split and Compaction kernels".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..colours import ramp
from ..contract.build_log import BuildLog
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..sah.split_curve import has_curves
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import ranges_of
from .drawing import Lines, coloured, counted, extent_of, outlines, picture_of
from .hierarchy import has_log, is_tree, tree_and_log
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

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


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    level: int = setting(4, "Level", "Level of the tree whose nodes are split", minimum=0)
    compacted: bool = setting(True, "Compacted", "Whether the gaps have been closed already")


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


class SplitQueues(Play):
    """The queues of all levels of one tree."""

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.bvh = bvh
        self.levels = drawn_levels(bvh, log, progress)
        self.ends = {"level": len(self.levels) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the queues of a level, before or after compaction."""
        level, is_compacted = self.levels[settings.level], settings.compacted
        shown = level.compacted if is_compacted else level.input
        colours = rainbow(len(shown.filled))
        queues, marks = drawn_queues(self.bvh, level, is_compacted)
        m, n_children = level.input.total, level.compacted.total
        rows = [
            Row("m", str(m), "Nodes in the input queue, all split in parallel"),
            Row("Output Places", str(2 * m), "Node i writes its children to 2 i and 2 i + 1"),
            Row("Children", str(n_children), "Places that were written; leaves leave gaps"),
            Row("Occupied", f"{100 * n_children / (2 * m):.0f}%", "Share of the output"),
        ]
        boxes = Lines(box_segments(shown.boxes), colours.repeat(12, axis=0))
        caption = self._caption(settings.level, level, is_compacted)
        return picture_of([boxes, *queues], caption, marks=marks, rows=rows)

    def _caption(self, depth: int, level: DrawnLevel, is_compacted: bool) -> str:
        """Return the lengths of the queues, and how full the output is."""
        m, n_children = level.input.total, level.compacted.total
        share = f"{100 * n_children / (2 * m):.0f}% occupied"
        text = f"Level {depth} of {len(self.levels) - 1}: "
        if is_compacted:
            text += f"compaction closes the gaps, {2 * m} places become {n_children}"
        else:
            text += f"{m} in the input queue, {n_children} of {2 * m} places of the output, {share}"
        if m > len(level.input.filled):
            some = counted(len(level.input.filled), "node is and writes", "nodes are and write")
            text += f"; drawn: what the first {some}"
        return text

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return an upper level and the one whose output is half empty, both before and after."""
        shares = [
            abs(level.compacted.total / (2 * level.input.total) - 0.5) for level in self.levels
        ]
        chosen = dict.fromkeys([min(2, len(shares) - 1), int(np.argmin(shares))])
        return [Settings(level, is_compacted) for level in chosen for is_compacted in (False, True)]


def rainbow(count: int) -> np.ndarray:
    """Return a colour for each place of a queue, (count, 4)."""
    colours = np.ones((count, 4))
    colours[:, :3] = ramp(np.arange(count) / max(count - 1, 1))
    return colours


def drawn_queues(bvh: BVH, level: DrawnLevel, is_compacted: bool) -> tuple[list[Lines], list[Mark]]:
    """Return the queues as rows of squares below the model, lines from row to row, and names."""
    low, high = bvh.scene.lower, bvh.scene.upper
    size = extent_of(bvh.scene)
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
        middle[:, 2] -= size * (0.25 + 0.22 * number)
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
    m, right = level.input.total, np.array([0.08 * size + n_slots * width, 0.0, 0.0])
    names = [f"input: m = {m}", f"output: 2 m = {2 * m}"]
    if is_compacted:
        names.append(f"compacted: {level.compacted.total}")
    heights = [low[2] - size * (0.25 + 0.22 * number) for number in range(3)]
    marks = [
        Mark(np.array([*(origin + right)[:2], height]), name)
        for name, height in zip(names, heights, strict=False)
    ]
    if is_compacted:
        compacted, places = row(level.compacted, 1.0, 2, children)
        moved = np.stack([outputs[there], places[:n_children]], axis=1)
        parts = [
            coloured(written, GAP_COLOUR),
            Lines(moved, of_output[there]),
            *parts[1:],
            compacted,
        ]
    return parts, marks


def is_data_parallel(structure: Any) -> str:
    """Accept trees as the data-parallel builder makes them, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if structure.settings.builder != "parallel_sah" or not has_curves(structure):
        return "it is not as the builder parallel_sah makes it, with arity 2 and no optimiser"
    return has_log(structure)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the queues from the log."""
    bvh, log = tree_and_log(subject, progress)
    return SplitQueues(bvh, log, progress)


LESSONS = (
    Lesson(
        name="split_queues",
        label="Split and Compaction",
        slide="Split and Compaction kernels",
        begin="All nodes of a level are split at once, each thread writing to places of its own",
        look_for="Node i writes its children to 2 i and 2 i + 1, so that nobody waits for anybody; "
        "leaves leave both places empty, and compaction closes the gaps",
        question="Why are the children not simply written one after the other into the output?",
        answer="A thread would have to know how many nodes before it were split, which is only "
        "known when all of them are done. With two places each nobody needs to know; one prefix "
        "sum afterwards closes all gaps at once",
        source="structures.bvh.builders.top_down.parallel_sah",
        sample="suzanne:subdivisions=0",
        structures=("bvh:builder=parallel_sah",),
        suits=is_data_parallel,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
