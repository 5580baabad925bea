"""Octree: a box is cut into eight until few triangles are left in each part.

All three planes of a cell cut it at once, in the middle or where it costs least
(:mod:`.planes`). The same tree can be stored in four ways (:mod:`.storage`) and walked in five
(:mod:`..subdivision.walks`).

A triangle belongs to every leaf that its box overlaps (or it itself: exact assignment). Cells are
closed on both sides: a triangle that only touches a plane belongs to both. Under open overlap it
belongs to one; published counts exist for both.

Defaults are measured. Compared by its box, a thin slanting triangle is in far more cells than it
meets: at depth 8 that made 10 to 49 references per triangle of scans, interiors and a machine, 640
of a tree, and more than could be held of the 62 of a slanting cone. Exactly assigned, with the
limit DUPLICATION and the depth left to the number of triangles, there are 5 to 12 of the same
meshes, at a SAH cost lower by 13 to 74 %; no scene can have more than the limit.

A. Glassner: Space Subdivision for Fast Ray Tracing, IEEE CG&A 4(10), 1984.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...contract.build_log import SPLIT, BuildLog
from ...contract.cells import Cells, parents_of, planes_across, rectangles
from ...contract.costs import intersection_cost, traversal_cost
from ...contract.figures import Figure
from ...contract.lazy import CELLS_MADE, LazyStructure, lazy_setting, with_room
from ...contract.structure import arrays_in
from ...geometry.box_shape import surface_area
from ...kernels import call, kernel
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import OPEN, setting
from ..subdivision.frontier import FIFO, NO_BUDGET, ORDERS, budget_setting, order_setting
from ..subdivision.ropes import link
from ..subdivision.settings import (
    depth_limit,
    duplication_setting,
    leaf_size_setting,
    links_setting,
    mailbox_setting,
    most_references,
    padding_setting,
    walk_setting,
)
from ..subdivision.structure import (
    FIGURES,
    LinkedSubdivision,
    Topology,
    padded_box,
    split_costs,
    walked,
)
from ..subdivision.tree import child
from . import octants as octants  # registers the kernels of the storages
from .assignment import assignment_named
from .build import Cutter, Rule, cut_into_octants, finish
from .lazy import LazyPointers, as_it_grows, split_open
from .planes import PLACEMENTS
from .storage import (
    HASH_LEVELS,
    LINEAR_LEVELS,
    STORAGES,
    BuiltTree,
    HashOctree,
    chain_lengths,
    topology_bytes,
)

DUPLICATION = 24
"""References per triangle that a tree has at most by default. The SAH cost is 0 to 3 % above that
without a limit, at depth 10, on scans and a machine, 9 % on a tree, 12 % in a kitchen. A limit of
16 would cost twice as much, one of 32 would bring a tree to 15 references per triangle."""

DEEPEST = {"pointer": 60, "implicit": 8, "linear": LINEAR_LEVELS, "hash": HASH_LEVELS}
"""Levels up to which a depth is chosen without being asked for: what a storage can name, and what
a full array may cost, 80 MB."""


@dataclass(frozen=True)
class OctreeSettings:
    """Settings of the octree."""

    max_depth: int = setting(
        -1,
        "Max Depth",
        "Level K at which subdivision ends, the root has level 0; -1 for half of "
        "8 + 1.3 log2 N of N triangles, and at most 8 where Storage is implicit",
        unit="levels",
        minimum=-1,
        maximum=60,
        unset="auto",
    )
    max_leaf_size: int = leaf_size_setting(8)
    duplication: float = duplication_setting(DUPLICATION)
    storage: str = setting(
        "pointer",
        "Storage",
        "How the tree is kept in memory",
        choices={
            "pointer": "Eight pointers per inner node",
            "implicit": "A full tree in one array, children of i at 8 i + 1 ... 8 i + 8",
            "linear": "Sorted locational codes, found by binary search (Gargantini)",
            "hash": "A hash table of node names (Glassner)",
        },
    )
    planes: str = setting(
        "middle",
        "Planes",
        "Where a cell is cut",
        choices={
            "middle": "In the middle",
            "adaptive": "Where it costs least between the middle and the object median",
        },
    )
    walk: str = walk_setting()
    links: str = links_setting()
    padding: float = padding_setting()
    overlap: str = setting(
        "closed",
        "Overlap",
        "Whether a triangle that only touches a plane belongs to both sides",
        choices={"closed": "It belongs to both", "open": "It belongs to its own side only"},
    )
    assignment: str = setting(
        "exact",
        "Assignment",
        "What is compared with a cell",
        choices={"box": "The triangle's bounding box", "exact": "The triangle itself"},
    )
    mailbox: bool = mailbox_setting()
    budget: int = budget_setting()
    order: str = order_setting()
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()
    lazy: bool = lazy_setting(
        "A cell is split when a ray first enters it", {"storage": ("pointer",), "budget": OPEN}
    )


def is_lazy(settings: OctreeSettings) -> bool:
    """Say whether cells are left to the rays: a tree with a budget of cells is built at once."""
    return settings.lazy and settings.storage == "pointer" and not settings.budget


def levels_for(settings: OctreeSettings, count: int) -> int:
    """Return the depth at which splitting ends in a scene of `count` triangles.

    Cells that are cut into eight need a third of the levels of a binary tree where the scene is
    even, and as many where all is in one corner: half of them is in between.
    """
    if settings.max_depth >= 0:
        return settings.max_depth
    return min(round(depth_limit(-1, count) / 2), DEEPEST[settings.storage])


STORAGES_SECTION = "Storages of this tree"

STORAGE_FIGURES = (
    *(
        Figure(f"bytes_{name}", f"bytes of this tree {text}", label, "bytes", STORAGES_SECTION)
        for name, text, label in (
            ("pointer", "with pointers", "Pointers"),
            ("implicit", "as an implicit array", "Implicit array"),
            ("linear", "as a linear octree", "Linear octree"),
            ("hash", "in a hash table", "Hash table"),
            (
                "planes_and_references",
                "for planes and lists, which all storages have",
                "Planes and lists, in all of them",
            ),
        )
    ),
    Figure("hash_table_size", "slots of the hash table"),
    Figure("hash_chain_mean", "slots looked at per node that is there, in the mean"),
    Figure("hash_chain_max", "the most slots looked at for one"),
)


def rule_of(scene: Scene, settings: OctreeSettings, items: Any) -> Rule:
    """Return the rule by which cells are split."""
    lazy = is_lazy(settings)
    return Rule(
        levels_for(settings, len(scene)),
        settings.max_leaf_size,
        settings.budget or NO_BUDGET,
        FIFO if lazy else ORDERS[settings.order],
        most_references(settings.duplication, settings.max_depth, len(scene), DUPLICATION),
        PLACEMENTS[settings.planes],
        assignment_named(settings.assignment, items, scene.boxes(), settings.overlap == "closed"),
        descends=not lazy,
    )


class Octree(LinkedSubdivision):
    """Adaptive subdivision into octants."""

    name = "octree"
    label = "Octree"
    summary = "Cells cut into eight, stored in four ways, walked in five"
    Settings = OctreeSettings
    takes_cones = True
    FIGURES = (*FIGURES, *STORAGE_FIGURES, CELLS_MADE)

    def __init__(
        self,
        scene: Scene,
        settings: OctreeSettings,
        built: BuiltTree,
        geometry: Any,
        log: bool = False,
    ) -> None:
        super().__init__(scene, settings, None, geometry, Octree.logged if log else None)
        self.built = built
        self.with_walk(STORAGES[settings.storage](built))

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: OctreeSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> Octree:
        """Subdivide, number the nodes, store the tree."""
        refuse_if_too_large(
            len(scene) * 150, f"an octree over {scene.counted}", "use a smaller scene"
        )
        items = scene.items()
        rule = rule_of(scene, settings, items)
        box = padded_box(scene.lower, scene.upper, settings.padding)
        if is_lazy(settings):
            return LazyOctree(scene, settings, Cutter(len(scene), box, rule), items)
        tree = cut_into_octants(len(scene), box, rule, progress)
        return cls(scene, settings, finish(tree), items, log)

    def topology(self) -> Topology:
        """Return the boxes of all nodes, from the root's and the planes."""
        built = self.built
        n_inner, n_nodes = len(built.planes), len(built.levels)
        boxes = np.empty((n_nodes, 6))
        boxes[0] = built.box
        # Inner nodes are numbered level by level, so parents come before their children.
        starts = np.searchsorted(built.levels[:n_inner], np.arange(int(built.levels.max()) + 1))
        for first, last in zip(starts, [*starts[1:], n_inner], strict=True):
            for octant in range(8):
                below = built.children[first:last, octant]
                for axis in range(3):
                    plane, upper = built.planes[first:last, axis], octant >> axis & 1
                    low, high = boxes[first:last, axis], boxes[first:last, 3 + axis]
                    boxes[below, axis] = plane if upper else low
                    boxes[below, 3 + axis] = high if upper else plane
        is_leaf = np.arange(n_nodes) >= n_inner
        count = np.zeros(n_nodes, np.int32)
        count[n_inner:] = np.diff(built.offsets)
        leaves = np.arange(n_inner, n_nodes)
        return Topology(boxes, built.levels.astype(np.int64), is_leaf, count, leaves)

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the cells of all nodes, with the three planes that cut each inner one."""
        built, nodes = self.built, self.topology()
        n_inner = len(built.planes)
        corners = [planes_across(nodes.boxes[:n_inner], a, built.planes[:, a]) for a in range(3)]
        planes = rectangles(np.concatenate(corners), np.tile(np.arange(n_inner), 3))
        parent = parents_of(len(nodes.depth), np.arange(n_inner), built.children)
        steps, replaced = self.steps_of_cells(parent)
        return Cells.sorted_by_depth(
            nodes.boxes, nodes.depth, nodes.is_leaf, nodes.count, steps,
            planes=planes, replaced=replaced, parent=parent,
        )  # fmt: skip

    def logged(self) -> BuildLog:
        """Return the log of the building: three planes a step, and the cost of all eight parts."""
        built, inner = self.built, np.arange(len(self.built.planes))
        areas, below = surface_area(self.topology().boxes), built.count[built.children]
        costs = split_costs(areas, built.count, inner, built.children, self.settings)
        upper = np.arange(8) >> np.arange(3)[:, None] & 1  # by axis and octant
        counts = np.stack([below @ (1 - upper).T, below @ upper.T], axis=2)
        return BuildLog.of(
            SPLIT, built.order[built.children[:, 0]].repeat(3), inner.repeat(3),
            built.children.repeat(3, axis=0), axis=np.tile(np.arange(3), len(inner)),
            position=built.planes.ravel(), cost=costs.repeat(3), counts=counts.reshape(-1, 2),
            cells=np.arange(len(built.levels)),
        )  # fmt: skip

    def extra_statistics(self) -> dict[str, Any]:
        """Return the bytes of all four storages, and the chains of the hash table."""
        built = self.built
        depth = int(built.levels.max())
        sizes = topology_bytes(len(built.planes), len(built.levels) - len(built.planes), depth)
        common = built.planes.nbytes + built.offsets.nbytes + built.references.nbytes
        extra: dict[str, Any] = {f"bytes_{name}": size for name, size in sizes.items()}
        extra["bytes_planes_and_references"] = common
        tree = self.arrays.tree
        if isinstance(tree, HashOctree):
            lengths = chain_lengths(tree)
            extra["hash_table_size"] = len(tree.heads)
            extra["hash_chain_mean"] = float(lengths.mean())
            extra["hash_chain_max"] = int(lengths.max())
        return extra

    def validate(self) -> list[str]:
        """Check the tree, and that its storage finds every child."""
        violations = super().validate()
        wrong = call(count_wrong_children, self.arrays.tree, self.built.children)
        if wrong:
            violations.append(f"the storage finds {wrong} wrong children")
        return violations


class LazyOctree(LazyStructure, Octree):
    """An octree whose cells are split when a ray first enters them (:mod:`.lazy`)."""

    def __init__(
        self, scene: Scene, settings: OctreeSettings, cutter: Cutter, geometry: Any
    ) -> None:
        LinkedSubdivision.__init__(self, scene, settings, None, geometry)
        self.cutter = cutter
        self.with_walk(as_it_grows(cutter.tree, cutter.rule, None))

    def memory(self) -> int:
        """Return the bytes of the tree, and of what is kept for splitting its leaves."""
        kept = arrays_in((self.cutter.tree, self.cutter.scratch))
        return super().memory() + sum(array.nbytes for array in kept)

    def seeking(self, look_ahead: int) -> tuple[Any, np.ndarray]:
        """Return the tree with room for noting nodes."""
        arrays = self.arrays
        tree, wanted = with_room(arrays.tree, len(arrays.tree.first), look_ahead)
        return arrays._replace(tree=tree), wanted

    def make_cells(self, wanted: np.ndarray, threads: int, progress: Progress) -> tuple[Any, int]:
        """Split open leaves."""
        tree, count = split_open(self.cutter, self.arrays.tree, wanted, progress)
        return walked(tree, self.settings, lambda: self._topology_of(tree)), count

    @property
    def ropes(self) -> np.ndarray:
        """The links of all leaves there are, (n_leaves, 6) int32."""
        tree = self.arrays.tree
        nodes = self._topology_of(tree)
        return link(tree, nodes.boxes, nodes.leaves)

    def topology(self) -> Topology:
        """Return the boxes of all nodes there are; an open leaf is a leaf."""
        return self._topology_of(self.arrays.tree)

    def _topology_of(self, tree: LazyPointers) -> Topology:
        """Return the same of the tree at one time."""
        n_nodes, growing = len(tree.first), self.cutter.tree
        leaves = np.flatnonzero(tree.leaf >= 0)
        count = np.zeros(n_nodes, np.int32)
        count[leaves] = np.diff(tree.offsets)
        return Topology(
            growing.boxes[:n_nodes].copy(), growing.level[:n_nodes].astype(np.int64),
            tree.leaf >= 0, count, leaves,
        )  # fmt: skip

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return all cells there are; ``is_made`` is false of open leaves."""
        tree = self.arrays.tree
        nodes = self._topology_of(tree)
        inner = np.flatnonzero(~nodes.is_leaf)
        boxes = nodes.boxes[inner]
        corners = [planes_across(boxes, axis, tree.planes[inner, axis]) for axis in range(3)]
        children = tree.first[inner, None] + np.arange(8, dtype=np.int32)
        return Cells.sorted_by_depth(
            nodes.boxes, nodes.depth, nodes.is_leaf, nodes.count, {"is_made": tree.is_open == 0},
            planes=rectangles(np.concatenate(corners), np.tile(inner, 3)),
            parent=parents_of(len(nodes.depth), inner, children),
        )  # fmt: skip

    def extra_statistics(self) -> dict[str, Any]:
        """Return how many leaves rays have split, or found to be none that can be."""
        return {CELLS_MADE.key: self.made().cells}

    def validate(self) -> list[str]:
        """Check the tree as far as it is split."""
        return LinkedSubdivision.validate(self)


@kernel
def count_wrong_children(tree, children):
    """Return how many children the storage does not find."""
    wrong = 0
    for node in range(children.shape[0]):
        for octant in range(8):
            if child(tree, node, octant) != children[node, octant]:
                wrong += 1
    return wrong


STRUCTURE = Octree
