"""Bounding volume hierarchy (BVH): every node has a volume around the triangles below it.

A ray that misses the volume misses them all. Three choices are independent: how the triangles are
grouped (:mod:`.builders`), how the tree is rearranged afterwards (:mod:`.optimisers`), and what
volume is put around each group (:mod:`.fit`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...geometry.box import Boxes, boxes_of
from ...geometry.triangle import triangles_of
from ...geometry.volume import MOST_STRIPS
from ...progress import SILENT, Progress
from ...scene import Scene
from ..cells import Cells
from ..contract import STACK_SIZE, Statistics, Structure
from ..exhibits import Exhibit
from .builders import BUILDERS
from .collapse import LeafRule, collapse
from .efficiency import Efficiency, hierarchy_efficiency
from .exhibits_efficiency import nodes_not_paying, overlapping_siblings
from .exhibits_refit import Moment, refit_over_timeline
from .exhibits_split_plane import split_planes
from .fit import fit_all
from .optimisers import OPTIMISERS
from .overlap import sibling_overlap
from .settings import BVHSettings
from .tree import Grouping, Pieces, Primitives, depths_of, linked, ranges_of
from .walk import Binary, VolumeWorkspace


class BVH(Structure):
    """Hierarchy of bounding volumes.

    Attributes
    ----------
    pieces : Pieces or None
        The parts of triangles that references stand for, if not for whole ones.
    costs : list of float
        SAH cost before the first step of the optimiser and after each.
    history : sequence of Moment
        The animation over which the tree was refitted, if it was.
    """

    name = "bvh"
    label = "BVH"
    summary = "Tree of bounding volumes, walked front to back"
    Settings = BVHSettings

    arrays: Binary
    pieces: Pieces | None
    costs: list[float]
    history: Sequence[Moment] = ()
    # Boxes, two trees of up to two nodes per triangle, and the reordered triangles.
    BYTES_PER_TRIANGLE = 330

    @classmethod
    def build(cls, scene: Scene, settings: BVHSettings, progress: Progress = SILENT) -> BVH:
        """Group the triangles, rearrange the tree, fit the volumes."""
        cls.refuse_too_large(scene, settings)
        grouping, costs = group(scene, settings, progress)
        structure = cls(scene, settings, None, triangles_of(scene, grouping.order))
        structure.pieces, structure.costs = grouping.pieces, costs
        tree = grouping.tree
        if settings.volume == "aabb":
            volumes = Boxes(tree.boxes)
        else:
            width = np.full(len(tree.size), 2)
            begin, end = ranges_of(tree.first, tree.size, width)
            corners = structure.triangles.corners
            if grouping.pieces:
                corners, offsets = grouping.pieces
                begin, end = offsets[begin], offsets[end]
            volumes = fit_all(settings.volume, corners, begin, end, progress)
        structure.arrays = Binary(volumes, tree.first, tree.size)
        return structure

    def width(self) -> np.ndarray:
        """Return how many children every node has, (n_nodes,) int."""
        return np.where(self.arrays.size > 0, 0, 2)

    def depths(self) -> np.ndarray:
        """Return the depth of every node, (n_nodes,) int64."""
        return depths_of(self.arrays.first, self.arrays.size, self.width())

    def cells(self) -> Cells:
        """Return the volumes of all nodes; a cell's number is its node."""
        count = self.arrays.size
        efficiency = self.efficiency()
        extra = {
            "gain": efficiency.gain,
            "expected_gain": efficiency.expected_gain,
            "overlap": self.overlap(),
        }
        return Cells.sorted_by_depth(
            self.arrays.volumes.boxes(), self.depths(), count > 0, count, extra
        )

    def efficiency(self) -> Efficiency:
        """Return whether each node pays, by the lecture's inequality."""
        return hierarchy_efficiency(
            self.arrays.volumes.areas(), self.arrays.first, self.arrays.size, self.width(),
            self.settings.C_trav, self.settings.C_isect,
        )  # fmt: skip

    def overlap(self) -> np.ndarray:
        """Return how much the children of each node overlap, (n_nodes,); 0 for leaves."""
        return sibling_overlap(self.arrays.volumes.boxes(), self.arrays.first, self.width())

    def statistics(self) -> Statistics:
        """Return the figures of the tree; areas are those of the volumes themselves."""
        count = self.arrays.size
        areas = self.arrays.volumes.areas()
        is_inner, efficiency = count == 0, self.efficiency()
        extra = {
            "overlap": float(self.overlap()[is_inner].mean()) if is_inner.any() else 0.0,
            "nodes_not_paying": int((efficiency.gain[is_inner] <= 0.0).sum()),
            "nodes_not_paying_expected": int((efficiency.expected_gain[is_inner] <= 0.0).sum()),
        }
        return Statistics.of_cells(
            areas, count > 0, count, self.depths(), float(areas[0]),
            self.settings.C_trav, self.settings.C_isect, extra,
        )  # fmt: skip

    def memory(self) -> int:
        """Return the bytes of the tree and its volumes."""
        arrays = [*self.arrays.volumes, self.arrays.first, self.arrays.size]
        return sum(array.nbytes for array in arrays)

    def _workspace(self) -> Any:
        return VolumeWorkspace(
            np.empty(STACK_SIZE, np.int32), np.empty(STACK_SIZE), np.empty((MOST_STRIPS, 3))
        )

    def exhibits(self) -> list[Exhibit]:
        """Return what else there is to show of this hierarchy."""
        exhibits = [split_planes(self), nodes_not_paying(self), overlapping_siblings(self)]
        return exhibits + ([refit_over_timeline(self)] if self.history else [])

    def validate(self) -> list[str]:
        """Check that leaves partition the triangles and that volumes contain what is below."""
        violations = []
        first, count = self.arrays.first, self.arrays.size
        boxes = self.arrays.volumes.boxes()
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
        union_low = np.minimum(boxes[first[inner], :3], boxes[first[inner] + 1, :3])
        union_high = np.maximum(boxes[first[inner], 3:], boxes[first[inner] + 1, 3:])
        if (boxes[inner] != np.concatenate([union_low, union_high], 1)).any():
            violations.append("a node's box is not the union of its children's")
        own = boxes_of(self.scene.triangles[self.triangles.ids[covered]])
        leaf_boxes = boxes[np.repeat(leaves, count[leaves])]
        if (own[:, :3] < leaf_boxes[:, :3]).any() or (own[:, 3:] > leaf_boxes[:, 3:]).any():
            violations.append("a triangle sticks out of its leaf")
        return violations


def group(scene: Scene, settings: BVHSettings, progress: Progress) -> tuple[Grouping, list[float]]:
    """Group the triangles of a scene as the settings say.

    An optimiser works on single triangles, and leaves are chosen by cost afterwards.

    Returns
    -------
    grouping : Grouping
    costs : list of float
        What the optimiser returned.
    """
    build = BUILDERS[settings.builder][1]
    optimise = OPTIMISERS[settings.optimise][1]
    primitives = Primitives(scene.triangles, boxes_of(scene.triangles))
    if optimise is None:
        return build(primitives, settings, progress), []
    grouping = build(primitives, dataclasses.replace(settings, max_leaf_size=1), progress)
    tree = linked(grouping.tree)
    costs = optimise(tree, settings, progress)
    rule = LeafRule(settings.max_leaf_size, settings.C_trav, settings.C_isect)
    collapsed, order = collapse(tree, rule)
    # A reference that a leaf holds now was number order[i] for the builder.
    return Grouping(collapsed, grouping.order[order], reordered(grouping.pieces, order)), costs


def reordered(pieces: Pieces | None, order: np.ndarray) -> Pieces | None:
    """Return the pieces of references that are in another order now."""
    if pieces is None:
        return None
    sizes = np.diff(pieces.offsets)[order]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    rank = np.arange(offsets[-1]) - np.repeat(offsets[:-1], sizes)
    return Pieces(pieces.corners[np.repeat(pieces.offsets[:-1][order], sizes) + rank], offsets)
