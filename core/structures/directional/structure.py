"""What structures of directional cells have in common: cells to draw, figures, checks."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import numpy as np

from ...contract.cells import Cells, rectangles
from ...contract.counters import N_EETS, N_ETS, N_IT, N_TS, STRANGERS, Counter
from ...contract.events import COVER, OVERLOOK, RECALL
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
from ...contract.statistics import Statistics
from ...contract.structure import Structure
from ...kernels import call, kernel, whole
from ...progress import SILENT, Progress
from ...ranges import ranges
from ...scene import Scene
from .faces import Faces, solid_angles
from .filling import AT_ONCE, lists_of
from .insertion import through_cell, view_of
from .items import ULPS, items_of
from .lists import NONE, Lists, Squares, cell_at, squares_of
from .merging import merged
from .projection import EXACT, Insertion, footprints_of
from .settings import METHODS, division_of

COVERED = Counter(
    "covered", "Covered cells", "rays whose cell one item covers before they begin", (COVER,),
)  # fmt: skip
RECALLED = Counter(
    "recalled", "Last occluder", "rays that are blocked by what has blocked another one last",
    (RECALL,), column="recalled",
)  # fmt: skip
OVERLOOKED = Counter(
    "overlooked", "Overlooked", "rays that are blocked by what was not drawn into their cell",
    (OVERLOOK,),
)  # fmt: skip

MEAN_LIST = Figure("mean_list", "length of lists, on average over all directions in which there is "
                   "something", "Mean list", section="Lists", column="mean list")  # fmt: skip
LIST_OVER_EXACT = Figure(
    "list_over_exact", "references / references that exact insertion into the same cells has",
    "Lists / exact lists", section="Lists",
)  # fmt: skip
COVERED_SHARE = Figure(
    "covered_share", "share of all directions that go through cells which one item covers",
    "Covered directions", section="Lists",
)  # fmt: skip
LONGEST_LIST = Figure("longest_list", "length of the longest list", "Longest list", "count",
                      section="Lists")  # fmt: skip


LARGEST, SMALLEST = 0.2, 0.05
"""Half the edge of a cube that is drawn, in the scene's diagonals."""

BEFORE = 0.57
"""That, in the way to the nearest item; more, and the corners would reach it."""


class Directional(Structure):
    """Cells of faces with lists of items."""

    COUNTERS = N_TS, N_ETS, N_EETS, N_IT, COVERED, RECALLED, OVERLOOKED, STRANGERS
    FIGURES: ClassVar[tuple[Figure, ...]] = (
        N_IN, N_V, N_EV, N_OIV, MAX_DEPTH, MEAN_LEAF_SIZE,
        MEAN_LIST, LIST_SHARE, LIST_OVER_EXACT, REFERENCES_KEPT, LONGEST_LIST, COVERED_SHARE,
        LEAF_SIZES,
    )  # fmt: skip
    BYTES_PER_TRIANGLE = 200
    """Copies of boxes, balls and corners, and the order of all items for both threads; lists are
    refused by themselves, when they are counted."""

    def __init__(
        self, scene: Scene, settings: Any, arrays: Any, insertion: Insertion, geometry: Any
    ) -> None:
        super().__init__(scene, settings, arrays, geometry)
        self.insertion = insertion

    @property
    def faces(self) -> Faces:
        """Of all origins, one after the other."""
        faces: Faces = self.arrays.faces
        return faces

    @property
    def lists(self) -> Lists:
        """All cells, with their lists."""
        lists: Lists = self.arrays.lists
        return lists

    @functools.cached_property
    def squares(self) -> Squares:
        """Where all cells lie."""
        return squares_of(self.lists, self.faces)

    @functools.cached_property
    def weights(self) -> np.ndarray:
        """The share of all directions that goes through each cell of a face, (n,).

        Of cubes the solid angle, of pictures and suns the area. All faces of one origin together
        have 1.
        """
        squares = self.squares
        u0, v0 = squares.u, squares.v
        u1, v1 = u0 + squares.width, v0 + squares.width
        angle = solid_angles(u0, v0, u1, v1)
        is_cube = self.is_of_cube[squares.face]
        return np.where(is_cube, angle / (4.0 * np.pi), 0.25 * squares.width**2)

    @property
    def is_of_cube(self) -> np.ndarray:
        """Which faces are those of cubes, (m,) bool."""
        is_cube: np.ndarray = self.faces.is_parallel == 0
        return is_cube

    @property
    def origin_of_face(self) -> np.ndarray:
        """Which cube, plane or picture each face is of, (m,) int."""
        return np.zeros(len(self.faces.origins), np.int64)

    @property
    def n_origins(self) -> int:
        """How many cubes, planes and pictures there are."""
        return int(self.origin_of_face.max()) + 1

    def cell_of(self, origin: int, direction: np.ndarray) -> int:
        """Return the leaf through which a direction goes from one of the origins.

        Parameters
        ----------
        origin : int
            Number of the light, or 0 for a picture.
        direction : (3,) float64

        Returns
        -------
        int
            NONE if it goes through no cell.
        """
        faces = self.faces
        # A cube has its six faces one after the other; of one that is none all are asked.
        of_origin = np.flatnonzero(self.origin_of_face == origin)
        for face in of_origin.tolist():
            u, v, w = faces.axes[face] @ np.asarray(direction, float)
            if w > 0.0 and max(abs(u), abs(v)) <= w:
                return int(cell_at(self.lists, face, u / w, v / w))
        return NONE

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return all cells as squares of cubes, planes and pictures, where they are drawn.

        ``space`` is that of objects: a cube is drawn around its origin.
        """
        squares, lists = self.squares, self.lists
        u, v, width, face = squares.u, squares.v, squares.width, squares.face
        places = np.stack(
            [
                self.drawn_at(face, u + width * du, v + width * dv)
                for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1))
            ],
            axis=1,
        )
        boxes = np.concatenate([places.min(axis=1), places.max(axis=1)], axis=1)
        is_leaf = lists.children < 0
        count = np.where(is_leaf, lists.last - lists.first, 0)
        return Cells.sorted_by_depth(
            boxes, squares.depth, is_leaf, count,
            {"covered": (is_leaf & (lists.cover >= 0)).astype(np.int32), "face": face},
            faces=rectangles(places, np.arange(len(u))),
            areas=_areas(places), parent=squares.parent,
        )  # fmt: skip

    def drawn_at(self, face: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return where places of faces are drawn, (n, 3)."""
        faces, size = self.faces, self.drawn_size
        back = faces.back[face]
        way = u[:, None] * back[:, 0] + v[:, None] * back[:, 1]
        is_parallel = faces.is_parallel[face].astype(bool)[:, None]
        ahead = np.where(is_parallel, -1.05 * 0.5 * self.scene.diagonal, size)
        return faces.origins[face] + way * np.where(is_parallel, 1.0, size) + back[:, 2] * ahead

    @functools.cached_property
    def drawn_size(self) -> float:
        """Half the edge of a cube, as it is drawn, and how far away a picture is.

        Cubes lie before what is seen from their centres, as far as these are not within it.
        """
        lists, diagonal = self.lists, self.scene.diagonal
        first = lists.first[(lists.last > lists.first) & self.is_of_cube[self.squares.face]]
        nearest = float(lists.nearest[first].min(initial=np.inf))
        return max(min(BEFORE * nearest, LARGEST * diagonal), SMALLEST * diagonal)

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of all cells together."""
        lists = self.lists
        is_leaf = lists.children < 0
        count = np.where(is_leaf, lists.last - lists.first, 0)
        weights = np.where(is_leaf, self.weights, 0.0) / self.n_origins
        is_seen = is_leaf & (count > 0)
        mean = float((weights * count).sum() / (weights[is_seen].sum() or 1.0))
        exact = self.exact_references(progress)
        extra = {
            "mean_list": mean,
            "list_share": mean / len(self.scene),
            "list_over_exact": int(count.sum()) / exact if exact else 1.0,
            "references_kept": len(lists.references),
            "longest_list": int(count.max(initial=0)),
            "covered_share": float(weights[is_leaf & (lists.cover >= 0)].sum()),
        }
        return Statistics.of_cells(
            weights, is_leaf, count, self.squares.depth, 1.0, 0.0, 1.0, extra
        )  # fmt: skip

    def exact_references(self, progress: Progress = SILENT) -> int:
        """Return how many references exact insertion into the same cells has."""
        insertion, squares, lists = self.insertion._replace(how=EXACT), self.squares, self.lists
        faces, total = insertion.faces, 0
        leaves = np.flatnonzero(lists.children < 0)
        row_of = np.full(len(insertion.items.boxes), NONE, np.int32)
        for face in range(len(faces.origins)):
            told = functools.partial(
                progress.report, face, len(faces.origins), f"Measuring {self.name}"
            )
            footprints = footprints_of(insertion, face, told)
            row_of[:] = NONE
            row_of[footprints.item] = np.arange(len(footprints.item))
            own = leaves[squares.face[leaves] == face]
            view = view_of(insertion, face, footprints)
            for begin in range(0, len(own), AT_ONCE):
                told()
                total += call(
                    count_exact, view, squares, lists, own[begin : begin + AT_ONCE], row_of
                )
        return int(total)

    def validate(self) -> list[str]:
        """Check that lists are in order, hold items once, and that cells are the faces'."""
        lists, violations = self.lists, []
        is_leaf = lists.children < 0
        weights = np.where(is_leaf, self.weights, 0.0).sum()
        if abs(weights - self.n_origins) > 1e-9 * self.n_origins:
            violations.append(f"cells are {weights:.12g} of {self.n_origins} times all directions")
        sizes = np.where(is_leaf, lists.last - lists.first, 0)
        if (sizes < 0).any() or lists.last.max(initial=0) > len(lists.references):
            return [*violations, "a list ends before it begins, or beyond all references"]
        cell = np.repeat(np.arange(len(sizes)), sizes)
        slot = ranges(lists.first[sizes > 0], sizes[sizes > 0])
        falls = (np.diff(lists.nearest[slot]) < 0.0) & (np.diff(cell) == 0)
        if falls.any():
            violations.append(f"the list of cell {cell[:-1][falls][0]} is out of order")
        item = lists.references[slot]
        order = np.lexsort((item, cell))
        is_twice = (np.diff(item[order]) == 0) & (np.diff(cell[order]) == 0)
        if is_twice.any():
            violations.append(f"the list of cell {cell[order][:-1][is_twice][0]} has an item twice")
        is_cut = np.isfinite(lists.far)
        if (is_cut != (lists.cover >= 0)).any():
            violations.append("a cell is cut off and not covered, or the other way round")
        return violations


def slack_of(scene: Scene, origins: np.ndarray) -> float:
    """Return how far off its line a ray of a scene may pass that goes to one of some points."""
    return float(ULPS * np.abs([scene.lower, scene.upper, *origins]).max())


def insertion_of(scene: Scene, geometry: Any, faces: Faces, settings: Any) -> Insertion:
    """Return what is to be inserted where, and how."""
    return Insertion(
        items_of(geometry), faces, METHODS[settings.insert], slack_of(scene, faces.origins),
        settings.full_occlusion,
    )  # fmt: skip


def filled(insertion: Insertion, settings: Any, name: str, progress: Progress) -> Lists:
    """Return the lists of all cells.

    Raises
    ------
    InputError
        When they do not fit into memory.
    Cancelled
        From `progress`.
    """
    return merged(lists_of(insertion, division_of(settings), name, progress), settings.merge)


def _areas(corners: np.ndarray) -> np.ndarray:
    """Return the areas, twice as surfaces have them, of parallelograms (n, 4, 3)."""
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    return 2.0 * np.linalg.norm(sides, axis=1)


@kernel
def count_exact(view, squares, lists, cells, row_of):
    """Count how many of the items that cells list are seen through them exactly."""
    total = whole(0)
    for n in range(len(cells)):
        cell = whole(cells[n])
        for slot in range(lists.first[cell], lists.last[cell]):
            k = whole(row_of[lists.references[slot]])
            if k >= 0:
                u, v, size = squares.u[cell], squares.v[cell], squares.width[cell]
                total += through_cell(view, k, u, v, size)[0]
    return total
