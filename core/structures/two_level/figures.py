"""Figures of two levels: what the cost of both is, how much instances overlap, what they take.

The surface area heuristic over both levels counts nodes as a random line through the box around all
instances meets them: those of the top level as they are, those of a mesh where its instance puts
them, as parallelepipeds. A line meets a convex body as often as its surface is large. So the cost
of an instance follows from three sums over its tree, one for each pair of opposite faces. Each
level has the constants of its own settings.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...contract.figures import Figure
from ...geometry.box_shape import surface_area
from ...geometry.instances import is_of_triangles, primitives_in
from ...progress import Progress
from ..bvh import BVH
from ..bvh.grouping import group
from ..bvh.topology.tree import depths_of

OF_BOTH = "Two levels"

MOST_FLATTENED = 200_000
"""Triangles of a scene up to which it is flattened, to be compared with."""

MOST_ASKED = 1_000
"""Instances that are asked how many others they overlap; if there are more, evenly chosen ones."""

FIGURES = (
    *BVH.FIGURES,
    Figure("n_instances", "instances", "Instances", "count", OF_BOTH),
    Figure("bottom_levels", "structures of meshes", "Bottom levels", "count", OF_BOTH),
    Figure("bytes_top", "bytes of the top level and of all instances", "Memory of the top level",
           "bytes", OF_BOTH),
    Figure("bytes_bottom", "bytes of the structures of meshes", "Memory of bottom levels",
           "bytes", OF_BOTH),
    Figure("bytes_per_instance", "bytes of the top level per instance", "Bytes per instance", "",
           OF_BOTH),
    Figure("instances_overlapped",
           "how many others the box of an instance overlaps, in the mean over 1000 at most",
           "Overlapped by", "", OF_BOTH),
    Figure("expected_instances",
           "boxes of instances that an endless random line through the root meets on average",
           "Instances met", "", OF_BOTH),
    Figure("sah_two_levels",
           "SAH cost of whole instances in the top level and of what is below, of lines through "
           "the root", "SAH of two levels", "", OF_BOTH, column="SAH of both"),
    Figure("sah_rebraided", "the same where instances are opened", "SAH re-braided", "", OF_BOTH),
    Figure("sah_flattened",
           "the same of one tree over all triangles, if they are not too many to try",
           "SAH flattened", "", OF_BOTH),
    Figure("references_per_instance", "references to an instance, on average",
           "References per instance", "", OF_BOTH),
    Figure("nodes_opened", "nodes of bottom levels that were opened", "Nodes opened", "count",
           OF_BOTH),
)  # fmt: skip


def figures_of(structure: Any, progress: Progress) -> dict[str, Any]:
    """Return the figures of both levels."""
    geometry = structure.scene.geometry
    count = len(geometry.ids)
    top = structure.bytes_of_top()
    root = surface_area(np.concatenate([structure.scene.lower, structure.scene.upper])[None])[0]
    figures = {
        "n_instances": count,
        "bottom_levels": len(structure.bottoms),
        "bytes_top": top,
        "bytes_bottom": structure.bytes_of_bottoms(),
        "bytes_per_instance": top / count,
        "instances_overlapped": mean_overlapped(geometry.boxes),
        "expected_instances": float(surface_area(geometry.boxes).sum() / root),
    }
    if structure.levels == 1:
        figures |= costs_of(structure, float(root), progress)
    if structure.braid is not None:
        figures["references_per_instance"] = len(structure.braid.references.owner) / count
        figures["nodes_opened"] = len(structure.braid.opened)
    return figures


def mean_overlapped(boxes: np.ndarray) -> float:
    """Return how many others a box overlaps, in the mean over MOST_ASKED of them at most."""
    step = -(-len(boxes) // MOST_ASKED)
    asked, found = boxes[::step], 0
    for box in asked:
        meets = (boxes[:, :3] <= box[3:]).all(axis=1) & (boxes[:, 3:] >= box[:3]).all(axis=1)
        found += int(meets.sum()) - 1
    return found / len(asked)


def costs_of(structure: Any, root: float, progress: Progress) -> dict[str, float]:
    """Return SAH costs of two levels, re-braided, and flattened, for lines through one box.

    Parameters
    ----------
    root : float
        Surface area of the box.
    """
    geometry, settings = structure.scene.geometry, structure.tlas.settings
    weights = np.stack([face_sums(each) for _, each in structure.bottoms])
    which = geometry.which if structure.settings.shared else np.arange(len(geometry.ids))
    faces = face_factors(geometry.matrices)
    below = float((weights[which] * faces).sum())
    if structure.braid is None:
        tree: Any = structure.tlas.arrays
        boxes = tree.volumes.boxes()
    else:
        grouping, _ = group(geometry, settings, progress, False)
        tree = grouping.tree
        boxes = tree.boxes
    above = settings.C_trav * float(surface_area(boxes)[tree.size == 0].sum())
    costs = {"sah_two_levels": (above + below) / root}
    if structure.braid is not None:
        costs["sah_rebraided"] = cost_of_braid(structure, faces) / root
    bottom = structure.bottoms[0][1]
    few = primitives_in(geometry) <= MOST_FLATTENED
    if few and is_of_triangles(geometry) and isinstance(bottom, BVH):
        flat = BVH.build(structure.scene.flat(), bottom.settings, progress)
        own = float(surface_area(flat.arrays.volumes.boxes()[:1])[0])
        costs["sah_flattened"] = flat.statistics(progress).sah * own / root
    return costs


def face_factors(matrices: np.ndarray) -> np.ndarray:
    """Return how much larger matrices, (n, 3, 4), make faces across x, y and z, (n, 3).

    Twice that, since a box has two of each.
    """
    x, y, z = (matrices[:, :, axis] for axis in range(3))
    across = np.cross(y, z), np.cross(z, x), np.cross(x, y)
    return 2.0 * np.linalg.norm(np.stack(across, axis=1), axis=2)


def faces_of(boxes: np.ndarray) -> np.ndarray:
    """Return the areas of the faces of boxes, (n, 6), across x, y and z, (n, 3)."""
    x, y, z = (boxes[:, 3:] - boxes[:, :3]).T
    return np.stack([y * z, z * x, x * y], axis=1)


def face_sums(bottom: Any) -> np.ndarray:
    """Return the sums of the faces of all cells of a structure by what they cost, (3,)."""
    cells, settings = bottom.cells(), bottom.settings
    costs = np.where(cells.is_leaf, settings.C_isect * cells.count, settings.C_trav)
    return (costs[:, None] * faces_of(cells.boxes)).sum(axis=0)


def cost_of_braid(structure: Any, faces: np.ndarray) -> float:
    """Return the cost of a re-braided top level and of what is below, times the root's area."""
    below, forest = structure.bottoms[0][1].settings, structure.instances.forest
    tree, references = structure.braid.tree, structure.braid.references
    sums = np.where(forest.size > 0, below.C_isect * forest.size, below.C_trav)[:, None]
    sums = sums * faces_of(forest.volumes.boxes())
    depth = np.zeros(len(forest.size), np.int64)
    for number, root in enumerate(structure.instances.roots):
        end = structure.instances.roots[number + 1 :][:1]
        here = slice(root, int(end[0]) if len(end) else len(depth))
        size = forest.size[here]
        depth[here] = depths_of(forest.first[here] - root, size, np.where(size > 0, 0, 2))
    for level in range(int(depth.max()) - 1, -1, -1):
        inner = np.flatnonzero((depth == level) & (forest.size == 0))
        sums[inner] += sums[forest.first[inner]] + sums[forest.first[inner] + 1]
    is_there = references.node >= 0
    owner, node = references.owner[is_there], references.node[is_there]
    above = structure.tlas.settings.C_trav * surface_area(tree.boxes)[tree.size == 0].sum()
    return float(above + (sums[node] * faces[owner]).sum())
