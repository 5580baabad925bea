"""A magnifying glass: what is small in the model stands beside it once more, enlarged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene import Scene
from .drawing import GREY, Lines, coloured

MAGNIFIED = 0.35
"""Size of a node under the magnifying glass, as a share of the scene's."""


@dataclass(frozen=True)
class Magnifier:
    """Shows parts once more, enlarged beside the model.

    Attributes
    ----------
    centre, place : (3,) float64
        Middle of what is enlarged, and where that stands.
    scale : float
    """

    centre: np.ndarray
    place: np.ndarray
    scale: float

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return where points stand, enlarged."""
        return self.place + self.scale * (points - self.centre)

    def of(self, part: Lines) -> Lines:
        """Return a part, enlarged."""
        return Lines(self.at(part.segments), part.colours)

    def way(self) -> Lines:
        """Return the line that leads there."""
        return coloured(np.stack([self.centre, self.place])[None], GREY)


def magnifier(box: np.ndarray, scene: Scene) -> Magnifier | None:
    """Return what enlarges a box (6,) beside the model; None if it is large enough as it is."""
    size = float((scene.upper - scene.lower).max())
    own = float((box[3:] - box[:3]).max())
    if not 0.0 < own < MAGNIFIED * size:
        return None
    middle = 0.5 * (scene.lower + scene.upper)
    place = np.array([scene.upper[0] + 0.35 * size, *middle[1:]])
    return Magnifier(0.5 * (box[:3] + box[3:]), place, MAGNIFIED * size / own)
