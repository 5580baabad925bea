"""kd-tree: a cell is cut by one plane perpendicular to an axis, again and again.

Where the plane goes decides everything (:mod:`.static`, :mod:`.sah`). A triangle is listed in every
leaf that it reaches into, for which it is clipped to the cells (:mod:`.clip`); one that only
touches a plane stays on its side. The builder (:mod:`.builder`) stops at a number of triangles, a
depth, a budget of cells, or where the cost says so. The tree (:mod:`.storage`) is walked in the
same ways as an octree (:mod:`..subdivision.walks`).

J. L. Bentley: Multidimensional Binary Search Trees Used for Associative Searching, CACM 1975.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...contract.build_log import SPLIT, BuildLog
from ...contract.cells import Cells, parents_of, planes_across, rectangles
from ...contract.costs import intersection_cost, traversal_cost
from ...geometry.box_shape import surface_area
from ...geometry.clip import POLYGON_SIZE, add_clipped_areas
from ...geometry.geometry import boxes_around
from ...geometry.rays import ULPS
from ...geometry.triangle import areas_of
from ...geometry.triangles import Triangles
from ...kernels import call
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import setting
from ..subdivision.frontier import NO_BUDGET, ORDERS, budget_setting, order_setting
from ..subdivision.settings import (
    depth_limit,
    depth_setting,
    duplication_setting,
    empty_bonus_setting,
    leaf_size_setting,
    links_setting,
    mailbox_setting,
    most_references,
    padding_setting,
    walk_setting,
)
from ..subdivision.structure import LinkedSubdivision, Topology, padded_box, split_costs
from ..subdivision.subtrees import Limits, build_with_threads, follows_order, in_any_order
from .builder import Builder, meter_of
from .sah import SweepPlanes, start_sweep
from .static import RULES, StaticPlanes, start_static
from .storage import KdTreeArrays, breadth_first_steps, store, topology_of
from .work import LEAF

DUPLICATION = 16
"""References per triangle that a tree has at most by default. On scans, interiors, a machine and a
tree there are 1.9 to 5.8 under the heuristic, and the SAH cost is at most 0.5 % above that without
a limit."""


FEW = 1 << 22
"""References that a tree under the heuristic may have anyhow, as it stops by itself: discs, cones
and needles of 3,000 to 20,000 triangles get 1 to 34 each, within a second."""


@dataclass(frozen=True)
class KdTreeSettings:
    """Settings of the kd-tree."""

    planes: str = setting(
        "sah",
        "Planes",
        "Where a cell is cut",
        choices={
            "cyclic": "In the middle, across x, y and z in turn",
            "longest": "In the middle of the longest side (spatial median)",
            "object_median": "Across the longest side, half of the triangles on either side",
            "sah": "Where the surface area heuristic costs least (Wald, Havran 2006)",
        },
    )
    walk: str = walk_setting()
    links: str = links_setting()
    max_depth: int = depth_setting()
    max_leaf_size: int = leaf_size_setting(20)
    duplication: float = duplication_setting(
        DUPLICATION, " (under the heuristic, 4 million in all if that is more)"
    )
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()
    empty_bonus: float = empty_bonus_setting(0.2, ("sah",))
    budget: int = budget_setting()
    order: str = order_setting()
    mailbox: bool = mailbox_setting()
    padding: float = padding_setting(0.0)


SUBTREE = 1 << 15
"""References up to which a subtree is built by one thread, in memory that fits its cache."""


def build_tree(
    items: Any,
    cell: np.ndarray,
    settings: KdTreeSettings,
    progress: Progress,
    threads: int = 0,
) -> tuple[KdTreeArrays, np.ndarray | None, np.ndarray]:
    """Build the tree.

    Without a budget depth-first, with large subtrees on different threads: no other order then
    gives another tree, and neither does another number of threads. The priority queue is followed
    even so, since nothing else tells in which order it splits.

    Parameters
    ----------
    cell : (6,) float64
        Of the root.
    threads : int
        0 takes every core.

    Returns
    -------
    tree : KdTreeArrays
    made : (n_nodes,) int64, optional
        The step in which each node was made, where the nodes were split in the order of the
        settings.
    size : (n_nodes,) int32
        References of each node, inner ones included.

    Raises
    ------
    InputError
        When the tree gets too large.
    Cancelled
        From `progress`.
    """
    count = len(items.ids)
    progress.report(0.0, 1.0, "Building kdtree")
    boxes = boxes_around(items)
    references = most_references(settings.duplication, settings.max_depth, count, DUPLICATION)
    if settings.planes == "sah" and settings.duplication < 0.0:
        references = max(references, FEW)
    limits = Limits(
        depth_limit(settings.max_depth, count), settings.max_leaf_size,
        settings.budget or NO_BUDGET, references, ORDERS[settings.order], 0,
    )  # fmt: skip
    in_order = follows_order(limits)
    if not in_order:
        limits = in_any_order(limits, count, SUBTREE)
    whole = np.append(cell, 1.0)
    meter = meter_of(count, progress)
    meter.report()
    planes: Any
    if settings.planes == "sah":
        planes = SweepPlanes(settings.C_trav, settings.C_isect, 1.0 - settings.empty_bonus)
        memory = start_sweep(boxes, whole, limits, meter)
    else:
        planes = StaticPlanes(RULES[settings.planes])
        memory = start_static(boxes, whole, limits)
    meter.report()
    top = Builder(planes, limits, memory, items, meter)
    pieces = build_with_threads(top, meter, threads)
    tree, old, size = store(top.finished(), pieces, cell)
    progress.report(1.0, 1.0, "Building kdtree")
    return tree, (old + 1) // 2 if in_order else None, size


def log_of(made: np.ndarray | None, size: np.ndarray, structure: KdTree) -> BuildLog:
    """Return the log of a building: the k-th split of the order of the settings is step k.

    Parameters
    ----------
    made, size
        See :func:`build_tree`.
    """
    tree, settings = structure.arrays.tree, structure.settings
    if made is None and settings.order == "fifo":
        made = breadth_first_steps(tree)
    elif made is None:
        made = (np.arange(len(tree.link)) + 1) // 2  # numbers are given depth-first
    axis = tree.link & 3
    inner = np.flatnonzero(axis != LEAF)
    children = (tree.link[inner] >> 2)[:, None] + np.arange(2)
    costs = split_costs(surface_area(topology_of(tree).boxes), size, inner, children, settings)
    return BuildLog.of(
        SPLIT, made[children[:, 0]], inner, children,
        axis=axis[inner], position=tree.split[inner], cost=costs, counts=size[children],
        cells=np.arange(len(axis)),
    )  # fmt: skip


class KdTree(LinkedSubdivision):
    """Binary subdivision of space by axis-aligned planes."""

    name = "kdtree"
    label = "kd-Tree"
    summary = "Binary tree of cells, cut by planes across one axis each"
    Settings = KdTreeSettings
    takes_cones = True

    def __init__(
        self,
        scene: Scene,
        settings: KdTreeSettings,
        tree: KdTreeArrays,
        geometry: Any,
        log: Callable[[Any], BuildLog] | None = None,
    ) -> None:
        super().__init__(scene, settings, None, geometry, log)
        self.with_walk(tree)

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: KdTreeSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> KdTree:
        """Build the tree, then prepare its walk."""
        refuse_if_too_large(
            len(scene) * 600, f"a kdtree over {scene.counted}", "use a smaller scene"
        )
        items = scene.items()
        cell = padded_box(scene.lower, scene.upper, settings.padding)
        tree, made, size = build_tree(items, cell, settings, progress)
        told = functools.partial(log_of, made, size) if log else None
        return cls(scene, settings, tree, items, told)

    def topology(self) -> Topology:
        """Return the cells of all nodes."""
        return topology_of(self.arrays.tree)

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the cells of all nodes, with the planes that cut them.

        Attribute `axis` is 3 and `split` is NaN for leaves.
        """
        nodes, tree = self.topology(), self.arrays.tree
        axis = (tree.link & 3).astype(np.int8)
        split = np.where(axis == LEAF, np.nan, tree.split)
        cut = [np.flatnonzero(axis == a) for a in range(3)]
        corners = [planes_across(nodes.boxes[cut[a]], a, split[cut[a]]) for a in range(3)]
        inner = np.flatnonzero(axis != LEAF)
        children = (tree.link[inner] >> 2)[:, None] + np.arange(2)
        parent = parents_of(len(axis), inner, children)
        steps, replaced = self.steps_of_cells(parent)
        return Cells.sorted_by_depth(
            nodes.boxes, nodes.depth, nodes.is_leaf, nodes.count,
            {"axis": axis, "split": split, **steps},
            planes=rectangles(np.concatenate(corners), np.concatenate(cut)),
            replaced=replaced, parent=parent,
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Check the tree, and that the leaves which list a triangle cover all of it."""
        violations = super().validate()
        if violations or not isinstance(self.geometry, Triangles):
            return violations
        tree, nodes, corners = self.arrays.tree, self.topology(), self.triangles.corners
        leaf_of = np.repeat(np.arange(len(tree.offsets) - 1), np.diff(tree.offsets))
        areas = np.zeros(len(corners))
        call(
            add_clipped_areas, corners, tree.references, leaf_of,
            np.ascontiguousarray(nodes.boxes[nodes.leaves]), areas,
            np.empty((2 * POLYGON_SIZE, 3)),
        )  # fmt: skip
        edges = corners[:, 1:] - corners[:, :1]
        whole = areas_of(corners)
        # Rounding of corners moves edges: a needle's area may be rounding error alone.
        around = np.linalg.norm(edges, axis=2).sum(axis=1)
        tolerance = 1e-6 * whole + 64 * ULPS * self.triangles.reach.max() * around
        if (np.abs(areas - whole) > tolerance).any():
            violations.append("the leaves that list a triangle do not cover it")
        return violations


STRUCTURE = KdTree
