"""5D shafts: rays that are much alike begin their walk through a tree at the same few nodes.

The walk of a hierarchy begins at the root, and the first steps of rays that are much alike are the
same. Here rays are divided into *classes* (:mod:`.classes`), by the cell of a grid in which they
begin and the square of a cube through which they go. All rays of a class together fill a *shaft*, a
convex polyhedron without an end: the beam of :mod:`..ray_classification.beam`. A class has a short
array of nodes, its *starts* (:mod:`.cut`), below which lies everything that its shaft meets. A ray
looks up its class, which takes no search, and walks the subtrees of its starts one after the other,
until the next one begins behind its hit (lecture, "Contemporary methods").

Arrays are made when the first ray of a class comes. What is in them depends on the class alone, so
what is counted depends on nothing but the ray.

J. Hendrich, A. Pospíšil, D. Meister, J. Bittner: Ray Classification for Accelerated BVH Traversal,
Computer Graphics Forum 38(4), 2019.
"""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from ...contract.build_log import BuildLog
from ...contract.cells import Cells
from ...contract.events import NONE
from ...contract.figures import Figure
from ...contract.lazy import CELLS_MADE, LazyStructure, with_room
from ...contract.statistics import Statistics
from ...contract.workspace import STACK_SIZE, Workspace, make_workspace
from ...geometry.rays import Rays
from ...kernels import call
from ...memory import refuse_if_too_large
from ...parallel import for_chunks
from ...progress import SILENT, Progress
from ...ranges import longer
from ...scene import Scene
from ..bvh import BVH
from ..bvh.walks.binary_walk import Binary
from ..ray_classification.ray_space import slack_of
from .classes import bounds_of, count_of
from .cut import Tree, cut_tree
from .settings import ShaftsSettings, classes_over, settings_of_tree
from .walk import FROM_ROOT, UNMADE, ShaftArrays, find_classes

BYTES_PER_CLASS = 6
"""Its row, one byte that a ray has come, and another when they are counted."""

CLASSES = Figure("classes", "classes of rays there are", "Classes", "count", section="Shafts")
MADE_SHARE = Figure(
    "made_share", "classes that rays have come to / classes there are", "Share made",
    section="Shafts",
)  # fmt: skip
MEAN_STARTS = Figure(
    "mean_starts", "nodes at which walks start, in the mean over classes that are made",
    "Mean starts", section="Shafts", column="mean starts",
)  # fmt: skip
MEAN_START_DEPTH = Figure(
    "mean_start_depth", "depth of these nodes, in the mean over all of them", "Mean start depth",
    section="Shafts",
)  # fmt: skip
STARTLESS = Figure(
    "startless", "classes that are made and meet nothing, so that no ray of theirs walks at all",
    "Classes without starts", "count", section="Shafts",
)  # fmt: skip


class Shafts(LazyStructure):
    """A hierarchy, and for each class of rays the nodes at which they start.

    Attributes
    ----------
    bvh : BVH
        Its cells are those of the whole.
    """

    name = "shafts"
    label = "Shafts"
    summary = "A tree whose walks start where the shaft of a class of rays needs them to"
    Settings = ShaftsSettings
    COUNTERS = BVH.COUNTERS
    FIGURES: ClassVar[tuple[Figure, ...]] = (
        *BVH.FIGURES, CLASSES, CELLS_MADE, MADE_SHARE, MEAN_STARTS, MEAN_START_DEPTH, STARTLESS
    )  # fmt: skip

    def __init__(self, scene: Scene, settings: ShaftsSettings, bvh: BVH, arrays: Any) -> None:
        super().__init__(scene, settings, arrays, bvh.geometry)
        self.bvh = bvh

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: ShaftsSettings) -> None:
        """Refuse a tree, or classes, that would not fit into memory."""
        BVH.refuse_too_large(scene, settings_of_tree(settings))
        count = count_of(classes_over(scene, settings))
        refuse_if_too_large(
            BYTES_PER_CLASS * count, f"{count} classes of rays",
            "lower origin_cells or direction_cells",
        )  # fmt: skip

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: ShaftsSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> Shafts:
        """Build the tree; arrays are made for rays."""
        cls.refuse_too_large(scene, settings)
        bvh = BVH.build(scene, settings_of_tree(settings), progress, log=log)
        tree = bvh.arrays
        assert isinstance(tree, Binary)
        classes = classes_over(scene, settings)
        starts = np.full((1, settings.max_starts), NONE, np.int32)
        starts[FROM_ROOT, 0] = tree.root
        arrays = ShaftArrays(
            tree, tree.volumes.boxes().copy(), classes, slack_of(bvh.geometry.reach),
            np.full(count_of(classes), UNMADE, np.int32), starts, np.zeros(0, np.uint8), 0,
        )  # fmt: skip
        return cls(scene, settings, bvh, arrays)

    # ------------------------------------------------------------------------------------ making

    def seeking(self, look_ahead: int) -> tuple[Any, np.ndarray]:
        """Return the arrays with room for the classes that rays miss."""
        return with_room(self.arrays, len(self.arrays.rows), look_ahead)

    def make_cells(self, wanted: np.ndarray, threads: int, progress: Progress) -> tuple[Any, int]:
        """Cut the tree for classes that are wanted and not made."""
        arrays: ShaftArrays = self.arrays
        numbers = np.flatnonzero((wanted != 0) & (arrays.rows == UNMADE))
        begin, count = len(arrays.starts), len(numbers)
        most = self.settings.max_starts
        refuse_if_too_large(
            4 * most * (begin + count), f"start arrays of {count} classes of rays",
            "lower max_starts, origin_cells or direction_cells",
        )  # fmt: skip
        starts, rows = longer(arrays.starts, begin + count), arrays.rows.copy()
        tree = Tree(arrays.boxes, arrays.tree.first, arrays.tree.size, arrays.tree.root)

        def cut_chunk(first: int, last: int) -> None:
            bounds, roots = bounds_of(arrays.classes, numbers[first:last])
            new = cut_tree(tree, bounds, roots, arrays.slack, most)
            starts[begin + first : begin + last] = new

        for_chunks(cut_chunk, count, threads, progress, "Cutting the tree for shafts")
        rows[numbers] = np.arange(begin, begin + count)
        return arrays._replace(rows=rows, starts=starts), count

    # ------------------------------------------------------------------------ what is known of it

    @property
    def build_log(self) -> BuildLog | None:
        """What the builder of the tree did."""
        return self.bvh.build_log

    @property
    def keeps_log(self) -> bool:
        """Whether there is a log of the tree."""
        return self.bvh.keeps_log

    def _workspace(self) -> Workspace:
        return make_workspace(cells=STACK_SIZE + self.settings.max_starts)

    def classes_of(self, rays: Rays) -> np.ndarray:
        """Return the class of each ray, (n,) int64.

        NONE for those that miss the scene's box, or begin at the root.
        """
        numbers = np.empty(len(rays), np.int64)
        call(find_classes, self.arrays, self.geometry.reach, rays.arrays(), numbers)
        return numbers

    def bounds_of(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the intervals of classes, (n, 2, 6), and their roots, (n,): cells of ray space."""
        return bounds_of(self.arrays.classes, numbers)

    def starts_of(self, number: int) -> np.ndarray:
        """Return the starts of a class that is made, (k,) int32, in their order."""
        starts: np.ndarray = self.arrays.starts[self.arrays.rows[number]]
        return starts[starts != NONE]

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the nodes of the tree; ``starts`` says in how many start arrays each is."""
        cells = self.bvh.cells(progress)
        starts = self.arrays.starts[FROM_ROOT + 1 :]
        times = np.bincount(starts[starts != NONE], minlength=len(self.arrays.boxes))
        extra = {**cells.extra, "starts": times[cells.numbers].astype(np.int32)}
        return dataclasses.replace(cells, extra=extra)

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the tree, and of what is made."""
        tree = self.bvh.statistics(progress)
        starts = self.arrays.starts[FROM_ROOT + 1 :]
        is_start, n_classes, n_made = starts != NONE, len(self.arrays.rows), len(starts)
        extra = {
            "classes": n_classes,
            "cells_made": self.made().cells,
            "made_share": n_made / n_classes,
            "mean_starts": float(is_start.sum(axis=1).mean()) if n_made else 0.0,
            "mean_start_depth": (
                float(self.bvh.depths()[starts[is_start]].mean()) if is_start.any() else 0.0
            ),
            "startless": int((~is_start).all(axis=1).sum()),
        }
        return dataclasses.replace(tree, extra={**tree.extra, **extra})

    def validate(self) -> list[str]:
        """Check the tree, and that the starts of a class are no nodes of each other."""
        violations = self.bvh.validate()
        parents, starts = self.bvh.parents(), self.arrays.starts
        # Each start's ancestors, one level after the other, are no starts of the same row.
        rows, slots = np.nonzero(starts != NONE)
        nodes = starts[rows, slots].astype(np.int64)
        n_nodes = len(parents)
        known = rows * n_nodes + nodes
        if len(np.unique(known)) < len(known):
            violations.append("a class has a start twice")
        nodes = parents[nodes]
        while (is_left := nodes >= 0).any():
            rows, nodes = rows[is_left], nodes[is_left]
            if np.isin(rows * n_nodes + nodes, known).any():
                violations.append("a class has a start below another")
                break
            nodes = parents[nodes]
        return violations


STRUCTURE = Shafts
