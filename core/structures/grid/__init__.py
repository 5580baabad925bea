"""Uniform grid, walked by a 3D DDA.

The scene's box is cut into nx * ny * nz equal cells, as many as are given or as there should be for
so many triangles (:mod:`.resolution`); each cell lists the triangles that overlap it
(:mod:`.cells`), at once or when a ray first enters it (:mod:`.lazy`). A ray enters at a cell and
steps from wall to wall (:mod:`.dda`, :mod:`.walk`).
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from typing import Any, ClassVar

import numpy as np

from ...contract.cells import Cells
from ...contract.counters import Counter
from ...contract.figures import COST_OF_CELLS, OF_CELLS, Figure
from ...contract.lazy import CELLS_MADE, LazyStructure, with_room
from ...contract.statistics import Statistics
from ...contract.structure import Structure
from ...errors import InputError
from ...geometry.box_shape import surface_area
from ...geometry.triangles import Triangles
from ...memory import refuse_if_too_large, refuse_if_unnumbered
from ...progress import SILENT, Progress
from ...scene import Scene
from . import walk as walk  # registers it
from .cells import GridArrays, empty_grid, fill_cells, margin_and_tolerance
from .dda import COUNTERS
from .lazy import NOT_MADE, make_lists, sort_into_blocks
from .resolution import (
    REFERENCES_PER_CELL,
    USUAL_DENSITY,
    lowered,
    reference_terms,
    resolution_by_rule,
)
from .settings import CellSettings, GridSettings

BYTES_PER_CELL = 64
"""Per cell: its offset, and what the figures of all cells take for a moment."""

BYTES_PER_WALL = 24
"""Per cell along the axis that has most."""


FIGURES = (
    Figure("resolution", "cells along x, y and z", "Resolution", "count"),
    *OF_CELLS,
    *COST_OF_CELLS,
)


def comparison(settings: CellSettings) -> dict[str, bool]:
    """Return how triangles are compared with cells."""
    return {"is_open": settings.overlap == "open", "is_exact": settings.assignment == "exact"}


class Grid(Structure):
    """Uniform subdivision of space."""

    name = "grid"
    label = "Uniform Grid"
    summary = "Equal cells in CSR lists, walked by a 3D DDA"
    Settings: ClassVar[type] = GridSettings
    takes_cones = True
    COUNTERS: ClassVar[tuple[Counter, ...]] = COUNTERS
    FIGURES: ClassVar[tuple[Figure, ...]] = (*FIGURES, CELLS_MADE)

    arrays: GridArrays

    @property
    def has_mailbox(self) -> bool:
        """Whether the walk needs a mailbox."""
        return self.settings.mailbox

    @staticmethod
    def _box(scene: Scene, settings: CellSettings) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner of the grid, (3,) each."""
        size = scene.upper - scene.lower
        margin = settings.padding * size
        # A flat scene gets some thickness: a cell of zero volume has no inside to walk through.
        margin = np.where(size > 0.0, margin, max(settings.padding, 1e-6) * size.max())
        return scene.lower - margin, scene.upper + margin

    @classmethod
    def _most_cells(cls, scene: Scene, settings: CellSettings) -> np.ndarray:
        """Return the resolution that is given or that the rule aims at, (3,) float64."""
        given = np.array(settings.resolution)
        if (given > 0).all():
            return given.astype(np.float64)
        lower, upper = cls._box(scene, settings)
        by_rule = resolution_by_rule(upper - lower, len(scene), settings.rule, settings.density)
        return np.where(given > 0, given, by_rule)

    @classmethod
    def _resolution(cls, scene: Scene, settings: CellSettings) -> np.ndarray:
        """Return the resolution, (3,) float64: fewer cells where triangles are large.

        To know that, all triangles are looked at.
        """
        resolution, is_open = cls._most_cells(scene, settings), np.equal(settings.resolution, 0)
        if not is_open.any():
            return resolution
        lower, upper = cls._box(scene, settings)
        terms = reference_terms(scene.geometry, upper - lower, settings.assignment == "exact")
        most = REFERENCES_PER_CELL * max(settings.density, USUAL_DENSITY) * len(scene)
        return lowered(resolution, is_open, terms, most)

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: CellSettings) -> None:
        """Refuse a resolution whose cells do not fit, with the arrays their figures need.

        No triangle is looked at where not even the most cells would be too many.
        """
        with contextlib.suppress(InputError):
            return cls._refuse_cells(cls._most_cells(scene, settings), settings)
        return cls._refuse_cells(cls._resolution(scene, settings), settings)

    @classmethod
    def _refuse_cells(cls, resolution: np.ndarray, settings: CellSettings) -> None:
        n_cells = float(np.prod(resolution))
        words = "x".join(f"{n:.0f}" for n in resolution)
        refuse_if_unnumbered(n_cells, "cells of the grid", "lower the resolution")
        bytes_per_cell = BYTES_PER_CELL + cls.more_bytes_per_cell(settings)
        refuse_if_too_large(
            int(bytes_per_cell * n_cells + BYTES_PER_WALL * resolution.max()),
            f"a grid of {words} = {n_cells:.3g} cells",
            "lower the resolution",
        )

    @staticmethod
    def more_bytes_per_cell(settings: CellSettings) -> int:
        """Return what a kind of grid keeps for every cell beside its list."""
        return 0

    @classmethod
    def cut(cls, scene: Scene, settings: CellSettings) -> GridArrays:
        """Cut the scene's box into cells, which list nothing yet.

        Raises
        ------
        InputError
            When the settings ask for more memory than there is.
        """
        lower, upper = cls._box(scene, settings)
        resolution = cls._resolution(scene, settings)
        cls._refuse_cells(resolution, settings)
        return empty_grid(scene, lower, upper, resolution.astype(np.int64), settings.mailbox)

    @classmethod
    def fill(
        cls, scene: Scene, settings: CellSettings, progress: Progress
    ) -> tuple[GridArrays, Any]:
        """Cut the scene's box into cells, and list the triangles in each.

        Raises
        ------
        InputError
            When the settings ask for more memory than there is.
        Cancelled
            From `progress`.
        """
        grid, items = cls.cut(scene, settings), scene.items()
        grid = fill_cells(grid, scene, items, **comparison(settings), progress=progress)
        return grid, items

    @classmethod
    def build(
        cls, scene: Scene, settings: CellSettings, progress: Progress = SILENT, *, log: bool = False
    ) -> Grid:
        """Fill the cells, or leave that to the rays; there is nothing else to do."""
        if isinstance(settings, GridSettings) and settings.lazy:
            return LazyGrid.build_blocks(scene, settings, progress)
        return cls(scene, settings, *cls.fill(scene, settings, progress))

    def _counts(self) -> np.ndarray:
        """Return the references per cell, (n_cells,) int64."""
        return np.diff(self.arrays.offsets)

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return all cells; their number is that of the step log."""
        box, size, resolution = self.arrays.box, self.arrays.cell_size, self.arrays.resolution
        counts = self._counts()
        refuse_if_too_large(
            len(counts) * 160, f"listing {len(counts)} cells", "lower the resolution"
        )
        index = np.stack(np.unravel_index(np.arange(len(counts)), tuple(resolution)), axis=1)
        lower = box[0, :3] + index * size
        upper = box[0, :3] + (index + 1) * size
        return Cells(
            np.concatenate([lower, upper], axis=1), np.arange(len(counts), dtype=np.int32),
            np.zeros(len(counts), dtype=np.int32), np.ones(len(counts), dtype=bool),
            counts.astype(np.int32),
        )  # fmt: skip

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures; a grid has no inner nodes, so C_trav does not enter its SAH."""
        counts = self._counts()
        area = surface_area(np.concatenate([np.zeros(3), self.arrays.cell_size]))
        return Statistics.of_cells(
            np.full(len(counts), area), np.ones(len(counts), dtype=bool), counts,
            np.zeros(len(counts), dtype=np.int64), float(surface_area(self.arrays.box)[0]),
            self.settings.C_trav, self.settings.C_isect,
            {"resolution": self.arrays.resolution.tolist()},
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Check the lists, and that every cell lists what overlaps it.

        With exact assignment the latter is checked at the corners of triangles only.
        """
        offsets, references = self.arrays.offsets, self.arrays.references
        if offsets[0] != 0 or offsets[-1] != len(references) or (np.diff(offsets) < 0).any():
            return ["cell offsets do not partition the references"]
        violations = []
        if len(np.unique(references)) != len(self.scene):
            violations.append("a triangle is in no cell")
        cell_of = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        low, high = self._spans()
        overlapped = np.prod(high - low + 1, axis=1)
        return violations + self._wrong_lists(
            cell_of, references, overlapped, np.ones(len(offsets) - 1, bool)
        )

    def _wrong_lists(
        self, cell_of: np.ndarray, references: np.ndarray, overlapped: np.ndarray, made: np.ndarray
    ) -> list[str]:
        """Compare lists with what they should hold.

        Parameters
        ----------
        cell_of, references : (m,) int
            The lists, cell by cell: cells and triangles.
        overlapped : (n,) int
            Of how many cells that have lists each triangle's box overlaps.
        made : (n_cells,) bool
            Which cells have lists.
        """
        violations = []
        same = cell_of[1:] == cell_of[:-1]
        if (np.diff(references)[same] <= 0).any():
            violations.append("a cell lists a triangle twice or out of order")
        low, high = self._spans()
        i, j, k = np.unravel_index(cell_of, tuple(self.arrays.resolution))
        index = np.stack([i, j, k], axis=1)
        if (index < low[references]).any() or (index > high[references]).any():
            violations.append("a cell lists a triangle whose box lies outside it")
        listed = np.bincount(references, minlength=len(self.scene))
        if self.settings.assignment == "box" and (listed < overlapped).any():
            violations.append("a cell does not list a triangle whose box overlaps it")
        if not isinstance(self.geometry, Triangles):
            return violations
        corners = self._cells_of_corners()
        pairs = (corners * len(self.scene) + np.arange(len(self.scene))[:, None])[made[corners]]
        if not np.isin(pairs, cell_of * len(self.scene) + references).all():
            violations.append("a triangle is not listed by the cell of one of its corners")
        return violations

    def walls(self, axis: int) -> np.ndarray:
        """Return the coordinates of all walls of an axis, (n + 1,) float64."""
        return self.arrays.walls[axis, : self.arrays.resolution[axis] + 1]

    def _cells_at(self, axis: int, x: np.ndarray) -> np.ndarray:
        """Return the cells of coordinates along an axis, found by searching the walls."""
        found = np.searchsorted(self.walls(axis), x, side="right") - 1
        return np.clip(found, 0, self.arrays.resolution[axis] - 1)

    def _spans(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the first and last cell per axis that each triangle's box overlaps, (n, 3)."""
        boxes = self.scene.boxes()
        box = self.arrays.box[0]
        margin, tolerance = margin_and_tolerance(box[:3], box[3:], self.scene)
        low = np.stack([self._cells_at(a, boxes[:, a] - tolerance[a]) for a in range(3)], axis=1)
        top = boxes[:, 3:] + tolerance - 2.0 * margin * (self.settings.overlap == "open")
        high = np.stack([self._cells_at(a, top[:, a]) for a in range(3)], axis=1)
        return low, np.maximum(low, high)

    def _cells_of_corners(self) -> np.ndarray:
        """Return the cell of every triangle's corners, (n, 3), within the span of its box."""
        low, high = self._spans()
        index = np.stack(
            [self._cells_at(axis, self.triangles.corners[:, :, axis]) for axis in range(3)], axis=2
        )
        index = np.clip(index, low[:, None], high[:, None])
        _, ny, nz = self.arrays.resolution
        return (index[..., 0] * ny + index[..., 1]) * nz + index[..., 2]


class LazyGrid(LazyStructure, Grid):
    """A grid whose cells list their triangles when a ray first enters them (:mod:`.lazy`)."""

    @classmethod
    def build_blocks(
        cls, scene: Scene, settings: GridSettings, progress: Progress = SILENT
    ) -> LazyGrid:
        """Sort the triangles into blocks of cells."""
        grid, items, is_open = cls.cut(scene, settings), scene.items(), settings.overlap == "open"
        blocks = sort_into_blocks(grid, scene, items, is_open=is_open, progress=progress)
        return cls(scene, settings, blocks, items)

    def seeking(self, look_ahead: int) -> tuple[Any, np.ndarray]:
        """Return the grid with room for noting cells."""
        grid = self.arrays
        return with_room(grid, len(grid.ends), look_ahead)

    def make_cells(self, wanted: np.ndarray, threads: int, progress: Progress) -> tuple[Any, int]:
        """List the triangles in cells."""
        return make_lists(
            self.arrays, self.scene, self.geometry, wanted, threads, progress,
            **comparison(self.settings),
        )  # fmt: skip

    def _counts(self) -> np.ndarray:
        """Return the references per cell, 0 in those that are not made."""
        return np.maximum(self.arrays.ends, self.arrays.begins) - self.arrays.begins

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return all cells; ``is_made`` says which of them are."""
        is_made = self.arrays.ends != NOT_MADE
        return dataclasses.replace(super().cells(progress), extra={"is_made": is_made})

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of what is made: other cells count as empty ones."""
        figures = super().statistics(progress)
        extra = {**figures.extra, CELLS_MADE.key: self.made().cells}
        return dataclasses.replace(figures, extra=extra)

    def validate(self) -> list[str]:
        """Check the lists that are made."""
        begins, ends, references = self.arrays.begins, self.arrays.ends, self.arrays.references
        made = ends != NOT_MADE
        cells = np.flatnonzero(made)
        order = cells[np.lexsort((ends[cells], begins[cells]))]
        if (begins[order] != np.concatenate([[0], ends[order]])[: len(order)]).any() or (
            ends[order[-1:]] != len(references)
        ).any():
            return ["the lists of cells do not partition the references"]
        # The sum of what is made up to each cell of every axis gives that of any span.
        sums = np.pad(made.reshape(tuple(self.arrays.resolution)).astype(np.int64), [(1, 0)] * 3)
        sums = sums.cumsum(axis=0).cumsum(axis=1).cumsum(axis=2)
        low, high = self._spans()
        overlapped = np.zeros(len(low), np.int64)
        for upper in itertools.product((0, 1), repeat=3):
            corner = np.where(upper, high + 1, low)
            overlapped += (-1) ** (3 - sum(upper)) * sums[tuple(corner.T)]
        sizes = ends[order] - begins[order]
        return self._wrong_lists(np.repeat(order, sizes), references, overlapped, made)


STRUCTURE = Grid
