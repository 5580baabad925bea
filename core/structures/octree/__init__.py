"""Octree: a box is cut into eight until few triangles are left in each part.

All three planes of a cell cut it at once, in the middle or where it costs least
(:mod:`.planes`). The same tree can be stored in four ways (:mod:`.storage`) and walked in five
(:mod:`..subdivision.walks`).

A triangle belongs to every leaf that its box overlaps (or it itself: exact assignment). Cells are
closed on both sides: a triangle that only touches a plane belongs to both. Under open overlap it
belongs to one; published counts exist for both.

A. Glassner: Space Subdivision for Fast Ray Tracing, IEEE CG&A 4(10), 1984.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.box import boxes_of
from ...geometry.triangle import Triangles, triangles_of
from ...kernels import call, kernel
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import setting
from ..cells import Cells, planes_across, rectangles, when_divided
from ..contract import intersection_cost, traversal_cost
from ..subdivision.frontier import ORDERS, budget_setting, order_setting
from ..subdivision.settings import (
    leaf_size_setting,
    links_setting,
    mailbox_setting,
    padding_setting,
    walk_setting,
)
from ..subdivision.structure import Subdivision, Topology, padded_box
from ..subdivision.tree import child
from . import octants as octants  # registers the kernels of the storages
from .assignment import assignment_named
from .build import Rule, finish, grow
from .planes import PLACEMENTS
from .storage import STORAGES, BuiltTree, HashOctree, chain_lengths, topology_bytes


@dataclass(frozen=True)
class OctreeSettings:
    """Settings of the octree."""

    max_depth: int = setting(
        8,
        "Max Depth",
        "Level K at which subdivision ends; the root has level 0",
        unit="levels",
        minimum=0,
        maximum=60,
    )
    max_leaf_size: int = leaf_size_setting(8)
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
        "box",
        "Assignment",
        "What is compared with a cell",
        choices={"box": "The triangle's bounding box", "exact": "The triangle itself"},
    )
    mailbox: bool = mailbox_setting()
    budget: int = budget_setting()
    order: str = order_setting()
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()


class Octree(Subdivision):
    """Adaptive subdivision into octants."""

    name = "octree"
    label = "Octree"
    summary = "Cells cut into eight, stored in four ways, walked in five"
    Settings = OctreeSettings
    has_links = True

    def __init__(
        self, scene: Scene, settings: OctreeSettings, built: BuiltTree, triangles: Triangles
    ) -> None:
        super().__init__(scene, settings, None, triangles)
        self.built = built
        self.with_walk(STORAGES[settings.storage](built))

    @classmethod
    def build(cls, scene: Scene, settings: OctreeSettings, progress: Progress = SILENT) -> Octree:
        """Subdivide, number the nodes, store the tree."""
        refuse_if_too_large(
            len(scene) * 150, f"an octree over {len(scene)} triangles", "use a smaller scene"
        )
        triangles = triangles_of(scene)
        closed = settings.overlap == "closed"
        rule = Rule(
            settings.max_depth,
            settings.max_leaf_size,
            settings.budget or 2**31 - 1,
            ORDERS[settings.order],
            PLACEMENTS[settings.planes],
            assignment_named(settings.assignment, triangles, boxes_of(scene.triangles), closed),
        )
        box = padded_box(scene.lower, scene.upper, settings.padding)
        tree = grow(len(scene), box, rule, progress)
        return cls(scene, settings, finish(tree), triangles)

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

    def cells(self) -> Cells:
        """Return the cells of all nodes, with the three planes that cut each inner one."""
        built, nodes = self.built, self.topology()
        n_inner = len(built.planes)
        corners = [planes_across(nodes.boxes[:n_inner], a, built.planes[:, a]) for a in range(3)]
        planes = rectangles(np.concatenate(corners), np.tile(np.arange(n_inner), 3))
        return Cells.sorted_by_depth(
            nodes.boxes, nodes.depth, nodes.is_leaf, nodes.count, {"order": built.order},
            planes=planes,
            divided=when_divided(built.order, np.arange(n_inner), built.children[:, 0]),
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
