"""What only some structures can: asked with ``isinstance``, or of a class with ``issubclass``.

So nobody asks for a structure by its name, and a new one that can the same is treated alike.
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..progress import SILENT, Progress
from ..scene import Scene


@runtime_checkable
class Linked(Protocol):
    """Knows the neighbours of its leaves."""

    def links(self, number: int) -> np.ndarray:
        """Return the numbers of the cells that a leaf is linked to, (k,); none of no leaf."""


@runtime_checkable
class Skipping(Protocol):
    """Passes several cells in one step."""

    def region(self, number: int, direction: np.ndarray) -> np.ndarray | None:
        """Return the box (6,) that a ray of a direction (3,) passes in one step from a cell.

        None where that is the cell itself.
        """


@runtime_checkable
class Refittable(Protocol):
    """Can follow triangles that have moved, instead of being built anew."""

    def refitted(self, scene: Scene, progress: Progress = SILENT) -> Any:
        """Return the same structure over a scene whose triangles have moved.

        Raises
        ------
        InputError
            If the triangles are not the same, or this structure cannot follow them.
        Cancelled
            From `progress`.
        """

    def upper_boxes(self, levels: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the boxes of the upper levels, (k, 6), and the depth of each, (k,)."""
