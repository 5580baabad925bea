"""Macro-cells: a uniform grid that skips empty space in large boxes.

Most cells of a grid are empty, and a ray makes a step in each. So every empty cell is given its
chessboard distance D to the nearest cell with triangles, max(|di|, |dj|, |dk|). All cells nearer
than D are empty: a ray in cell [i, j, k] may leave the box [i - (D - 1), i + D) x ... in one step
(lecture, "Macro-cells"). Cells with triangles have D = 0, and around them D = 1: there the walk is
that of the plain grid.

Distances take two passes over the cells. The first, in the order of their numbers, takes for each
cell the least of the 13 neighbours that come before it, plus one; the second, in reverse order, of
the 13 others. For the chessboard distance this is exact.

A ray only ever sees the part of the box before it. The directed regions therefore measure one
octant of directions at a time: D is then the side of the largest cube that starts at the cell,
extends into that octant, and is empty; what lies outside the grid counts as empty. One pass for
each octant finds it: a cube of side n + 1 is the cell itself and the seven cubes of side n that
start at its neighbours in that octant. The least of the eight numbers is the chessboard distance.

A region is left wall by wall, only without a look at its cells, or, if it is large, at once: the
first of its walls that the ray crosses is the wall it leaves through, and along the other two axes
the new cell is the one that the ray is in at this t (:func:`jump`). Walls are crossed in the same
order as by the plain grid, so the cells with triangles that a ray meets, and all of its hits, are
those of the plain grid, bit for bit; the cells that it visits beyond these are counted as skipped.

M. Šrámek, A. Kaufman: Fast Ray-Tracing of Rectilinear Volume Data Using Distance Transforms, IEEE
Transactions on Visualization and Computer Graphics 6(3), 2000.
G. Borgefors: Distance Transformations in Digital Images, CVGIP 34(3), 1986 (the two passes).
"""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.cells import Cells
from ..contract.counters import CELLS_SKIPPED
from ..contract.events import JUMP, VISIT_EMPTY, VISIT_LEAF, VOLUME_TEST, note
from ..contract.figures import Figure
from ..contract.leaf import NOTHING
from ..contract.missing import all_made
from ..contract.statistics import Statistics
from ..contract.walk import Found, lost, walk
from ..geometry.box import MISS, enter_box
from ..kernels import call, implements, inlined, inner, kernel, whole
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from ..scene import Scene
from ..settings import setting
from . import grid
from .grid import Grid, dda
from .grid.broad import is_broad, walk_broad
from .grid.cells import list_of, stored_list
from .grid.dda import (
    ALREADY,
    X,
    Y,
    Z,
    axis_walk,
    cell_when,
    end_of_walk,
    first_cell,
    is_outside,
    next_place,
    place_in,
    test_cell,
    wall_t,
)
from .grid.settings import CellSettings

# ------------------------------------------------------------------------------------- settings


@dataclass(frozen=True)
class MacroGridSettings(CellSettings):
    """Settings of the grid with macro-cells: those of the grid, and the kind of regions."""

    regions: str = setting(
        "chessboard",
        "Regions",
        "Which empty cells around a cell are skipped in one step",
        choices={
            "chessboard": "Those nearer than the nearest triangle, the same for all directions",
            "octant": "A cube of empty cells ahead, one per octant of directions: eight times "
            "the memory, longer steps",
        },
    )


# ------------------------------------------------------------------------------------ the record


class MacroGridArrays(NamedTuple):
    """The grid as its kernels see it; all but `distances` is as in :class:`.grid.cells.GridArrays`.

    Attributes
    ----------
    distances : (1, n_cells) or (8, n_cells) uint8
        Side of the empty region that starts at a cell, 0 for a cell with triangles. One row for
        all directions, or one for every octant: row 4 a + 2 b + c, where a, b and c are 1 for
        directions that ascend along x, y and z. At most FARTHEST.
    """

    box: np.ndarray
    walls: np.ndarray
    cell_size: np.ndarray
    tolerance: np.ndarray
    resolution: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    mailbox: bool
    distances: np.ndarray


implements(list_of, MacroGridArrays, inline=True)(stored_list)
all_made(MacroGridArrays)

# ----------------------------------------------------------------------------------------- build

FARTHEST = 255
"""The largest distance that is stored; a larger one is cut down to it, which is safe."""

MAPS = {"chessboard": 1, "octant": 8}
"""Distances per cell, by the kind of regions."""

ASCENDING, DESCENDING = np.ones(3, np.int64), -np.ones(3, np.int64)

EARLIER = np.array([d for d in itertools.product((-1, 0, 1), repeat=3) if d < (0, 0, 0)])
"""(13, 3) Neighbours that have smaller numbers."""

OCTANTS = np.array(list(itertools.product((-1, 1), repeat=3)))
"""(8, 3) Signs of the directions in each octant, in the order of the rows of distances."""

AHEAD = np.array([d for d in itertools.product((0, 1), repeat=3) if any(d)])
"""(7, 3) Neighbours in the last octant."""


@kernel
def propagate_distances(distances, resolution, neighbours, order, first, last):
    """Lower each distance to the least of some neighbours plus one, in one pass over the cells.

    Parameters
    ----------
    distances : (n_cells,) uint8
    neighbours : (m, 3) int64
        Steps to neighbours that the pass has been to before.
    order : (3,) int64
        1 or -1 per axis: the way in which the pass goes.
    first, last : int
        Rows of cells along z to do, counted in this order.
    """
    nx, ny, nz = resolution[0], resolution[1], resolution[2]
    for row in range(first, last):
        i = row // ny if order[0] > 0 else nx - 1 - row // ny
        j = row % ny if order[1] > 0 else ny - 1 - row % ny
        for column in range(nz):
            k = column if order[2] > 0 else nz - 1 - column
            cell = (i * ny + j) * nz + k
            nearest = whole(distances[cell])
            for n in range(neighbours.shape[0]):
                if nearest <= 1:
                    break
                a, b, c = i + neighbours[n, 0], j + neighbours[n, 1], k + neighbours[n, 2]
                if 0 <= a < nx and 0 <= b < ny and 0 <= c < nz:
                    nearest = min(nearest, whole(distances[(a * ny + b) * nz + c]) + 1)
            distances[cell] = nearest


def measure_distances(
    is_occupied: np.ndarray, resolution: np.ndarray, regions: str, progress: Progress
) -> np.ndarray:
    """Return the distance of every cell, (1 or 8, n_cells) uint8.

    Parameters
    ----------
    is_occupied : (n_cells,) bool
        Whether a cell has triangles.
    regions : {"chessboard", "octant"}
    """
    if regions == "chessboard":
        passes = [(0, EARLIER, ASCENDING), (0, -EARLIER, DESCENDING)]
    else:
        passes = [(row, AHEAD * signs, -signs) for row, signs in enumerate(OCTANTS)]
    distances = np.full((MAPS[regions], len(is_occupied)), FARTHEST, dtype=np.uint8)
    distances[:, is_occupied] = 0
    for number, (row, neighbours, order) in enumerate(passes):

        def propagate_some(first: int, last: int) -> None:
            # Run at once, so the loop's variables are those of this pass.
            call(propagate_distances, distances[row], resolution, neighbours, order, first, last)  # noqa: B023

        # One thread, which takes the chunks in their order: each needs what the last one found.
        text = f"Macro-cells: distances, pass {number + 1} of {len(passes)}"
        for_chunks(propagate_some, int(resolution[0] * resolution[1]), 1, progress, text)
    return distances


# ------------------------------------------------------------------------------------------ walk


NEAR = 3
"""The largest distance at which going wall by wall is cheaper than one jump."""


@inlined
def border(along, i, distance):
    """Return the first cell along one axis that is beyond the region of cell i, or the grid."""
    if along.step > 0:
        return min(i + distance, along.end)
    return max(i - distance, along.end)


@inner
def walls_between(a, b):
    """Return how many walls are crossed from one place to another."""
    return abs(b.i - a.i) + abs(b.j - a.j) + abs(b.k - a.k)


@inlined
def cross_walls(x, y, z, place, distance, t_last):
    """Go wall by wall until the region is left or the walk ends in it.

    Returns
    -------
    place : Place
        The first one beyond the region, or the last of the walk.
    t : float
        At which that is entered, or would be left.
    """
    end_i, end_j, end_k = (
        border(x, place.i, distance), border(y, place.j, distance), border(z, place.k, distance)
    )  # fmt: skip
    t = -np.inf
    for _ in range(3 * distance):
        t = min(place.wall_x, place.wall_y, place.wall_z)
        if t > t_last:
            break
        place = next_place(x, y, z, place, t)
        if place.i == end_i or place.j == end_j or place.k == end_k:
            break
    return place, t


@inlined
def jump(x, y, z, place, distance, t_last):
    """Do what :func:`cross_walls` does at once.

    Of the walls around the region the ray leaves through the first in the order of crossing. What
    it has crossed before, and so the new cell along each axis, follows from the t of that wall; at
    the same t, walls of an earlier axis have been crossed already, those of a later one have not.
    """
    end_i = border(x, place.i, distance)
    end_j = border(y, place.j, distance)
    end_k = border(z, place.k, distance)
    wall_x = wall_t(x, end_i - x.step)
    wall_y = wall_t(y, end_j - y.step)
    wall_z = wall_t(z, end_k - z.step)
    t_exit = min(wall_x, wall_y, wall_z)
    t = min(t_exit, t_last)
    ends = t_exit > t_last
    i = cell_when(x, place.i, end_i, t, ALREADY)
    j = cell_when(y, place.j, end_j, t, ends or wall_x > t)
    k = cell_when(z, place.k, end_k, t, ends or min(wall_x, wall_y) > t)
    place = place_in(x, y, z, i, j, k)
    return place, min(place.wall_x, place.wall_y, place.wall_z) if ends else t_exit


COUNTERS = *dda.COUNTERS, CELLS_SKIPPED

LOST = lost(COUNTERS)


@inlined
def found_with_regions(best, visited, empty, skipped):
    """Return the answer of a walk that has visited so many regions, and skipped cells."""
    counts = visited, visited, empty, best.tests, 1, best.mailbox_hits, best.postponed, skipped
    return Found(best.t, best.primitive, counts)


@implements(walk, MacroGridArrays, inline=True)
def walk_macro_grid(structure, geometry, ray, number, workspace, log):
    """Step from region to region; a cell with triangles is a region of its own."""
    best, visited, empty, skipped = NOTHING, 0, 0, 0

    t = enter_box(structure.box, 0, ray, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, t, t)
    if t == MISS:
        return found_with_regions(best, visited, empty, skipped)
    if is_broad(structure, ray):
        best, visited, empty, _ = walk_broad(structure, geometry, ray, number, workspace, log, t)
        return found_with_regions(best, visited, empty, skipped)

    octant = 0
    if structure.distances.shape[0] > 1:
        octant = 4 * (ray.dx > 0.0) + 2 * (ray.dy > 0.0) + (ray.dz > 0.0)
    ny, nz = structure.resolution[1], structure.resolution[2]
    x = axis_walk(structure, X, ray.low_x, ray.high_x, ray.dx, ray.ix)
    y = axis_walk(structure, Y, ray.low_y, ray.high_y, ray.dy, ray.iy)
    z = axis_walk(structure, Z, ray.low_z, ray.high_z, ray.dz, ray.iz)
    place = place_in(x, y, z, first_cell(x, t), first_cell(y, t), first_cell(z, t))
    t_last = end_of_walk(ray, best)
    # A ray crosses each layer of cells once.
    most = structure.resolution.sum()
    while visited < most:
        cell = (place.i * ny + place.j) * nz + place.k
        distance = whole(structure.distances[octant, cell])
        visited += 1
        if distance == 0:
            t_exit = min(place.wall_x, place.wall_y, place.wall_z)
            note(log, VISIT_LEAF, cell, -1, t, t_exit)
            begin, end = list_of(structure, cell)
            best = test_cell(
                structure, geometry, ray, number, workspace, log, cell, begin, end, t, t_exit, best
            )  # fmt: skip
            t_last = end_of_walk(ray, best)
            if t_exit > t_last:
                break
            place = next_place(x, y, z, place, t_exit)
        else:
            before = place
            if distance <= NEAR:
                place, t_exit = cross_walls(x, y, z, place, distance, t_last)
            else:
                place, t_exit = jump(x, y, z, place, distance, t_last)
            empty += 1
            note(log, VISIT_EMPTY, cell, -1, t, t_exit)
            passed = walls_between(before, place)
            if t_exit <= t_last:
                passed -= 1  # the cell behind the last wall is visited
            if passed > 0:
                skipped += passed
                note(log, JUMP, cell, passed, t, t_exit)
            if t_exit > t_last:
                break
        t = t_exit
        if is_outside(x, y, z, place):
            break
    else:
        return LOST

    return found_with_regions(best, visited, empty, skipped)


# ------------------------------------------------------------------------------- the structure


class MacroGrid(Grid):
    """Uniform subdivision of space with macro-cells."""

    name = "macro_grid"
    label = "Grid with Macro-Cells"
    summary = "Uniform grid that skips empty space in boxes, by the distance to the next triangle"
    Settings = MacroGridSettings
    takes_cones = False
    COUNTERS = COUNTERS
    FIGURES = (
        *grid.FIGURES,
        Figure(
            "mean_distance",
            "cells from an empty one to the nearest with triangles, in the mean",
            "Mean distance of empty cells",
        ),
        Figure("max_distance", "the largest of these distances"),
        Figure("distance_bytes", "memory that the distances take"),
    )

    arrays: MacroGridArrays  # type: ignore[assignment]  # those of a grid, and distances

    @staticmethod
    def more_bytes_per_cell(settings: CellSettings) -> int:
        """Return one byte for each distance."""
        assert isinstance(settings, MacroGridSettings)
        return MAPS[settings.regions]

    @classmethod
    def build(
        cls, scene: Scene, settings: CellSettings, progress: Progress = SILENT, *, log: bool = False
    ) -> MacroGrid:
        """Fill the cells of the grid, then measure their distances."""
        assert isinstance(settings, MacroGridSettings)
        grid, items = cls.fill(scene, settings, progress)
        is_occupied = grid.offsets[1:] > grid.offsets[:-1]
        distances = measure_distances(is_occupied, grid.resolution, settings.regions, progress)
        return cls(scene, settings, MacroGridArrays(*grid, distances), items)

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return all cells, with their distance; of the directed regions with each octant's too.

        ``distance`` is the chessboard distance, ``distance_npn`` that in the octant of directions
        with negative x, positive y and negative z.
        """
        distances = self.arrays.distances.astype(np.int32)
        extra = {"distance": distances.min(axis=0)}
        if len(distances) > 1:
            for signs, values in zip(OCTANTS, distances, strict=True):
                extra["distance_" + "".join("p" if s > 0 else "n" for s in signs)] = values
        return dataclasses.replace(super().cells(progress), extra=extra)

    def region(self, number: int, direction: np.ndarray) -> np.ndarray | None:
        """Return the box (6,) that a ray of a direction (3,) passes in one step from an empty cell.

        None for a cell with triangles.
        """
        signs = np.where(np.asarray(direction) > 0.0, 1, -1)
        is_directed = len(self.arrays.distances) > 1
        octant = int((signs > 0) @ [4, 2, 1]) if is_directed else 0
        reach = int(self.arrays.distances[octant, number]) - 1
        if reach < 0:
            return None
        resolution = self.arrays.resolution
        index = np.array(np.unravel_index(number, tuple(resolution)))
        back, ahead = index - reach, index + reach
        if is_directed:
            back, ahead = np.where(signs > 0, index, back), np.where(signs > 0, ahead, index)
        lower, size = self.arrays.box[0, :3], self.arrays.cell_size
        return np.concatenate(
            [lower + np.maximum(back, 0) * size, lower + np.minimum(ahead + 1, resolution) * size]
        )

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the grid, and how far its empty regions reach.

        `expected_leaves` counts cells, as the plain grid visits them: N_TS of random lines that
        never stop is smaller by the steps saved.
        """
        plain, distances = super().statistics(progress), self.arrays.distances
        empty = max(plain.N_EV * len(distances), 1)
        return dataclasses.replace(
            plain,
            extra={
                **plain.extra,
                "mean_distance": float(distances.sum(dtype=np.int64) / empty),
                "max_distance": int(distances.max()),
                "distance_bytes": distances.nbytes,
            },
        )

    def validate(self) -> list[str]:
        """Check the grid, and every distance against those of its neighbours."""
        violations = super().validate()
        if violations:
            return violations
        distances = self.arrays.distances
        is_occupied = (self._counts() > 0)[None]
        if ((distances == 0) != is_occupied).any():
            violations.append("a distance is zero in an empty cell, or not in an occupied one")
        signs = OCTANTS if len(distances) > 1 else [np.zeros(3, dtype=np.int64)]
        for row, towards in enumerate(signs):
            near = distances[row].reshape(tuple(self.arrays.resolution)).astype(np.int64)
            wanted = np.where(near > 0, np.minimum(_least_nearby(near, towards) + 1, FARTHEST), 0)
            if (near != wanted).any():
                violations.append("a distance is not one more than the least of its neighbours")
                break
        return violations


def _least_nearby(values: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Return the least of each cell and its neighbours, on one side of each axis or (0) on both."""
    for axis, sign in enumerate(towards):
        least = values.copy()
        low = tuple(slice(None, -1) if a == axis else slice(None) for a in range(3))
        high = tuple(slice(1, None) if a == axis else slice(None) for a in range(3))
        if sign >= 0:
            least[low] = np.minimum(least[low], values[high])
        if sign <= 0:
            least[high] = np.minimum(least[high], values[low])
        values = least
    return values


STRUCTURE = MacroGrid
