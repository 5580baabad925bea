"""What a subdivision costs: its cells and bytes, and what random lines meet in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.structure import Structure
from ..geometry.rays import Rays
from ..memory import in_words
from ..printing import show_integer
from ..progress import SILENT, Progress
from ..sah.line_sample import random_lines
from ..scene import Scene
from .picture import Row

LINES = 2000
"""Random lines whose means are shown."""


def lines_through(scene: Scene) -> Rays:
    """Return random lines through the box of a scene, the same in every lesson."""
    return Rays.from_arrays(*random_lines(scene.lower, scene.upper, LINES, 1))


@dataclass(frozen=True)
class Costs:
    """Of one subdivision.

    Attributes
    ----------
    cells, empty : int
        N_V and N_EV.
    memory : int
        Bytes, without the scene's triangles.
    sah : float
        The cost of the tree by the surface area heuristic.
    steps, tests : float
        N_TS and N_IT in the mean over random lines; they end at their first hit.
    """

    cells: int
    empty: int
    memory: int
    sah: float
    steps: float
    tests: float

    @classmethod
    def of(cls, structure: Structure, lines: Rays, progress: Progress = SILENT) -> Costs:
        """Look at a structure, and trace the lines."""
        figures = structure.statistics(progress)
        counts = structure.trace(lines, progress=progress)[1].by_name()
        return cls(
            figures.N_V, figures.N_EV, structure.memory(), figures.sah,
            float(np.mean(counts["N_TS"])), float(np.mean(counts["N_IT"])),
        )  # fmt: skip

    def rows(self, name: str) -> tuple[Row, ...]:
        """Return the figures behind the name of the structure."""
        empty = show_integer(self.empty)
        return (
            Row(f"{name}: Cells", show_integer(self.cells), f"N_V, of which {empty} are empty"),
            Row(f"{name}: Memory", in_words(self.memory), "Without the triangles themselves"),
            Row(f"{name}: Steps", f"{self.steps:.1f}",
                f"N_TS per ray, in the mean of {LINES} random lines"),
            Row(f"{name}: Tests", f"{self.tests:.1f}", "N_IT per ray, of the same lines"),
        )  # fmt: skip
