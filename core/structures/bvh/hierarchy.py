"""Bounding volume hierarchy (BVH): every node has a volume around the triangles below it.

A ray that misses the volume misses them all. Three choices are independent: how the triangles are
grouped (:mod:`.builders`), how the tree is rearranged afterwards (:mod:`.optimisers`), and what
volume is put around each group (:mod:`.fit`).
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...geometry.box import Boxes, boxes_of, surface_area
from ...geometry.triangle import triangles_of
from ...geometry.volume import MOST_STRIPS
from ...progress import SILENT, Progress
from ...scene import Scene
from ..cells import Cells
from ..contract import STACK_SIZE, Statistics, Structure
from .builders import BUILDERS
from .collapse import LeafRule, collapse
from .fit import fit_all
from .optimisers import OPTIMISERS
from .settings import BVHSettings
from .tree import Grouping, Pieces, Primitives, Tree, depths_of, linked, ranges_of
from .walk import Binary, VolumeWorkspace
from .wide import WideTree, widened
from .wide_walk import WIDE_STACK_SIZE, Wide


class BVH(Structure):
    """Hierarchy of bounding volumes.

    Attributes
    ----------
    pieces : Pieces or None
        The parts of triangles that references stand for, if not for whole ones.
    costs : list of float
        SAH cost before the first step of the optimiser and after each.
    figures : dict
        What else there is to say about this tree.
    """

    name = "bvh"
    label = "BVH"
    summary = "Tree of bounding volumes, walked front to back"
    Settings = BVHSettings

    arrays: Binary | Wide
    pieces: Pieces | None
    costs: list[float]
    figures: dict[str, Any]
    # Boxes, two trees of up to two nodes per triangle, and the reordered triangles.
    BYTES_PER_TRIANGLE = 330

    @classmethod
    def build(cls, scene: Scene, settings: BVHSettings, progress: Progress = SILENT) -> BVH:
        """Group the triangles, rearrange the tree, fit the volumes."""
        cls.refuse_too_large(scene, settings)
        grouping, costs = group(scene, settings, progress)
        structure = cls(scene, settings, None, triangles_of(scene, grouping.order))
        structure.pieces, structure.costs = grouping.pieces, costs
        structure.figures = grouping.figures
        tree: Tree | WideTree = grouping.tree
        width = np.full(len(tree.size), 2)
        if settings.arity != "2":
            structure.figures |= {"binary": figures_of_binary(grouping.tree, settings)}
            tree = widened(grouping.tree, int(settings.arity))
            width = tree.width
        if settings.volume == "aabb":
            volumes = Boxes(tree.boxes)
        else:
            begin, end = ranges_of(tree.first, tree.size, width)
            corners = structure.triangles.corners
            if grouping.pieces:
                corners, offsets = grouping.pieces
                begin, end = offsets[begin], offsets[end]
            volumes = fit_all(settings.volume, corners, begin, end, progress)
        if isinstance(tree, WideTree):
            structure.arrays = Wide(volumes, tree.first, tree.size, tree.width)
        else:
            structure.arrays = Binary(volumes, tree.first, tree.size)
        return structure

    def width(self) -> np.ndarray:
        """Return how many children every node has, (n_nodes,) int."""
        if isinstance(self.arrays, Wide):
            return self.arrays.width
        return np.where(self.arrays.size > 0, 0, 2)

    def depths(self) -> np.ndarray:
        """Return the depth of every node, (n_nodes,) int64."""
        return depths_of(self.arrays.first, self.arrays.size, self.width())

    def cells(self) -> Cells:
        """Return the volumes of all nodes; a cell's number is its node."""
        count = self.arrays.size
        return Cells.sorted_by_depth(self.arrays.volumes.boxes(), self.depths(), count > 0, count)

    def statistics(self) -> Statistics:
        """Return the figures of the tree; areas are those of the volumes themselves."""
        count = self.arrays.size
        areas = self.arrays.volumes.areas()
        extra = self.figures | {
            "expected_volume_tests": 1.0 + float((areas * self.width()).sum() / areas[0])
        }
        return Statistics.of_cells(
            areas, count > 0, count, self.depths(), float(areas[0]),
            self.settings.C_trav, self.settings.C_isect, extra,
        )  # fmt: skip

    def memory(self) -> int:
        """Return the bytes of the tree and its volumes."""
        volumes, *others = self.arrays
        return sum(array.nbytes for array in (*volumes, *others))

    def _workspace(self) -> Any:
        size = WIDE_STACK_SIZE if isinstance(self.arrays, Wide) else STACK_SIZE
        return VolumeWorkspace(np.empty(size, np.int32), np.empty(size), np.empty((MOST_STRIPS, 3)))

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
        width = self.width()[inner]
        rank = np.arange(width.sum()) - np.repeat(np.cumsum(width) - width, width)
        children = np.repeat(first[inner], width) + rank
        if not np.array_equal(np.sort(children), np.arange(1, len(count))):
            violations.append("a node has no parent or several")
        elif len(inner):
            starts = np.cumsum(width) - width
            union_low = np.minimum.reduceat(boxes[children, :3], starts)
            union_high = np.maximum.reduceat(boxes[children, 3:], starts)
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
    pieces = reordered(grouping.pieces, order)
    return Grouping(collapsed, grouping.order[order], pieces, grouping.figures), costs


def figures_of_binary(tree: Tree, settings: BVHSettings) -> dict[str, float]:
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


def reordered(pieces: Pieces | None, order: np.ndarray) -> Pieces | None:
    """Return the pieces of references that are in another order now."""
    if pieces is None:
        return None
    sizes = np.diff(pieces.offsets)[order]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    rank = np.arange(offsets[-1]) - np.repeat(offsets[:-1], sizes)
    return Pieces(pieces.corners[np.repeat(pieces.offsets[:-1][order], sizes) + rank], offsets)
