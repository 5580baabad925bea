"""A magnifying glass: what is small in the model stands beside it once more, enlarged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..scene import Scene
from .drawing import GREY, Lines, coloured

ENLARGED = 0.6
"""Size of what stands beside the model enlarged, as a share of the scene's."""


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


def magnifier(box: np.ndarray, scene: Scene, share: float) -> Magnifier | None:
    """Return what enlarges a box (6,) to the right of the model, where no triangles hide it.

    Parameters
    ----------
    share : float
        Size of the box under the glass, in that of the scene.

    Returns
    -------
    Magnifier or None
        None for a point, and for what is as large as that already.
    """
    size = float((scene.upper - scene.lower).max())
    own = float((box[3:] - box[:3]).max())
    if not 0.0 < own < share * size:
        return None
    middle = 0.5 * (scene.lower + scene.upper)
    place = np.array([scene.upper[0] + share * size, *middle[1:]])
    return Magnifier(0.5 * (box[:3] + box[3:]), place, share * size / own)


def enlarged_beside(parts: Sequence[Lines], box: np.ndarray, scene: Scene) -> list[Lines]:
    """Return what is in a box once more beside the model; nothing, if it is large enough there."""
    glass = magnifier(box, scene, ENLARGED)
    return [glass.of(part) for part in parts] if glass is not None else []
