"""List of sorted volumes: the lecture's "efficient algorithm" without a hierarchy.

1. The ray is tested with the bounding volumes of all objects.
2. The volumes it hits are sorted by where it enters them.
3. The objects inside are tested in that order. As soon as the nearest hit lies before the next
   volume, the others cannot have a nearer one: the walk ends early.

It remains O(N) in the number of objects, but most of them are never looked into. The volumes wait
in a heap, so that only those are put in order that are needed.

An object is one of the scene's. A scene of only one is cut into parts of equally many triangles:
always the largest part, at the median along its longest axis.
"""

from __future__ import annotations

import heapq
import itertools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.cells import Cells
from ..contract.costs import intersection_cost, traversal_cost
from ..contract.counters import CELLS_SKIPPED, N_ETS, N_IT, N_TS, VOLUME_TESTS
from ..contract.events import JUMP, NONE, SKIP, VISIT_LEAF, VOLUME_TEST, note
from ..contract.figures import COST_OF_CELLS, EXPECTED_VOLUME_TESTS, OF_CELLS
from ..contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ..contract.statistics import Statistics
from ..contract.structure import Structure
from ..contract.walk import Found, walk
from ..contract.workspace import Workspace, make_workspace
from ..geometry.box_shape import surface_area
from ..geometry.fit import fit_all, sticking_out
from ..geometry.geometry import hulls_of
from ..geometry.kinds import COMBINED, KINDS
from ..geometry.rays import ALL, ANY
from ..geometry.volume import MISS, enter, prepare
from ..kernels import implements, inner, whole
from ..progress import SILENT, Progress
from ..scene import Scene
from ..settings import setting


@dataclass(frozen=True)
class SortedVolumesSettings:
    """Settings of the list of sorted volumes."""

    volume: str = setting(
        "aabb",
        "Volume",
        "What is put around the triangles of an object",
        choices={name: text for name, (text, _) in (KINDS | COMBINED).items()},
    )
    parts: int = setting(
        64,
        "Parts",
        "Into how many objects a scene is cut that has only one",
        unit="objects",
        minimum=1,
        maximum=65536,
    )
    C_trav: float = traversal_cost(is_flat=True)
    C_isect: float = intersection_cost()


class VolumeList(NamedTuple):
    """Objects with volumes as the walk sees them.

    Attributes
    ----------
    volumes : NamedTuple of arrays
        The volume of every object; its type says of what kind.
    offsets : (n_objects + 1,) int64
        Object i has the triangles ``offsets[i] ... offsets[i + 1] - 1``.
    """

    volumes: Any
    offsets: np.ndarray


@inner
def is_before(cells, enters, i, j):
    """Say whether entry i of the heap comes before entry j: entered first, of equals the lower."""
    return enters[i] < enters[j] or (enters[i] == enters[j] and cells[i] < cells[j])


@inner
def put(cells, enters, size, cell, t):
    """Add a volume to the heap of `size` entries."""
    cells[size], enters[size] = cell, t
    i = size
    while i > 0 and is_before(cells, enters, i, (i - 1) // 2):
        above = (i - 1) // 2
        cells[i], cells[above] = cells[above], cells[i]
        enters[i], enters[above] = enters[above], enters[i]
        i = above


@inner
def remove_first(cells, enters, size):
    """Take the first volume out of the heap of `size` entries."""
    last = size - 1
    cells[0], enters[0] = cells[last], enters[last]
    i, below = 0, 1
    while below < last:
        if below + 1 < last and is_before(cells, enters, below + 1, below):
            below += 1
        if not is_before(cells, enters, below, i):
            break
        cells[i], cells[below] = cells[below], cells[i]
        enters[i], enters[below] = enters[below], enters[i]
        i, below = below, 2 * below + 1


@implements(walk, VolumeList, inline=True)
def walk_sorted(structure, geometry, ray, number, workspace, log):
    """Test all volumes, then objects in the order in which the ray enters them.

    A volume entered exactly at the hit is still looked into: of equal t the lowest triangle wins.
    """
    volumes, offsets = structure.volumes, structure.offsets
    cells, enters, strips = workspace.cells, workspace.enters, workspace.frame
    best = NOTHING
    limit = ray.t_max
    objects, waiting = 0, 0

    prepare(volumes, ray, strips)
    for i in range(len(offsets) - 1):
        t = enter(volumes, i, ray, strips, limit)
        note(log, VOLUME_TEST, i, NONE, t, t)
        if t != MISS:
            put(cells, enters, waiting, i, t)
            waiting += 1
    while waiting > 0 and enters[0] <= limit and not (ray.query == ANY and best.primitive >= 0):
        cell = whole(cells[0])
        objects += 1
        note(log, VISIT_LEAF, cell, NONE, enters[0], limit)
        best = test_leaf(
            geometry, None, False, offsets[cell], offsets[cell + 1], ray, number, workspace, log,
            cell, enters[0], EVERYWHERE, True, best,
        )  # fmt: skip
        if ray.query != ALL and best.primitive >= 0:
            limit = best.t
        remove_first(cells, enters, waiting)
        waiting -= 1
    for i in range(waiting):
        note(log, SKIP, whole(cells[i]), NONE, enters[i], limit)
    if waiting > 0:
        note(log, JUMP, NONE, waiting, limit, limit)

    n_volumes = len(offsets) - 1
    return Found(best.t, best.primitive, (objects, objects, best.tests, n_volumes, waiting))


class SortedVolumes(Structure):
    """Objects with volumes, tested in the order in which the ray enters them.

    Per ray, N_TS are the objects looked into, cells_skipped those whose volume is hit but which are
    never looked into since a hit lies before them. The volumes of all others are missed.
    """

    name = "sorted_volumes"
    label = "Sorted Volumes"
    summary = "All bounding volumes, sorted by where the ray enters them, with an early end"
    Settings = SortedVolumesSettings
    takes_cones = True
    COUNTERS = N_TS, N_ETS, N_IT, VOLUME_TESTS, CELLS_SKIPPED
    FIGURES = *OF_CELLS, *COST_OF_CELLS, EXPECTED_VOLUME_TESTS

    arrays: VolumeList
    BYTES_PER_TRIANGLE = 160

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: SortedVolumesSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> SortedVolumes:
        """Put the triangles of an object together and a volume around them."""
        cls.refuse_too_large(scene, settings)
        order, offsets = objects_of(scene, settings.parts, progress)
        items = scene.items(order)
        corners, places = hulls_of(items)
        volumes = fit_all(settings.volume, corners, offsets[:-1], offsets[1:], progress, places)
        return cls(scene, settings, VolumeList(volumes, offsets), items)

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the volumes of all objects; a cell's number is its object."""
        volumes, count = self.arrays.volumes, np.diff(self.arrays.offsets)
        numbers = np.arange(len(count))
        return Cells.sorted_by_depth(
            volumes.boxes(), np.zeros(len(count)), np.ones(len(count), dtype=bool), count,
            faces=volumes.polygons(numbers, progress), areas=volumes.areas(progress),
        )  # fmt: skip

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the list; areas are relative to that of the scene's box."""
        count = np.diff(self.arrays.offsets)
        box = np.concatenate([self.scene.lower, self.scene.upper])
        return Statistics.of_cells(
            self.arrays.volumes.areas(progress), np.ones(len(count), dtype=bool), count,
            np.zeros(len(count), dtype=np.int64), float(surface_area(box)),
            self.settings.C_trav, self.settings.C_isect, {"expected_volume_tests": len(count)},
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Check that objects partition the triangles and that volumes contain theirs."""
        violations = []
        offsets, ids = self.arrays.offsets, self.geometry.ids
        if offsets[0] != 0 or offsets[-1] != len(ids) or (np.diff(offsets) < 1).any():
            return ["the objects do not partition the triangles"]
        if not np.array_equal(np.sort(ids), np.arange(len(self.scene))):
            violations.append("the order of the triangles is not a permutation")
        corners, places = hulls_of(self.geometry)
        outsiders = sticking_out(self.arrays.volumes, corners, offsets[:-1], offsets[1:], places)
        if len(outsiders):
            violations.append(f"items stick out of {len(outsiders)} volumes")
        return violations

    def _workspace(self) -> Workspace:
        return make_workspace(cells=len(self.arrays.offsets) - 1)


def objects_of(scene: Scene, parts: int, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of the objects one after the other, and where each begins.

    Within an object they are sorted along its longest axis: unions cover its two halves.

    Returns
    -------
    order : (n,) int64
    offsets : (n_objects + 1,) int64

    Raises
    ------
    Cancelled
        From `progress`.
    """
    corners, places = hulls_of(scene.geometry)
    sums = np.add.reduceat(corners.mean(axis=1), places[:-1])
    centroids = sums / np.diff(places)[:, None]
    order = np.argsort(scene.object_ids, kind="stable")
    offsets = np.flatnonzero(np.diff(scene.object_ids[order], prepend=-1, append=-1))
    ranges = [(-(end - begin), begin) for begin, end in itertools.pairwise(offsets.tolist())]
    wanted = parts if len(ranges) == 1 else len(ranges)
    finished = 0
    heapq.heapify(ranges)
    # From the largest on: each is cut in two as long as parts are wanted, else sorted.
    done: list[int] = []
    while ranges:
        progress.report(finished, len(scene), "Dividing the scene")
        size, begin = heapq.heappop(ranges)
        end = begin - size
        points = centroids[order[begin:end]]
        axis = np.ptp(points, axis=0).argmax()
        order[begin:end] = order[begin:end][np.argsort(points[:, axis], kind="stable")]
        if len(ranges) + len(done) + 1 < wanted and end - begin > 1:
            middle = (begin + end) // 2
            heapq.heappush(ranges, (begin - middle, begin))
            heapq.heappush(ranges, (middle - end, middle))
        else:
            done.append(begin)
            finished += end - begin
    progress.report(finished, len(scene), "Dividing the scene")
    return order, np.array([*sorted(done), len(order)], dtype=np.int64)


STRUCTURE = SortedVolumes
