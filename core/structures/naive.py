"""The naive algorithm: every ray against every triangle, O(N) tests for one ray.

The lecture's baseline, and the truth that all other structures are tested against.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.cells import Cells
from ..contract.costs import intersection_cost, traversal_cost
from ..contract.counters import N_ETS, N_IT, N_TS
from ..contract.events import NONE, VISIT_LEAF, note
from ..contract.figures import COST_OF_CELLS, OF_CELLS
from ..contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ..contract.statistics import Statistics
from ..contract.structure import Structure
from ..contract.walk import Found, walk
from ..geometry.box_shape import surface_area
from ..kernels import implements
from ..progress import SILENT, Progress
from ..scene import Scene


@dataclass(frozen=True)
class NaiveSettings:
    """Settings of the naive algorithm: only the constants of the cost model."""

    C_trav: float = traversal_cost(is_flat=True)
    C_isect: float = intersection_cost()


class NaiveArrays(NamedTuple):
    """There is nothing to store but the box of the scene, (1, 6), which is drawn."""

    box: np.ndarray


@implements(walk, NaiveArrays, inline=True)
def walk_naive(structure, geometry, ray, number, workspace, log):
    """Test every triangle; the scene is one leaf."""
    note(log, VISIT_LEAF, 0, NONE, ray.t_min, ray.t_max)
    best = test_leaf(
        geometry, None, False, 0, len(geometry.ids), ray, number, workspace, log,
        0, ray.t_min, EVERYWHERE, True, NOTHING,
    )  # fmt: skip
    return Found(best.t, best.primitive, (1, 1, best.tests))


class Naive(Structure):
    """Every ray against every triangle."""

    name = "naive"
    label = "Naive"
    summary = "Every ray against every triangle: the baseline and the truth"
    Settings = NaiveSettings
    takes_cones = True
    COUNTERS = N_TS, N_ETS, N_IT
    FIGURES = *OF_CELLS, *COST_OF_CELLS

    arrays: NaiveArrays

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: NaiveSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> Naive:
        """Wrap the scene; there is nothing to build."""
        cls.refuse_too_large(scene, settings)
        box = np.concatenate([scene.lower, scene.upper])[None]
        return cls(scene, settings, NaiveArrays(box), scene.items())

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the one cell, the scene's box."""
        zero = np.zeros(1, dtype=np.int32)
        return Cells(
            self.arrays.box, zero, zero, np.ones(1, dtype=bool),
            np.array([len(self.scene)], dtype=np.int32),
        )  # fmt: skip

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of one leaf with everything in it."""
        cells = self.cells()
        area = surface_area(cells.boxes)
        return Statistics.of_cells(
            area, cells.is_leaf, cells.count, cells.depth, area[0],
            self.settings.C_trav, self.settings.C_isect,
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Return nothing: there is nothing that could be wrong."""
        return []


STRUCTURE = Naive
