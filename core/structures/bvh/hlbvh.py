"""Hierarchical LBVH (HLBVH): split by cost where it matters, by Morton codes where there is much.

References whose codes begin with the same TREELET_BITS lie in one cell of a coarse grid. They are
a *treelet*, built like any LBVH. There are far fewer treelets than references, so their own tree,
the upper part, can be built with care: by the surface area heuristic, over their boxes.

J. Pantaleoni, D. Luebke: HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic
Geometry, HPG 2010. K. Garanzha, J. Pantaleoni, D. McAllister: Simpler and Faster HLBVH with Work
Queues, HPG 2011.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from ...parallel import Team
from ...progress import Progress
from ..contract import MAXIMUM_DEPTH
from . import binned_sah, lbvh
from .morton import sort_by_code
from .tree import Grouping, Primitives, Tree, depths_of, ranges_of

if TYPE_CHECKING:
    from .settings import BVHSettings

TREELET_BITS = 12
"""Leading bits that all codes of a treelet have in common: cells of a grid of 16 x 16 x 16."""


def build(primitives: Primitives, settings: BVHSettings, progress: Progress) -> Grouping:
    """Sort, build the upper tree over the treelets, then the treelets.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    bits = int(settings.morton_bits)
    with Team(progress, "Building bvh") as team:
        codes, order = sort_by_code(primitives.boxes, bits, team)
        starts = np.flatnonzero(np.diff(codes >> bits - TREELET_BITS, prepend=-1))
        top = build_top(primitives, order, starts, settings, progress)
        # The treelets in the order of the upper tree, and where each begins there.
        sizes = np.diff(starts, append=len(codes))[top.order]
        begins = np.concatenate([[0], np.cumsum(sizes)])
        source = np.arange(len(codes)) + np.repeat(starts[top.order] - begins[:-1], sizes)
        codes, order = codes[source], order[source]
        tree = lbvh.make_intervals(len(codes))
        upper, treelets = enter_top(tree, top.tree, begins)
        return lbvh.complete(
            tree, codes, primitives.boxes, order, upper, treelets, settings, team
        )


def build_top(
    primitives: Primitives,
    order: np.ndarray,
    starts: np.ndarray,
    settings: BVHSettings,
    progress: Progress,
) -> Grouping:
    """Return the tree over the treelets, which begin at `starts` in `order`; one in each leaf."""
    boxes = primitives.boxes[order]
    low = np.minimum.reduceat(boxes[:, :3], starts)
    high = np.maximum.reduceat(boxes[:, 3:], starts)
    treelets = Primitives(primitives.corners[:0], np.concatenate([low, high], axis=1))
    return binned_sah.build(treelets, dataclasses.replace(settings, max_leaf_size=1), progress)


def enter_top(
    tree: lbvh.Intervals, top: Tree, begins: np.ndarray
) -> tuple[list[int], list[int]]:
    """Enter the upper tree into the large one.

    Parameters
    ----------
    begins : (n_treelets + 1,) int64
        Where every treelet begins, and where the last one ends.

    Returns
    -------
    upper : list of int
        The nodes that were entered, parents before children.
    treelets : list of int
        The nodes that are to become treelets.
    """
    first, last = ranges_of(top.first, top.size, np.full(len(top.size), 2))
    is_leaf = top.size > 0
    left = top.first[~is_leaf]
    # What is cut before reference k gets children 2 k - 1 and 2 k.
    number = np.zeros(len(top.size), np.int64)
    number[left + 1] = 2 * begins[first[left + 1]]
    number[left] = number[left + 1] - 1
    tree.begin[number] = begins[first]
    tree.size[number] = begins[last] - begins[first]
    tree.first[number[~is_leaf]] = number[left]
    return number[~is_leaf].tolist(), number[is_leaf].tolist()
