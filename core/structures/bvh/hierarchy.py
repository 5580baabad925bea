"""Bounding volume hierarchy (BVH): every node has a volume around the triangles below it.

A ray that misses the volume misses them all. Three choices are independent: how the triangles are
grouped (:mod:`.builders`), how the tree is rearranged afterwards (:mod:`.optimisers`), and what
volume is put around each group (:mod:`...geometry.fit`).
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from ...contract.build_log import BuildLog
from ...contract.cells import Cells
from ...contract.counters import N_ETS, N_IT, N_TS, VOLUME_TESTS
from ...contract.figures import COST_OF_TREE, EXPECTED_VOLUME_TESTS, OF_TREE, Figure
from ...contract.statistics import Statistics
from ...contract.structure import Structure
from ...contract.workspace import STACK_SIZE, Workspace, make_workspace
from ...errors import InputError
from ...geometry.box import Boxes
from ...geometry.box_shape import surface_area
from ...geometry.csg.trees import Csg
from ...geometry.fit import fit_all
from ...geometry.geometry import in_order
from ...geometry.instances import Instanced
from ...memory import refuse_if_too_large, refuse_if_unnumbered
from ...progress import SILENT, Progress
from ...ranges import ranges
from ...scene import Scene
from .builders import BUILDERS
from .figures.efficiency import Efficiency, hierarchy_efficiency
from .figures.overlap import sibling_overlap
from .forest import Bottom, csg_of_forest, instances_of
from .grouping import group
from .optimisers.rearranging import Rearrangement
from .settings import BVHSettings
from .topology.build_log import splits_of_nodes, widened_cells
from .topology.pieces import referred
from .topology.refit import refitted_volumes
from .topology.tree import Grouping, Tree, depths_of, ranges_of
from .topology.validation import violations_of
from .topology.wide import WideTree, widened
from .walks.binary_walk import Binary
from .walks.wide_walk import WIDE_STACK_SIZE, Wide

FIGURES = (
    *OF_TREE,
    Figure("duplication", "references per triangle, by spatial splits", "References per triangle"),
    Figure("spatial_splits", "nodes that were split so", "Spatial splits", "count"),
    Figure(
        "overlap",
        "surface that siblings share, over their parent's, in the mean",
        "Overlap of siblings",
    ),
    Figure(
        "nodes_not_paying",
        "inner nodes whose volumes cost more than they save: K B + sum p_i I_i >= sum I_i",
        "Nodes that do not pay",
        "count",
    ),
    Figure("nodes_not_paying_expected", "the same, if no ray ended before it leaves the root"),
    *COST_OF_TREE,
    EXPECTED_VOLUME_TESTS,
    Figure("binary", "of a wide tree: figures of the binary one that it was made of"),
    Figure("clusters", "of `ploc`: clusters left after each iteration"),
    Figure("queue_lengths", "of `parallel_sah`: nodes in the queue of each level"),
    Figure("queue_splits", "of `parallel_sah`: those among them that were split"),
    Figure("optimise_steps", "steps of the optimiser"),
    Figure("optimise_moves", "changes that it made"),
    Figure("optimise_costs", "SAH of single triangles before and after each of its steps"),
    Figure("optimise_pays", "whether the rearranged tree was kept"),
)
"""What only some builders and optimisers say is there with those alone."""

BYTES_PER_REFERENCE = 230
"""What spatial splits take, beside what a builder does, for every reference they are allowed."""

BYTES_REARRANGED, BYTES_WIDENED, BYTES_SHAPED = 680, 550, 1200
"""Memory per reference at the peak of rearranging a tree (measured: 671 for every optimiser), of
making it wide (540 for 8 children), and of fitting other volumes than boxes and computing their
figures (1,182 for 26-DOPs)."""

MOST_SHAPES = 20_000
"""Volumes that are drawn in their shape, if they are not boxes."""


def items_of(
    scene: Scene,
    order: np.ndarray,
    settings: Any,
    progress: Progress,
    bottom: Bottom | None = None,
) -> Any:
    """Return a scene's items in an order; the meshes of instances are grouped as it is itself.

    Unless `bottom` does it, see :func:`.forest.instances_of`.
    """
    if isinstance(scene.geometry, Instanced):
        return in_order(instances_of(scene.geometry, settings, progress, bottom), order)
    if isinstance(scene.geometry, Csg):
        return in_order(csg_of_forest(scene.geometry, settings, progress), order)
    return scene.items(order)


def have_same_items(before: Any, now: Any) -> bool:
    """Say whether two geometries are of one kind, and their instances of the same meshes."""
    if type(before) is not type(now):
        return False
    return not isinstance(now, Instanced) or np.array_equal(before.which, now.which)


@dataclasses.dataclass(frozen=True)
class Making:
    """How a hierarchy was made, over the triangles that it has.

    Attributes
    ----------
    rearrangement : Rearrangement or None
        What the optimiser did, if there is one.
    figures : dict
        What the builder and the optimiser say about their work.
    """

    rearrangement: Rearrangement | None
    figures: dict[str, Any]


class BVH(Structure):
    """Hierarchy of bounding volumes.

    Attributes
    ----------
    parts : (n_references, 6) float64 or None
        Boxes of the parts of triangles that references stand for, if not for whole ones.
    making : Making or None
        None for a tree that was refitted: it was made over triangles that were elsewhere, and
        nothing of that can be shown over those it has now.
    """

    name = "bvh"
    label = "BVH"
    summary = "Tree of bounding volumes, walked front to back"
    Settings = BVHSettings
    takes_cones = True
    COUNTERS = N_TS, N_ETS, N_IT, VOLUME_TESTS
    FIGURES = FIGURES

    arrays: Binary | Wide

    def __init__(
        self,
        scene: Scene,
        settings: Any,
        arrays: Binary | Wide,
        geometry: Any,
        *,
        parts: np.ndarray | None = None,
        making: Making | None = None,
        log: Callable[[Any], BuildLog] | None = None,
    ) -> None:
        super().__init__(scene, settings, arrays, geometry, log)
        self.parts = parts
        self.making = making
        self._areas: np.ndarray | None = None

    @classmethod
    def bytes_per_triangle(cls, settings: Any) -> float:
        """Return the memory at the peak of a build: that of the builder, or of what comes after.

        All are bounds: spatial splits may not take all references that they are allowed.
        """
        builder = BUILDERS[settings.builder]
        duplicates = builder.most_duplicates(settings)
        later = max(
            BYTES_REARRANGED * (settings.optimise != "none"),
            BYTES_WIDENED * (settings.arity != "2"),
            BYTES_SHAPED * (settings.volume != "aabb"),
        )
        by_builder = builder.bytes_per_triangle + duplicates * BYTES_PER_REFERENCE
        return max(by_builder, later * (1.0 + duplicates))

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: Any) -> None:
        """Refuse what would not fit into memory, or has no numbers, as the settings say."""
        duplicates = BUILDERS[settings.builder].most_duplicates(settings)
        references = len(scene) * (1.0 + duplicates)
        refuse_if_unnumbered(2.0 * references, "nodes of the bvh", "use a smaller scene")
        if duplicates:
            refuse_if_too_large(
                int(len(scene) * cls.bytes_per_triangle(settings)),
                f"{settings.builder} over {len(scene)} triangles with duplication {duplicates:g}",
                "lower duplication or use a smaller scene",
            )
        super().refuse_too_large(scene, settings)

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: Any,
        progress: Progress = SILENT,
        *,
        log: bool = False,
        bottom: Bottom | None = None,
    ) -> BVH:
        """Group the triangles, rearrange the tree, fit the volumes.

        The meshes of instances are grouped in the same way, unless `bottom` does it.
        """
        cls.refuse_too_large(scene, settings)
        grouping, rearrangement = group(scene.geometry, settings, progress, log)
        items = items_of(scene, grouping.order, settings, progress, bottom)
        figures = grouping.figures
        tree: Tree | WideTree = grouping.tree
        width = np.full(len(tree.size), 2)
        if settings.arity != "2":
            figures = figures | {"binary": figures_of_binary(grouping.tree, settings)}
            tree = widened(grouping.tree, int(settings.arity))
            width = tree.width
        if settings.volume == "aabb":
            volumes = Boxes.of(tree.boxes, items)
        else:
            ranges = ranges_of(tree.first, tree.size, width)
            pieces = referred(items, grouping.parts, *ranges, progress)
            volumes = fit_all(settings.volume, *pieces, progress)
        arrays: Binary | Wide
        if isinstance(tree, WideTree):
            arrays = Wide(volumes, tree.first, tree.size, tree.width)
        else:
            arrays = Binary(volumes, tree.first, tree.size)
        making = Making(rearrangement, figures)
        told = functools.partial(log_of, grouping, tree) if log else None
        return cls(scene, settings, arrays, items, parts=grouping.parts, making=making, log=told)

    @property
    def is_refitted(self) -> bool:
        """Whether the tree was made over triangles that were elsewhere."""
        return self.making is None

    @property
    def figures(self) -> dict[str, Any]:
        """What else there is to say about this tree."""
        return {} if self.making is None else self.making.figures

    @property
    def rearrangement(self) -> Rearrangement | None:
        """What the optimiser did, if there is one."""
        return None if self.making is None else self.making.rearrangement

    def refitted(self, scene: Scene, progress: Progress = SILENT) -> BVH:
        """Return the same tree over a scene whose triangles have moved.

        Parameters
        ----------
        scene : Scene
            The same triangles in the same order, elsewhere. The meshes of instances may have
            changed in whatever way: their trees are made anew.

        Raises
        ------
        InputError
            If the triangles are not the same, or the tree cuts them into pieces.
        Cancelled
            From `progress`.
        """
        before = self.scene
        if self.parts is not None:
            raise InputError(
                f"a tree of {self.settings.builder} cuts triangles into pieces, which cannot "
                "follow when they move; choose another builder"
            )
        if len(scene) != len(before) or not np.array_equal(
            scene.primitive_ids, before.primitive_ids
        ):
            raise InputError(
                f"the tree was built over {before.counted}, now there are {len(scene)}, or "
                "others were left out; a refit needs the same ones: build anew"
            )
        if not have_same_items(before.geometry, scene.geometry):
            raise InputError(
                f"the tree was built over {before.counted}, now there are {scene.counted}, or of "
                "other meshes; a refit needs the same ones: build anew"
            )
        items = items_of(scene, self.geometry.ids, self.settings, progress)
        volumes = refitted_volumes(
            self.arrays, self.width(), self.settings.volume, items, scene.boxes(), progress
        )
        return BVH(scene, self.settings, self.arrays._replace(volumes=volumes), items)

    def upper_boxes(self, levels: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the boxes of the upper levels, (k, 6), and the depth of each, (k,)."""
        depths = self.depths()
        upper = depths < levels
        return self.arrays.volumes.boxes()[upper], depths[upper]

    def referred(
        self, begin: np.ndarray, end: np.ndarray, progress: Progress = SILENT
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return triangles, and the ranges of them that ranges of references stand for."""
        return referred(self.geometry, self.parts, begin, end, progress)

    def reference_boxes(self) -> np.ndarray:
        """Return the boxes of what references stand for, as the builder had them, (n, 6)."""
        return self.scene.boxes()[self.geometry.ids] if self.parts is None else self.parts

    def width(self) -> np.ndarray:
        """Return how many children every node has, (n_nodes,) int."""
        if isinstance(self.arrays, Wide):
            return self.arrays.width
        return np.where(self.arrays.size > 0, 0, 2)

    def parents(self) -> np.ndarray:
        """Return the parent of every node, (n_nodes,) int64; -1 for the root."""
        width = self.width()
        parent = np.full(len(width), -1)
        parent[ranges(self.arrays.first, width)] = np.repeat(np.arange(len(width)), width)
        return parent

    def depths(self) -> np.ndarray:
        """Return the depth of every node, (n_nodes,) int64."""
        return depths_of(self.arrays.first, self.arrays.size, self.width())

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the volumes of all nodes; a cell's number is its node.

        Of volumes that are not boxes, the MOST_SHAPES nodes nearest to the root come as they are,
        the others as boxes around them: a million 26-DOPs would take three gigabytes.
        """
        text = "Listing the nodes"
        progress.report(0, 7, text)
        volumes, count, depth = self.arrays.volumes, self.arrays.size, self.depths()
        boxes, is_leaf = volumes.boxes(), count > 0
        progress.report(1, 7, text)
        self.measured_areas(progress)
        efficiency = self.efficiency()
        extra = {"gain": efficiency.gain, "expected_gain": efficiency.expected_gain}
        progress.report(2, 7, text)
        extra["overlap"] = self.overlap()
        progress.report(3, 7, text)
        parent, planes, replaced = self.parents(), None, None
        if (log := self.build_log) is not None:
            progress.report(4, 7, text)
            extra["order"], replaced = log.steps(parent)
            if log.has_planes():
                progress.report(5, 7, text)
                planes = log.planes(boxes)
                if isinstance(self.arrays, Binary):
                    extra |= splits_of_nodes(log, len(boxes))
        progress.report(6, 7, text)
        if isinstance(volumes, Boxes):
            return Cells.sorted_by_depth(
                boxes, depth, is_leaf, count, extra,
                planes=planes, replaced=replaced, parent=parent,
            )  # fmt: skip
        shaped = np.argsort(depth, kind="stable")[:MOST_SHAPES]
        faces = volumes.polygons(shaped, progress)
        faces = faces._replace(owners=shaped[faces.owners])
        return Cells.sorted_by_depth(
            boxes, depth, is_leaf, count, extra, faces, planes, self.areas, replaced, parent
        )

    @property
    def areas(self) -> np.ndarray:
        """Surface areas of all volumes, (n_nodes,)."""
        return self.measured_areas()

    def measured_areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas of all volumes, (n_nodes,); they are measured but once.

        Raises
        ------
        Cancelled
            From `progress`.
        """
        if self._areas is None:
            self._areas = self.arrays.volumes.areas(progress)
        return self._areas

    def efficiency(self) -> Efficiency:
        """Return whether each node pays, by the lecture's inequality."""
        return hierarchy_efficiency(
            self.areas, self.arrays.first, self.arrays.size, self.width(),
            self.settings.C_trav, self.settings.C_isect,
        )  # fmt: skip

    def overlap(self) -> np.ndarray:
        """Return how much the children of each node overlap, (n_nodes,); 0 for leaves."""
        return sibling_overlap(self.arrays.volumes.boxes(), self.arrays.first, self.width())

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the tree; areas are those of the volumes themselves."""
        count = self.arrays.size
        areas = self.measured_areas(progress)
        is_inner, efficiency = count == 0, self.efficiency()
        extra = self.figures | {
            "expected_volume_tests": 1.0 + float((areas * self.width()).sum() / areas[0]),
            "overlap": float(self.overlap()[is_inner].mean()) if is_inner.any() else 0.0,
            "nodes_not_paying": int((efficiency.gain[is_inner] <= 0.0).sum()),
            "nodes_not_paying_expected": int((efficiency.expected_gain[is_inner] <= 0.0).sum()),
        }
        return Statistics.of_cells(
            areas, count > 0, count, self.depths(), float(areas[0]),
            self.settings.C_trav, self.settings.C_isect, extra,
        )  # fmt: skip

    def _workspace(self) -> Workspace:
        is_wide = isinstance(self.arrays, Wide)
        return make_workspace(cells=WIDE_STACK_SIZE if is_wide else STACK_SIZE)

    def validate(self) -> list[str]:
        """Check that leaves partition the references and that volumes contain what is below."""
        return violations_of(
            self.arrays,
            self.width(),
            self.geometry,
            self.parts,
            self.scene.geometry,
            self.scene.boxes(),
        )


def log_of(grouping: Grouping, tree: Tree | WideTree, structure: Any) -> BuildLog:
    """Return the log of a grouping whose tree may have been widened."""
    assert grouping.log is not None
    log = grouping.log()
    if isinstance(tree, WideTree):
        log = log.with_cells(widened_cells(grouping.tree, tree))
        if log.has_planes():  # then names are nodes of the binary tree
            log = dataclasses.replace(log, boxes=grouping.tree.boxes)
    return log


def figures_of_binary(tree: Tree, settings: Any) -> dict[str, float]:
    """Return what a wide tree is compared with: figures of the binary one, with boxes around."""
    size = tree.size
    areas = surface_area(tree.boxes)
    figures = Statistics.of_cells(
        areas, size > 0, size, np.zeros(len(size), np.int64), float(areas[0]),
        settings.C_trav, settings.C_isect,
    )  # fmt: skip
    return {
        "N_IN": figures.N_IN,
        "sah": figures.sah,
        "expected_inner": figures.expected_inner,
        "expected_volume_tests": 1.0 + 2.0 * figures.expected_inner,
    }
