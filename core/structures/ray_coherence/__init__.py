"""Ray coherence: what rays that leave one sphere in nearly one direction may hit.

Every item has a bounding sphere, and at the centre of that a cube of directions. Whatever ray
leaves the sphere through a cell of the cube, it can hit another sphere only in the directions of
the *coherence condition* (:mod:`.condition`): so each cell lists the items for which one of its
directions is among these, those first that may be nearest. Which part of the sphere the ray starts
in does not matter. Finding the list takes the same time whatever the number of items, hence the
title of the paper (lecture, "Ray coherence", "Using coherence"; Ohta and Maekawa 1987).

It is for all rays that have a sphere to leave: reflected, refracted and ambient ones leave the item
they come from. Lights are spheres as well, most of them without a radius, and a shadow ray leaves
that of its light if it is seen backwards (:mod:`.cubes`).

There are as many lists as items and lights times cells, and most are never asked for: a list is
made when the first ray comes to its cell (:mod:`.making`). A ray's list is the same whatever other
rays there are, so hits and counters depend on nothing else. Where lists become too many, all are
thrown away and made again for the rays that are left.

A ray that does not start in the sphere that it says it leaves is no ray of these cubes: all items
are tested.

M. Ohta, M. Maekawa: Ray Coherence Theorem and Constant Time Ray Tracing Algorithm, Computer
Graphics 1987 (Proceedings of CG International), 303-314.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...contract.cells import Cells, rectangles
from ...contract.counters import N_EETS, N_ETS, N_IT, N_TS, STRANGERS
from ...contract.events import NONE as NO_CELL
from ...contract.events import SKIP, STRANGER, VISIT_EMPTY, VISIT_LEAF, note
from ...contract.figures import (
    LEAF_SIZES,
    LIST_SHARE,
    MEAN_LEAF_SIZE,
    N_EV,
    N_OIV,
    N_V,
    REFERENCES_KEPT,
    Figure,
)
from ...contract.instances import Instances
from ...contract.lazy import CELLS_MADE, Finished, MadeByRays, Making
from ...contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ...contract.needs import GEOMETRY, LIGHTS
from ...contract.statistics import Statistics
from ...contract.structure import arrays_in
from ...contract.walk import Found, missing, walk
from ...geometry.box_shape import surface_area
from ...geometry.cones import ConeArrays
from ...geometry.rays import ALL, ANY, RayArrays, Rays, make_probe
from ...kernels import call, implements, kernel, whole
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.camera_rays import AMBIENT, REFLECTED, REFRACTED, SHADOW
from ...scene.surfaces import OFF_THE_FACE
from ...settings import setting
from ..directional.faces import cube, out_of_face, solid_angles
from ..directional.structure import LIST_OVER_EXACT, slack_of
from .condition import EXACT, LECTURE
from .cubes import NO_LIST, NONE, Cubes, belongs_to, list_at, squares_of
from .making import AT_ONCE, Known, count_exact, mark_cells, mark_items, with_lists
from .spheres import Tree, balls_of, balls_of_lights, tree_of

LARGEST, SMALLEST, OF_POINT = 0.2, 0.01, 0.05
"""Half the edge of a cube that is drawn, at most and at least, in the scene's diagonals: else it
is the radius of its sphere. That of a light without a radius is larger than the least."""

VALIDATED = 100
"""Lists of which it is asked of all items whether they belong there."""

FEWEST, MOST, FOR_EACH = 4, 16, 4
"""See :func:`cells_for`. More than so many would take more memory than they save tests."""

CUBES_MADE = Figure("cubes_made", "items and lights with a cube, to which rays have come",
                    "Cubes made", "count")  # fmt: skip
MADE_SHARE = Figure("made_share", "cells that rays have come to / cells that there might be",
                    "Share made")  # fmt: skip
MEAN_LIST = Figure("mean_list", "length of lists, on average over all directions that have one",
                   "Mean list", section="Lists", column="mean list")  # fmt: skip
OVER_EXACT = LIST_OVER_EXACT._replace(
    meaning="references / references that the exact bound has in the same cells"
)  # fmt: skip
TIMES_DROPPED = Figure("times_dropped", "how often all lists were thrown away",
                       "Lists thrown away", "count", section="Lists")  # fmt: skip

COUNTERS = N_TS, N_ETS, N_EETS, N_IT, STRANGERS
MISSED = missing(COUNTERS)


@dataclass(frozen=True)
class RayCoherenceSettings:
    """How cubes are divided, what their cells list, and how much is kept."""

    cells: int = setting(
        0, "Cells", "Cells along an edge of a face of a cube; by itself, more where there are more "
        f"items, from {FEWEST} to {MOST}", unit="cells", minimum=0, maximum=128, unset="auto",
    )  # fmt: skip
    light_cells: int = setting(
        64, "Light Cells", "The same of a light, which is often far away: most of its cells see "
        "nothing, and there are few lights", unit="cells", minimum=1, maximum=1024,
    )  # fmt: skip
    bound: str = setting(
        EXACT,
        "Bound",
        "The angle within which rays from one sphere may hit another",
        choices={
            EXACT: "The sine is (R1 + R2) / d, as far as such rays go",
            LECTURE: "Its square is, as on the lecture's slide: 2 to 10 times the solid angle",
        },
    )
    most_references: int = setting(
        50_000_000, "Most References", "All lists are thrown away if more is stored, and made "
        "again for the rays that are left", unit="references", minimum=1, maximum=1_000_000_000,
    )  # fmt: skip


def cells_for(n_items: int) -> int:
    """Return how many cells a face has along its edge where that is not said.

    As many as make one cell for every FOR_EACH items: what small spheres that are far away add to
    its list stays the same, however many there are.
    """
    return int(min(max(round((n_items / (6 * FOR_EACH)) ** 0.5), FEWEST), MOST))


@implements(walk, Cubes, inline=True)
def walk_list(structure, geometry, ray, number, workspace, log):
    """Test what a ray's cell lists until nothing nearer can follow; for a stranger, all items."""
    best, belongs = NOTHING, belongs_to(structure, ray)
    is_known = belongs.sphere >= 0
    slot, stop, cell, empty = whole(0), whole(0), whole(NO_CELL), 0
    if is_known:
        own = list_at(structure, belongs.sphere, belongs.cell)
        if own < 0:
            place = float(belongs.sphere * structure.stride + belongs.cell)
            return Found(place, MISSED.primitive, MISSED.counts)
        slot, stop, cell = structure.first[own], structure.last[own], own + 1
        empty = 1 if slot == stop else 0
        note(log, VISIT_EMPTY if empty else VISIT_LEAF, cell, NO_CELL, ray.t_min, ray.t_max)
    else:
        note(log, STRANGER, NO_CELL, NO_CELL, ray.t_min, ray.t_max)
    # Of the direction; the squares of its own numbers might leave the range of float64.
    length = (1.0 + ray.shear_x * ray.shear_x + ray.shear_y * ray.shear_y) ** 0.5 / abs(ray.shear_z)
    while True:
        begin, end = whole(0), whole(len(geometry.ids))
        if is_known:
            # From its light on, a shadow ray is as long as it is, whatever it has hit.
            limit = ray.t_max - ray.t_min
            if not belongs.is_backward:
                limit = best.t if best.t < ray.t_max and ray.query != ALL else ray.t_max
            if slot >= stop:
                break
            if structure.nearest[slot] > limit * length:
                note(log, SKIP, cell, NO_CELL, limit, limit)
                break
            begin = whole(structure.references[slot])
            end = begin + 1
            slot += 1
        best = test_leaf(
            geometry, None, False, begin, end, ray, number, workspace, log, cell, ray.t_min,
            EVERYWHERE, True, best,
        )  # fmt: skip
        if not is_known or (ray.query == ANY and best.primitive >= 0):
            break
    visits = 1 if is_known else 0
    return Found(best.t, best.primitive, (visits, visits, empty, best.tests, 1 - visits))


@kernel
def find_cells(structure, reach, rays, spheres, cells):
    """Write the sphere and the cell of every ray."""
    for i in range(len(cells)):
        belongs = belongs_to(structure, make_probe(rays, i, reach))
        spheres[i], cells[i] = belongs.sphere, belongs.cell


class RayCoherence(MadeByRays):
    """Cubes of directions in the spheres of items and lights."""

    name = "ray_coherence"
    label = "Ray Coherence"
    summary = "A cube of directions in the sphere of every item and light, for rays that leave it"
    Settings = RayCoherenceSettings
    COUNTERS = COUNTERS
    answers = (SHADOW, REFLECTED, REFRACTED, AMBIENT)
    needs = frozenset({GEOMETRY, LIGHTS})
    FIGURES: ClassVar[tuple[Figure, ...]] = (
        N_V, N_EV, N_OIV, MEAN_LEAF_SIZE, CUBES_MADE, CELLS_MADE, MADE_SHARE,
        MEAN_LIST, LIST_SHARE, OVER_EXACT, REFERENCES_KEPT, TIMES_DROPPED, LEAF_SIZES,
    )  # fmt: skip
    BYTES_PER_TRIANGLE = 600
    """Copies of items, their corners, boxes and spheres, and the tree of these."""

    arrays: Cubes

    def __init__(
        self, scene: Scene, settings: RayCoherenceSettings, cubes: Cubes, tree: Tree, geometry: Any
    ) -> None:
        super().__init__(scene, settings, cubes, geometry)
        self.tree = tree
        nothing = np.zeros(0, np.int32)
        self.making = Making(cubes, Known(nothing, nothing, np.zeros(1, np.int64)))

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: RayCoherenceSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> RayCoherence:
        """Put spheres around all items; lists are made by rays.

        Raises
        ------
        InputError
            If that does not fit into memory.
        """
        cls.refuse_too_large(scene, settings)
        geometry = scene.items()
        balls, lights = balls_of(geometry, progress), balls_of_lights(scene.lights)
        slack = 2.0 * OFF_THE_FACE * scene.diagonal + slack_of(scene, lights[:, :3])
        size = np.repeat(
            [settings.cells or cells_for(len(scene)), settings.light_cells],
            [len(balls), len(lights)],
        ).astype(np.int32)
        starts = geometry.first if isinstance(geometry, Instances) else np.zeros(0, np.int64)
        cubes = Cubes(
            np.concatenate([balls, lights]), len(balls), starts, slack, size,
            6 * int(size.max()) ** 2 + 1, np.full(len(size), NONE, np.int64), np.zeros(0, np.int32),
            np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(0),
        )  # fmt: skip
        return cls(scene, settings, cubes, tree_of(balls, progress), geometry)

    def _trace_all(
        self,
        rays: RayArrays | ConeArrays,
        order: np.ndarray | None,
        threads: int,
        progress: Progress,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trace rays, make the lists that they miss, and trace those again, until none does."""

        def make(cubes: Cubes, where: np.ndarray, told: Progress) -> Cubes:
            spheres, cells = np.divmod(np.unique(where), cubes.stride)
            return self.with_lists(spheres, cells, told)

        count = len(next(arrays_in(rays)))
        out, told = self._room_for(count), Finished(progress, count, self.name)
        waiting = np.arange(count) if order is None else order
        self._trace_in_passes(self.arrays, rays, waiting, out, threads, told, make)
        return out

    def with_lists(
        self, spheres: np.ndarray, cells: np.ndarray, progress: Progress = SILENT
    ) -> Cubes:
        """Make lists, as many of those asked for as may be kept; return all there are then.

        Parameters
        ----------
        spheres, cells : (n,) int
            Whose; each once.

        Raises
        ------
        InputError
            When they do not fit into memory.
        Cancelled
            From `progress`.
        """
        with self.making.lock:
            start, before = time.perf_counter(), self.known
            is_exact, most = self.settings.bound == EXACT, self.settings.most_references
            cubes, known, count = with_lists(
                self.arrays, before, self.tree, spheres, cells, is_exact, most, progress
            )
            self.making.dropped += int(before.used[0] >= most)
            self._keep(cubes, count, time.perf_counter() - start, known)
        return cubes

    def cells_of(self, rays: Rays) -> tuple[np.ndarray, np.ndarray]:
        """Return the sphere and the cell of each ray, (n,) int64 each; NONE for strangers.

        Spheres are those of all items, then those of all lights.
        """
        spheres, cells = np.empty(len(rays), np.int64), np.empty(len(rays), np.int64)
        call(find_cells, self.arrays, self.geometry.reach, rays.arrays(), spheres, cells)
        return spheres, cells

    def list_of(self, sphere: int, cell: int) -> tuple[np.ndarray, np.ndarray]:
        """Return what a cell lists: items, and how far away each is at least; made if need be."""
        cubes = self.arrays
        if list_at(cubes, sphere, cell) < 0:
            cubes = self.with_lists(np.array([sphere]), np.array([cell]))
        number = int(list_at(cubes, sphere, cell))
        part = slice(int(cubes.first[number]), int(cubes.last[number]))
        return cubes.references[part], cubes.nearest[part]

    def cells_that_see(self, sphere: int, item: int) -> np.ndarray:
        """Say which cells of a sphere's cube list an item, (6 size^2,) bool; none is made."""
        found = np.zeros(6 * int(self.arrays.size[sphere]) ** 2, np.bool_)
        is_exact = self.settings.bound == EXACT
        call(mark_cells, self.arrays, sphere, item, is_exact, found)
        return found

    def memory(self) -> int:
        """Return the bytes of the cubes and their lists, and of what is kept for making more."""
        kept = arrays_in((self.known, self.tree))
        return super().memory() + sum(array.nbytes for array in kept)

    def sizes(self) -> np.ndarray:
        """Return how many items each list has, (n_lists,); 0 for those thrown away."""
        sizes: np.ndarray = self.arrays.last - self.arrays.first
        return sizes

    def weights(self) -> np.ndarray:
        """Return the share of all directions that goes through each cell, (n_lists,)."""
        known = self.known
        u, v, width, _ = squares_of(self.arrays.size[known.sphere], known.cell)
        return solid_angles(u, v, u + width, v + width) / (4.0 * np.pi)

    def half_edges(self) -> np.ndarray:
        """Return half the edge of the cube of each sphere, as it is drawn, (m,)."""
        radii, diagonal = self.arrays.balls[:, 3], self.scene.diagonal
        half = np.clip(np.nan_to_num(radii), SMALLEST * diagonal, LARGEST * diagonal)
        return np.where(radii > 0.0, half, OF_POINT * diagonal)

    def corners_of(self, spheres: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the corners of cells of cubes as they are drawn, (n, 4, 3), once around."""
        u, v, width, face = squares_of(self.arrays.size[spheres], cells)
        back = cube(np.zeros(3)).back[face].transpose(1, 2, 0)
        half, centres = self.half_edges()[spheres, None], self.arrays.balls[spheres, :3]
        return np.stack(
            [
                centres + half * np.stack(out_of_face(back, u + x, v + y), axis=1)
                for x, y in ((0.0 * u, 0.0 * u), (width, 0.0 * u), (width, width), (0.0 * u, width))
            ],
            axis=1,
        )

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the cells that rays have come to, as squares of cubes around their spheres.

        Cell 0 is the box of the scene; that of list k is cell k + 1.
        """
        progress.report(0, 1, "Listing the cells of cubes")
        known, scene, n_items = self.known, self.scene, self.arrays.n_items
        places = self.corners_of(known.sphere, known.cell)
        boxes = np.concatenate([places.min(axis=1), places.max(axis=1)], axis=1)
        number = np.arange(len(places) + 1)
        is_leaf = number > 0
        # Of both sides, as surfaces have them.
        widths = 2.0 / self.arrays.size * self.half_edges()
        around = np.concatenate([scene.lower, scene.upper])[None]
        return Cells(
            np.concatenate([around, boxes]), number.astype(np.int32),
            is_leaf.astype(np.int32), is_leaf, np.append(0, self.sizes()).astype(np.int32),
            {
                "item": np.append(NONE, np.where(known.sphere < n_items, known.sphere, NONE)),
                "light": np.append(NONE, np.maximum(known.sphere - n_items, NONE)),
            },
            faces=rectangles(places, number[1:]) if len(places) else None,
            areas=np.append(surface_area(around), 2.0 * widths[known.sphere] ** 2),
            parent=np.where(is_leaf, 0, -1).astype(np.int32),
            is_box=~is_leaf,
        )  # fmt: skip

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the lists that there are."""
        cubes, n_lists = self.arrays, len(self.known.cell)
        count, weights = self.sizes(), self.weights()
        mean = float((weights * count).sum() / (weights.sum() or 1.0))
        references, exact = int(count.sum()), 0
        for begin in range(0, n_lists, AT_ONCE):
            progress.report(begin, n_lists, f"Measuring {self.name}")
            end = min(begin + AT_ONCE, n_lists)
            exact += int(
                call(count_exact, self.arrays, self.known.sphere, self.known.cell, begin, end)
            )
        extra = {
            "cubes_made": int((cubes.cube >= 0).sum()),
            "cells_made": self.made().cells,
            "made_share": n_lists / float((6 * cubes.size.astype(np.int64) ** 2).sum()),
            "mean_list": mean,
            "list_share": mean / len(self.scene),
            "list_over_exact": references / exact if exact else 1.0,
            "references_kept": int(self.known.used[0]),
            "times_dropped": self.making.dropped,
        }
        is_leaf = np.ones(n_lists, bool)
        depth = np.ones(n_lists, np.int64)
        return Statistics.of_cells(weights, is_leaf, count, depth, 1.0, 0.0, 1.0, extra)

    def validate(self) -> list[str]:
        """Check that lists are in order, and of some that they have what their cells see, once."""
        cubes, known, violations = self.arrays, self.known, []
        numbers = np.flatnonzero(cubes.first != NO_LIST)
        asked = set(numbers[:: max(len(numbers) // VALIDATED, 1)].tolist())
        seen = np.zeros(cubes.n_items, np.bool_)
        for number in numbers.tolist():
            sphere, cell = int(known.sphere[number]), int(known.cell[number])
            if cubes.number[cubes.cube[sphere] + cell] != number:
                violations.append(f"list {number} is not that of its cell")
            listed, nearest = self.list_of(sphere, cell)
            if (np.diff(nearest) < 0.0).any():
                violations.append(f"list {number} is out of order")
            if number in asked:
                call(mark_items, cubes, sphere, cell, self.settings.bound == EXACT, seen)
                if not np.array_equal(np.sort(listed), np.flatnonzero(seen)):
                    violations.append(f"list {number} has not what its cell sees, each once")
        return violations


STRUCTURE = RayCoherence
