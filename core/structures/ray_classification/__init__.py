"""5D ray classification: rays that are much alike share the list of what they may hit.

A ray is a point of *ray space*: where it begins, three numbers, and where it goes, two
(:mod:`.ray_space`). Six boxes of that, one for each main direction, are divided in two, again and
again, where rays are. A cell holds a bundle of rays, which all together pass a *beam*
(:mod:`.beam`); what reaches into the beam is the cell's list of *candidates*. They are sorted along
the main axis, so a ray stops at the first candidate that begins behind its hit (lecture, "5D ray
space", "Ray classification"; Arvo and Kirk 1987).

Cells are made when rays come to them, and divided when many of a batch do (:mod:`.making`): most of
ray space is never seen. So what is counted depends on the batch, and on those before, but neither
on the order of its rays nor on threads. With ``dimensions=6`` the time is divided as well, for what
moves.

J. Arvo, D. Kirk: Fast Ray Tracing by Ray Classification, SIGGRAPH 1987. M. Quail: Space Time
Ray-Tracing Using Ray Classification, thesis, Macquarie University, 1996 (the time).
"""

from __future__ import annotations

import time
from typing import Any, ClassVar

import numpy as np

from ...contract.cells import Cells
from ...contract.counters import N_EETS, N_ETS, N_IT, N_TS, STRANGERS, VOLUME_TESTS
from ...contract.events import (
    NONE,
    SKIP,
    STRANGER,
    VISIT_EMPTY,
    VISIT_LEAF,
    VOLUME_TEST,
    no_log,
    note,
)
from ...contract.figures import (
    LEAF_SIZES,
    LIST_SHARE,
    MAX_DEPTH,
    MEAN_LEAF_SIZE,
    N_EV,
    N_IN,
    N_OIV,
    N_V,
    REFERENCES_KEPT,
    Figure,
)
from ...contract.lazy import CELLS_MADE, Finished, MadeByRays, Making
from ...contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ...contract.needs import GEOMETRY
from ...contract.statistics import Statistics
from ...contract.structure import arrays_in
from ...contract.walk import Found, missing, walk
from ...geometry.box import span_box
from ...geometry.cones import ConeArrays
from ...geometry.rays import ALL, ANY, RayArrays, Rays, make_probe
from ...geometry.shapes import shapes_of
from ...kernels import call, implements, kernel, whole
from ...progress import SILENT, Progress
from ...ranges import longer
from ...scene import Scene
from . import ray_space
from .back_faces import is_behind, normals_of
from .making import SIMILAR, Rule, make, ordered, roots_of, without_old
from .ray_space import LEAF, NO_LIST, UNMADE, find_cell, is_known, slack_of
from .settings import CHUNK, EQUAL, KEEP, MUCH_ALIKE, RayClassificationSettings

MADE_SHARE = Figure("made_share", "cells that rays have come to / cells there are", "Share made")
MEAN_LIST = Figure("mean_list", "length of lists, on average over all of ray space that is made",
                   "Mean list", section="Lists", column="mean list")  # fmt: skip
LISTS_DROPPED = Figure("lists_dropped", "lists that were thrown away", "Lists thrown away", "count",
                       section="Lists")  # fmt: skip


COUNTERS = N_TS, N_ETS, N_EETS, N_IT, VOLUME_TESTS, STRANGERS
MISSED = missing(COUNTERS)


@implements(walk, ray_space.Cells, inline=True)
def walk_cells(structure, geometry, ray, number, workspace, log):
    """Find the cell of a ray, and test its candidates until nothing nearer can follow."""
    best, culls = NOTHING, len(structure.normals) > 0
    enter, leave = span_box(structure.box, 0, ray, np.inf)
    note(log, VOLUME_TEST, NONE, NONE, enter if enter <= leave else np.inf, leave)
    if enter > leave or enter > ray.t_max:
        return Found(best.t, best.primitive, (0, 0, 0, 0, 1, 0))
    if not is_known(structure, ray):
        note(log, STRANGER, NONE, NONE, ray.t_min, ray.t_max)
        for i in range(len(geometry.ids)):
            item = whole(i)
            if culls and is_behind(structure.normals, item, ray.dx, ray.dy, ray.dz):
                continue
            best = test_leaf(
                geometry, None, False, item, item + 1, ray, number, workspace, log, whole(NONE),
                ray.t_min, EVERYWHERE, True, best,
            )  # fmt: skip
            if ray.query == ANY and best.primitive >= 0:
                break
        return Found(best.t, best.primitive, (0, 0, 0, best.tests, 1, 1))
    cell, steps = find_cell(structure, ray, enter, log)
    slot, stop = structure.first[cell], structure.last[cell]
    if slot == NO_LIST or structure.is_open[cell] != 0:
        return Found(float(cell), MISSED.primitive, MISSED.counts)
    structure.used[cell] = structure.now
    empty = 1 if slot == stop else 0
    note(log, VISIT_EMPTY if empty else VISIT_LEAF, cell, NONE, enter, leave)
    a, root = whole(ray.kz), whole(0)
    along, origin = ray.dx, ray.ox
    if a == 1:
        along, origin = ray.dy, ray.oy
    elif a == 2:
        along, origin = ray.dz, ray.oz
    root = 2 * a + (1 if along < 0.0 else 0)
    if along < 0.0:
        along, origin = -along, -origin
    while slot < stop:
        limit = best.t if best.t < ray.t_max and ray.query != ALL else ray.t_max
        item = whole(structure.references[slot])
        if structure.nearest[root, item] > origin + limit * along + structure.slack:
            note(log, SKIP, cell, NONE, limit, limit)
            break
        slot += 1
        if culls and is_behind(structure.normals, item, ray.dx, ray.dy, ray.dz):
            continue
        best = test_leaf(
            geometry, None, False, item, item + 1, ray, number, workspace, log, cell, enter,
            EVERYWHERE, True, best,
        )  # fmt: skip
        if ray.query == ANY and best.primitive >= 0:
            break
    return Found(best.t, best.primitive, (steps + 1, 1, empty, best.tests, 1, 0))


@kernel
def find_cells(structure, reach, rays, log, cells):
    """Write the cell of every ray."""
    for i in range(len(cells)):
        ray = make_probe(rays, i, reach)
        enter, leave = span_box(structure.box, 0, ray, np.inf)
        cell = whole(NONE)
        if enter <= leave:
            cell, _ = find_cell(structure, ray, enter, log)
        cells[i] = cell


class RayClassification(MadeByRays):
    """Cells of ray space with lists of candidates."""

    name = "ray_classification"
    label = "Ray Classification"
    summary = "Cells of 5D ray space, made when rays come to them"
    Settings = RayClassificationSettings
    COUNTERS = COUNTERS
    needs = frozenset({GEOMETRY})
    FIGURES: ClassVar[tuple[Figure, ...]] = (
        N_IN, N_V, N_EV, N_OIV, MAX_DEPTH, MEAN_LEAF_SIZE, CELLS_MADE, MADE_SHARE,
        MEAN_LIST, LIST_SHARE, REFERENCES_KEPT, LISTS_DROPPED, LEAF_SIZES,
    )  # fmt: skip
    BYTES_PER_TRIANGLE = 480
    """Where items begin and end along six axes, their order, shapes and boxes."""

    def __init__(self, scene: Scene, settings: RayClassificationSettings, geometry: Any) -> None:
        super().__init__(scene, settings, None, geometry)
        slack = slack_of(geometry.reach)
        self.rule = Rule(
            settings.max_list_size, settings.max_depth, settings.min_rays,
            int(settings.dimensions), settings.truncate,
            {KEEP: -1.0, EQUAL: 0.0, MUCH_ALIKE: SIMILAR}[settings.merge], slack, settings.cull,
        )  # fmt: skip
        self.shapes, self.items = shapes_of(geometry, slack), ordered(scene.boxes())
        box = np.concatenate([scene.lower, scene.upper])
        cells, known = roots_of(box, slack, self.items)
        if settings.cull:
            cells = cells._replace(normals=normals_of(scene))
        self.making = Making(cells, known)
        self.used = np.array([len(self.arrays.children), 0])

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: RayClassificationSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> RayClassification:
        """Sort the items along the axes; cells are made by rays."""
        cls.refuse_too_large(scene, settings)
        return cls(scene, settings, scene.items())

    def _trace_all(
        self,
        rays: RayArrays | ConeArrays,
        order: np.ndarray | None,
        threads: int,
        progress: Progress,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trace rays; if lists are thrown away, some of them after the other."""
        count, most = len(next(arrays_in(rays))), self.settings.most_references
        order = np.arange(count) if order is None else order
        out, told = self._room_for(count), Finished(progress, count, self.name)
        chunk = CHUNK if most else count
        for begin in range(0, count, chunk):
            self._trace_batch(rays, order[begin : begin + chunk], out, threads, told)
            if most:
                self._throw_away(most)
        return out

    def _trace_batch(
        self,
        rays: RayArrays | ConeArrays,
        waiting: np.ndarray,
        out: tuple[np.ndarray, np.ndarray, np.ndarray],
        threads: int,
        told: Finished,
    ) -> None:
        """Trace rays, make the cells that they miss, and trace those again, until none does."""
        with self.making.lock:  # both of the same moment
            cells: ray_space.Cells = self.arrays
            is_long = self.sizes() > self.rule.max_list_size
            is_open = (cells.children == LEAF) & is_long & (self.known.depth < self.rule.max_depth)
        cells = cells._replace(is_open=is_open.astype(np.uint8))
        self._trace_in_passes(cells, rays, waiting, out, threads, told, self._make)

    def _make(
        self, seen: ray_space.Cells, where: np.ndarray, progress: Progress
    ) -> ray_space.Cells:
        """Make the cells in which rays wait, or divide them, or decide not to."""
        with self.making.lock:
            start = time.perf_counter()
            cells: ray_space.Cells = self.arrays
            numbers, rays = np.unique(where, return_counts=True)
            count = int((cells.first[numbers] == NO_LIST).sum())
            cells, known = make(
                cells, self.known, self.used, numbers, rays, self.rule, self.shapes, self.items,
                progress,
            )  # fmt: skip
            cells = cells._replace(
                now=cells.now + 1, is_open=longer(seen.is_open, len(cells.children))
            )
            cells.is_open[numbers] = 0
            self._keep(cells, count, time.perf_counter() - start, known)
        return cells

    def _throw_away(self, most: int) -> None:
        """Keep so many references at most."""
        making = self.making
        with making.lock:
            if int(self.used[1]) > most:
                making.arrays, count = without_old(making.arrays, self.used, most)
                making.dropped += count

    def cells_of(self, rays: Rays) -> np.ndarray:
        """Return the cell of each ray, (n,) int64; NONE for those that miss the scene's box."""
        cells = np.empty(len(rays), np.int64)
        call(find_cells, self.arrays, self.geometry.reach, rays.arrays(), no_log(), cells)
        return cells

    def memory(self) -> int:
        """Return the bytes of the cells and their lists, and of what is kept for making more."""
        kept = arrays_in((self.known, self.items))
        return super().memory() + sum(array.nbytes for array in kept)

    @property
    def is_made(self) -> np.ndarray:
        """Which cells rays have come to, (n,) bool."""
        is_made: np.ndarray = self.arrays.children != UNMADE
        return is_made

    def sizes(self) -> np.ndarray:
        """Return how many candidates each cell lists, (n,); 0 for those without a list."""
        sizes: np.ndarray = self.arrays.last - self.arrays.first
        return sizes

    def volumes(self) -> np.ndarray:
        """Return the share of ray space that each cell is, (n,); dimensions without an extent do
        not count.
        """
        bounds = self.known.bounds
        extents = bounds[:, 1] - bounds[:, 0]
        has_extent = extents[0] > 0.0
        shares = (extents[:, has_extent] / extents[0, has_extent]).prod(axis=1)
        return np.asarray(shares) / ray_space.ROOTS

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return all cells there are, as the boxes in which their rays begin."""
        progress.report(0, 1, "Listing the cells of ray space")
        bounds, is_leaf = self.known.bounds, self.arrays.children < 0
        return Cells.sorted_by_depth(
            bounds[:, :, :3].reshape(-1, 6), self.known.depth, is_leaf,
            np.where(is_leaf, self.sizes(), 0),
            {
                "is_made": self.is_made, "root": self.known.root,
                **{
                    f"{name}{key}": bounds[:, key, dimension]
                    for dimension, name in ((ray_space.U, "u"), (ray_space.V, "v"),
                                            (ray_space.TIME, "time"))
                    for key in range(2)
                },
            },
            parent=self.known.parent,
        )  # fmt: skip

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of all cells there are; those not made yet are empty leaves."""
        is_leaf, is_made = self.arrays.children < 0, self.is_made
        count = np.where(is_leaf, self.sizes(), 0)
        volumes = self.volumes()
        seen = np.where(is_leaf & is_made, volumes, 0.0)
        mean = float((seen * count).sum() / (seen.sum() or 1.0))
        extra = {
            "cells_made": self.made().cells,
            "made_share": float(is_made.mean()),
            "mean_list": mean,
            "list_share": mean / len(self.scene),
            "references_kept": int(self.used[1]),
            "lists_dropped": self.making.dropped,
        }
        return Statistics.of_cells(volumes, is_leaf, count, self.known.depth, 1.0, 0.0, 1.0, extra)

    def validate(self) -> list[str]:
        """Check that halves make a cell, and that lists are in order and hold items once."""
        arrays, known, violations = self.arrays, self.known, []
        inner = np.flatnonzero(arrays.children >= 0)
        for side in range(2):
            child = arrays.children[inner] + side
            if (known.parent[child] != inner).any():
                violations.append("a cell is not the child of the one that has it")
            expected = known.bounds[inner].copy()
            row = np.arange(len(inner))
            expected[row, 1 - side, arrays.dimension[inner]] = arrays.plane[inner]
            if not np.array_equal(expected, known.bounds[child]):
                violations.append("the halves of a cell are not its halves")
        for cell in np.flatnonzero(arrays.first != NO_LIST).tolist():
            listed = arrays.references[arrays.first[cell] : arrays.last[cell]]
            nearest = arrays.nearest[known.root[cell], listed]
            if (np.diff(nearest) < 0.0).any() or len(np.unique(listed)) < len(listed):
                violations.append(f"the list of cell {cell} is out of order, or has an item twice")
        return violations


STRUCTURE = RayClassification
