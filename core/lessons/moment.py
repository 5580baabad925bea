"""What is kept of one frame of an animation, for the lesson on refit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Upper(NamedTuple):
    """The upper levels of a tree: boxes (k, 6) float64 and the depth of each, (k,) int."""

    boxes: np.ndarray
    depths: np.ndarray


class Moment(NamedTuple):
    """One frame of an animation.

    Attributes
    ----------
    frame : int
        Its number on the timeline.
    refit, rebuild : float
        SAH cost of the first frame's tree, refitted, and of a tree for this frame.
    refitted, rebuilt : Upper
        Of both.
    lines : (k, 2, 3) float64
        Outlines of some of the items.
    """

    frame: int
    refit: float
    rebuild: float
    refitted: Upper
    rebuilt: Upper
    lines: np.ndarray
