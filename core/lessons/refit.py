"""Exhibit "refit over the timeline": the tree of the first frame follows the moving triangles.

Every frame of the animation is one picture: the boxes of the upper levels, and below the model
how the cost grows. Orange: refitted. Blue: built anew for that frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..colours import depth_colours
from ..contract.protocols import Refittable
from ..geometry.box_shape import box_segments
from ..progress import SILENT, Progress
from .drawing import BLUE, ORANGE, RED, Chart, Lines, frame_of
from .exhibit import Exhibit, Frame

LEVELS = 5
"""Levels that are kept of every frame."""


class Moment(NamedTuple):
    """One frame of an animation.

    Attributes
    ----------
    frame : int
        Its number on the timeline.
    refit, rebuild : float
        SAH cost of the first frame's tree, refitted, and of a tree for this frame.
    boxes : (k, 6) float64
        Boxes of the upper LEVELS of the refitted tree.
    depths : (k,) int
    """

    frame: int
    refit: float
    rebuild: float
    boxes: np.ndarray
    depths: np.ndarray


def moment_of(frame: int, refitted: Refittable, refit: float, rebuild: float) -> Moment:
    """Return what is kept of one frame."""
    return Moment(frame, refit, rebuild, *refitted.upper_boxes(LEVELS))


def refit_over_timeline(history: Sequence[Moment]) -> Exhibit:
    """Return the exhibit of an animation."""
    numbers = np.array([moment.frame for moment in history], dtype=np.float64)
    refit = np.array([moment.refit for moment in history])
    rebuild = np.array([moment.rebuild for moment in history])
    # The chart stands still, below whatever the animation reaches.
    low = np.min([moment.boxes[0, :3] for moment in history], axis=0)
    high = np.max([moment.boxes[0, 3:] for moment in history], axis=0)
    size = float((high - low).max())
    chart = Chart(
        low - np.array([0.0, 0.0, 0.5 * size]), np.array([max(high[0] - low[0], 0.5 * size), 0, 0]),
        np.array([0.0, 0.0, 0.4 * size]), numbers[0], numbers[-1], float(max(refit.max(), 1e-300)),
    )  # fmt: skip

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        moment = history[number]
        colours = depth_colours(moment.depths[::-1], LEVELS - 1)
        colours = np.concatenate([colours, np.ones((len(colours), 1))], axis=1).repeat(12, axis=0)
        more = 100.0 * (moment.refit / moment.rebuild - 1.0) if moment.rebuild > 0.0 else 0.0
        parts = [
            Lines(box_segments(moment.boxes[::-1]), colours),
            chart.axes(),
            chart.curve(numbers, rebuild, BLUE),
            chart.curve(numbers, refit, ORANGE),
            chart.mark(numbers[number], moment.refit, RED),
        ]
        caption = (
            f"Frame {moment.frame}: SAH {moment.refit:.2f} refitted, {moment.rebuild:.2f} built "
            f"anew: {more:+.1f}%; levels 0 to {int(moment.depths.max())} of the refitted tree"
        )
        return frame_of(parts, caption)

    return Exhibit(
        "refit_over_timeline",
        "Refit over the Timeline",
        "How the boxes of the first frame's tree and its cost grow, frame by frame",
        len(history),
        frame,
    )
