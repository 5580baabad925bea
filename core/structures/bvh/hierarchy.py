"""Bounding volume hierarchy (BVH) over axis-aligned boxes.

A binary tree: every node has a box around the triangles below it. A ray that misses the box misses
them all.

The walk goes front to back: of two children the nearer is entered first, the other waits on a
stack and is thrown away if a hit nearer than its box has been found meanwhile.

How the triangles are grouped is the builder's affair: see :mod:`.binned`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.box import MISS, boxes_of, enter_box, surface_area
from ...geometry.rays import ALL, ANY
from ...geometry.triangle import intersect, triangles_of
from ...kernels import implements
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import setting
from ..cells import Cells
from ..contract import (
    Found,
    Statistics,
    Structure,
    intersection_cost,
    traversal_cost,
    walk,
)
from ..steps import HIT, NONE, SKIP, TEST, VISIT_INNER, VISIT_LEAF, VOLUME_TEST, note
from .binned import SplitRule, build_tree
from .tree import BVHArrays

# ------------------------------------------------------------------------------------- settings


@dataclass(frozen=True)
class BVHSettings:
    """Settings of the bounding volume hierarchy."""

    builder: str = setting(
        "binned",
        "Builder",
        "How the triangles are grouped",
        choices={"binned": "From the top down, SAH evaluated at bin borders (Wald 2007)"},
    )
    max_leaf_size: int = setting(
        4,
        "Max Leaf Size",
        "A node with more triangles is always split",
        unit="triangles",
        minimum=1,
        maximum=1024,
    )
    bins: int = setting(
        16, "Bins", "Candidate intervals per axis", unit="bins", minimum=2, maximum=64
    )
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()


# ------------------------------------------------------------------------------------------ walk


ROOT, ONE = np.uint64(0), np.uint64(1)


@implements(walk, BVHArrays)
def walk_bvh(structure, triangles, ray, number, workspace, log):
    """Front-to-back traversal with a stack.

    Node numbers are unsigned: Numba then leaves out the look at negative indices, 5% of the time.
    """
    boxes, firsts, sizes = structure.boxes, structure.first, structure.size
    cells, enters = workspace.cells, workspace.enters
    best_t, best = np.inf, NONE
    limit = ray.t_max
    nodes_visited, leaves_visited, tests, volume_tests = 0, 0, 0, 1

    node, height = ROOT, 0
    t = enter_box(boxes, node, ray, limit)
    note(log, VOLUME_TEST, node, NONE, t, t)
    searching = t != MISS
    while searching:
        nodes_visited += 1
        size = sizes[node]
        if size == 0:
            note(log, VISIT_INNER, node, NONE, t, limit)
            near = np.uint64(firsts[node])
            far = near + ONE
            near_t = enter_box(boxes, near, ray, limit)
            far_t = enter_box(boxes, far, ray, limit)
            volume_tests += 2
            note(log, VOLUME_TEST, near, NONE, near_t, near_t)
            note(log, VOLUME_TEST, far, NONE, far_t, far_t)
            if far_t < near_t:
                near, far, near_t, far_t = far, near, far_t, near_t
            if far_t != MISS:
                cells[height], enters[height] = far, far_t
                height += 1
            if near_t != MISS:
                node, t = near, near_t
                continue
        else:
            leaves_visited += 1
            note(log, VISIT_LEAF, node, NONE, t, limit)
            for i in range(firsts[node], firsts[node] + size):
                hit_t = intersect(triangles, i, ray)
                tests += 1
                n = np.int64(triangles.ids[i])
                note(log, TEST, node, n, hit_t, hit_t)
                if hit_t <= ray.t_max and (hit_t < best_t or (hit_t == best_t and n < best)):
                    best_t, best = hit_t, n
                    note(log, HIT, node, n, hit_t, hit_t)
                    if ray.query != ALL:
                        limit = hit_t
            if ray.query == ANY and best >= 0:
                break
        # Back to the last node put aside that a nearer hit has not made useless.
        searching = False
        while height > 0 and not searching:
            height -= 1
            node, t = np.uint64(cells[height]), enters[height]
            searching = t <= limit
            if not searching:
                note(log, SKIP, node, NONE, t, limit)

    return Found(best_t, best, nodes_visited, leaves_visited, 0, tests, volume_tests, 0, 0, 0)


# ------------------------------------------------------------------------------- the structure


class BVH(Structure):
    """Hierarchy of axis-aligned bounding boxes."""

    name = "bvh"
    label = "BVH"
    summary = "Binary tree of boxes, split by the surface area heuristic, walked front to back"
    Settings = BVHSettings

    arrays: BVHArrays
    # Boxes, two trees of up to two nodes per triangle, and the reordered triangles.
    BYTES_PER_TRIANGLE = 330

    @classmethod
    def build(cls, scene: Scene, settings: BVHSettings, progress: Progress = SILENT) -> BVH:
        """Build the tree, then put the triangles into the order of its leaves."""
        cls.refuse_too_large(scene, settings)
        rule = SplitRule(settings.max_leaf_size, settings.bins, settings.C_trav, settings.C_isect)
        tree, order = build_tree(boxes_of(scene.triangles), rule, progress)
        return cls(scene, settings, tree, triangles_of(scene, order))

    def depths(self) -> np.ndarray:
        """Return the depth of every node, (n_nodes,) int64."""
        first, count = self.arrays.first, self.arrays.size
        depth = np.zeros(len(count), dtype=np.int64)
        level = np.zeros(1, dtype=np.int64)
        below = 0
        while len(level):
            depth[level] = below
            left = first[level[count[level] == 0]].astype(np.int64)
            level = np.concatenate([left, left + 1])
            below += 1
        return depth

    def cells(self) -> Cells:
        """Return the boxes of all nodes; a cell's number is its node."""
        count = self.arrays.size
        return Cells.sorted_by_depth(self.arrays.boxes, self.depths(), count > 0, count)

    def statistics(self) -> Statistics:
        """Return the figures of the tree."""
        count = self.arrays.size
        areas = surface_area(self.arrays.boxes)
        return Statistics.of_cells(
            areas, count > 0, count, self.depths(), float(areas[0]),
            self.settings.C_trav, self.settings.C_isect,
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Check that leaves partition the triangles and that boxes contain what is below them."""
        violations = []
        boxes, first, count = self.arrays
        leaves = np.flatnonzero(count > 0)
        covered = np.concatenate([np.arange(first[n], first[n] + count[n]) for n in leaves])
        if not np.array_equal(np.sort(covered), np.arange(len(self.scene))):
            violations.append("the leaves do not partition the triangles")
        if not np.array_equal(np.sort(self.triangles.ids), np.arange(len(self.scene))):
            violations.append("the order of the triangles is not a permutation")
        inner = np.flatnonzero(count == 0)
        children = np.concatenate([first[inner], first[inner] + 1])
        if not np.array_equal(np.sort(children), np.arange(1, len(count))):
            violations.append("a node has no parent or several")
        parents = np.concatenate([inner, inner])
        union_low = np.minimum(boxes[first[inner], :3], boxes[first[inner] + 1, :3])
        union_high = np.maximum(boxes[first[inner], 3:], boxes[first[inner] + 1, 3:])
        if (boxes[parents[: len(inner)]] != np.concatenate([union_low, union_high], 1)).any():
            violations.append("a node's box is not the union of its children's")
        own = boxes_of(self.scene.triangles[self.triangles.ids[covered]])
        leaf_boxes = boxes[np.repeat(leaves, count[leaves])]
        if (own[:, :3] < leaf_boxes[:, :3]).any() or (own[:, 3:] > leaf_boxes[:, 3:]).any():
            violations.append("a triangle sticks out of its leaf")
        return violations
