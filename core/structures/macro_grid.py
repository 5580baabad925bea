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

The cells with triangles that a ray meets, and all of its hits, are those of the plain grid, bit for
bit. That walk crosses walls in the order of their t, of several at the same t first that in x, then
in y, then in z. So the first wall of the skipped box in this order is the wall it leaves through,
and along each other axis the new cell is the one whose walls before it come earlier in this order
and whose next wall comes later; see :func:`skip`.

M. Šrámek, A. Kaufman: Fast Ray-Tracing of Rectilinear Volume Data Using Distance Transforms, IEEE
Transactions on Visualization and Computer Graphics 6(3), 2000.
G. Borgefors: Distance Transformations in Digital Images, CVGIP 34(3), 1986 (the two passes).
"""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..geometry.box import MISS, enter_box
from ..kernels import call, implements, inlined, kernel
from ..memory import refuse_if_too_large
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from ..scene import Scene
from ..settings import setting
from .contract import Cells, Found, Statistics, walk
from .grid import (
    Grid,
    GridSettings,
    build_grid,
    cell_when,
    first_place,
    is_inside,
    is_over,
    next_place,
    number_of,
    place_in,
    test_cell,
)
from .steps import VISIT_EMPTY, VISIT_LEAF, VOLUME_TEST, Steps, note

# ------------------------------------------------------------------------------------- settings


@dataclass(frozen=True)
class MacroGridSettings(GridSettings):
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
    """The grid as its kernels see it; all but `distances` is as in :class:`.grid.GridArrays`.

    Attributes
    ----------
    distances : (1, n_cells) or (8, n_cells) uint8
        Side of the empty region that starts at a cell, 0 for a cell with triangles. One row for
        all directions, or one for every octant: row 4 a + 2 b + c, where a, b and c are 1 for
        directions that ascend along x, y and z. At most FARTHEST.
    """

    box: np.ndarray
    origin: np.ndarray
    cell_size: np.ndarray
    resolution: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    mailbox: bool
    distances: np.ndarray


# ----------------------------------------------------------------------------------------- build

FARTHEST = 255
"""The largest distance that is stored; a larger one is cut down to it, which is safe."""

ASCENDING, DESCENDING = np.ones(3, np.int64), -np.ones(3, np.int64)

EARLIER = np.array([d for d in itertools.product((-1, 0, 1), repeat=3) if d < (0, 0, 0)])
"""(13, 3) Neighbours that have smaller numbers."""

OCTANTS = np.array(list(itertools.product((-1, 1), repeat=3)))
"""(8, 3) Signs of the directions in each octant, in the order of the rows of distances."""

AHEAD = np.array([d for d in itertools.product((0, 1), repeat=3) if any(d)])
"""(7, 3) Neighbours in the last octant."""


@kernel
def spread(distances, resolution, neighbours, order, first, last):
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
            nearest = np.int64(distances[cell])
            for n in range(neighbours.shape[0]):
                if nearest <= 1:
                    break
                a, b, c = i + neighbours[n, 0], j + neighbours[n, 1], k + neighbours[n, 2]
                if 0 <= a < nx and 0 <= b < ny and 0 <= c < nz:
                    nearest = min(nearest, np.int64(distances[(a * ny + b) * nz + c]) + 1)
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
    n_maps, n_cells = passes[-1][0] + 1, len(is_occupied)
    refuse_if_too_large(
        n_maps * n_cells, f"the distances of {n_cells} cells", "lower the resolution"
    )
    distances = np.full((n_maps, n_cells), FARTHEST, dtype=np.uint8)
    distances[:, is_occupied] = 0
    for number, (row, neighbours, order) in enumerate(passes):

        def spread_some(first: int, last: int) -> None:
            call(spread, distances[row], resolution, neighbours, order, first, last)  # noqa: B023

        # One thread, which takes the chunks in their order: each needs what the last one found.
        text = f"Macro-cells: distances, pass {number + 1} of {len(passes)}"
        for_chunks(spread_some, int(resolution[0] * resolution[1]), 1, progress, text)
    return distances


# ------------------------------------------------------------------------------------------ walk


@inlined
def far_place(grid, ray, place, distance):
    """Return the place in the last cell of an empty region, through whose walls a ray leaves it."""
    reach = distance - 1
    nx, ny, nz = grid.resolution[0], grid.resolution[1], grid.resolution[2]
    i = min(place.i + reach, nx - 1) if ray.dx > 0.0 else max(place.i - reach, 0)
    j = min(place.j + reach, ny - 1) if ray.dy > 0.0 else max(place.j - reach, 0)
    k = min(place.k + reach, nz - 1) if ray.dz > 0.0 else max(place.k - reach, 0)
    return place_in(grid, ray, i, j, k)


@inlined
def skip(grid, ray, place, far, t_exit):
    """Return the place behind the wall through which a ray leaves an empty region at `t_exit`."""
    i, j, k = far.i, far.j, far.k
    through_x = far.wall_x == t_exit
    through_y = far.wall_y == t_exit and not through_x
    if not through_x:
        i = cell_when(grid, 0, place.i, i, ray.low_x, ray.high_x, ray.dx, ray.ix, t_exit, True)
    if not through_y:
        j = cell_when(
            grid, 1, place.j, j, ray.low_y, ray.high_y, ray.dy, ray.iy, t_exit, not through_x
        )
    if through_x or through_y:
        k = cell_when(grid, 2, place.k, k, ray.low_z, ray.high_z, ray.dz, ray.iz, t_exit, False)
    return next_place(grid, ray, place_in(grid, ray, i, j, k), t_exit)


@implements(walk, MacroGridArrays)
def walk_macro_grid(structure, triangles, ray, number, workspace, log):
    """Step from region to region; an occupied cell is a region of its own."""
    best_t, best = np.inf, -1
    regions_visited, empty_visited, tests, mailbox_hits = 0, 0, 0, 0

    t = enter_box(structure.box, 0, ray, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, t, t)
    if t == MISS:
        return Found(best_t, best, 0, 0, 0, 0, 1, 0)

    octant = 0
    if structure.distances.shape[0] > 1:
        octant = 4 * (ray.dx > 0.0) + 2 * (ray.dy > 0.0) + (ray.dz > 0.0)
    place = first_place(structure, ray, t)
    while True:
        cell = number_of(structure, place.i, place.j, place.k)
        distance = np.int64(structure.distances[octant, cell])
        far = place if distance <= 1 else far_place(structure, ray, place, distance)
        t_exit = min(far.wall_x, far.wall_y, far.wall_z)
        regions_visited += 1
        if distance > 0:
            empty_visited += 1
            note(log, VISIT_EMPTY, cell, -1, t, t_exit)
        else:
            note(log, VISIT_LEAF, cell, -1, t, t_exit)
            best_t, best, tested, known = test_cell(
                structure, triangles, ray, number, workspace, log, cell, t, t_exit, best_t, best
            )
            tests += tested
            mailbox_hits += known
        if is_over(ray, t_exit, best_t, best):
            break
        t = t_exit
        if distance <= 1:
            place = next_place(structure, ray, place, t_exit)
        else:
            place = skip(structure, ray, place, far, t_exit)
        if not is_inside(structure, place):
            break

    return Found(
        best_t, best, regions_visited, regions_visited, empty_visited, tests, 1, mailbox_hits
    )  # fmt: skip


# ------------------------------------------------------------------------------- the structure


class MacroGrid(Grid):
    """Uniform subdivision of space with macro-cells."""

    name = "macro_grid"
    label = "Grid with Macro-Cells"
    summary = "Uniform grid that skips empty space in boxes, by the distance to the next triangle"
    Settings = MacroGridSettings

    arrays: MacroGridArrays  # type: ignore[assignment]

    @classmethod
    def build(cls, scene: Scene, settings: Any, progress: Progress = SILENT) -> MacroGrid:
        """Build the grid, then measure the distances of its cells."""
        cls.refuse_too_large(scene, settings)
        grid, triangles = build_grid(scene, settings, progress)
        is_occupied = grid.offsets[1:] > grid.offsets[:-1]
        distances = measure_distances(is_occupied, grid.resolution, settings.regions, progress)
        return cls(scene, settings, MacroGridArrays(*grid, distances), triangles)

    def cells(self) -> Cells:
        """Return all cells, with their distance; of the directed regions with each octant's too.

        ``distance`` is the chessboard distance, ``distance_npn`` that in the octant of directions
        with negative x, positive y and negative z.
        """
        distances = self.arrays.distances.astype(np.int32)
        extra = {"distance": distances.min(axis=0)}
        if len(distances) > 1:
            for signs, values in zip(OCTANTS, distances, strict=True):
                extra["distance_" + "".join("p" if s > 0 else "n" for s in signs)] = values
        return dataclasses.replace(super().cells(), extra=extra)

    def region(self, cell: int, direction: np.ndarray) -> np.ndarray:
        """Return the box (6,) that a ray of a direction (3,) skips from an empty cell.

        Raises
        ------
        ValueError
            If the cell is not empty.
        """
        signs = np.where(np.asarray(direction) > 0.0, 1, -1)
        is_directed = len(self.arrays.distances) > 1
        octant = int((signs > 0) @ [4, 2, 1]) if is_directed else 0
        reach = int(self.arrays.distances[octant, cell]) - 1
        if reach < 0:
            raise ValueError(f"cell {cell} is not empty")
        resolution = self.arrays.resolution
        index = np.array(np.unravel_index(cell, tuple(resolution)))
        back, ahead = index - reach, index + reach
        if is_directed:
            back, ahead = np.where(signs > 0, index, back), np.where(signs > 0, ahead, index)
        lower, size = self.arrays.box[0, :3], self.arrays.cell_size
        return np.concatenate(
            [lower + np.maximum(back, 0) * size, lower + np.minimum(ahead + 1, resolution) * size]
        )

    def cells_skipped(self, steps: Steps) -> np.ndarray:
        """Return for each visit of a walk the cells that the plain grid's walk visits beyond it.

        Not known for the last visit, where it is 0. Each wall between this cell and the next
        one visited is a step of the plain walk.
        """
        cells = steps.cell[np.isin(steps.kind, (VISIT_EMPTY, VISIT_LEAF))]
        index = np.stack(np.unravel_index(cells, tuple(self.arrays.resolution)), axis=1)
        walls = np.abs(np.diff(index, axis=0)).sum(axis=1)
        return np.append(walls - 1, 0)[: len(cells)]

    def statistics(self) -> Statistics:
        """Return the figures of the grid, and how far its empty regions reach.

        `expected_leaves` counts cells, as the plain grid visits them: N_TS of random lines that
        never stop is smaller by the steps saved.
        """
        plain, distances = super().statistics(), self.arrays.distances
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
