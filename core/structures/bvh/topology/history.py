"""The history of a refitted hierarchy: what is kept of every frame of an animation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
