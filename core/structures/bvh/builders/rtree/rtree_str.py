"""R-tree packed at once: sort-tile-recursive (STR).

All boxes are known beforehand, so no node needs to be less than full. To fill P = N / M nodes, the
boxes are sorted by the x of their centres and cut into some P^(1/3) slabs, each slab is sorted by y
and cut into some P^(1/3) columns, each column is sorted by z, and every M boxes in a row are a
node. Then the same is done with the boxes of these nodes, until one node holds all.

S. T. Leutenegger, M. A. Lopez, J. Edgington: STR: A Simple and Efficient Algorithm for R-Tree
Packing, ICDE 1997.
"""

from __future__ import annotations

import math

import numpy as np

from .....progress import Progress
from ...topology.build_log import grouping_of_merges
from ...topology.collapse import LeafRule, LeafSettings
from ...topology.tree import Builder, Grouping, Primitives
from .nodes import LEAST, MOST, RTree, binary, binary_levels


def slab_size(count: int, axis: int) -> int:
    """Return how many of `count` boxes go into one slab across x (axis 0) or y (1).

    M ceil(P^((k - 1) / k)), where k is how many axes are left; always full nodes.
    """
    pages, k = math.ceil(count / MOST), 3 - axis
    # Rounded: the cube root of a cube is not whole in floating point.
    return MOST * math.ceil(round(pages ** ((k - 1) / k), 9))


def tile(centres: np.ndarray, members: np.ndarray, axis: int) -> np.ndarray:
    """Return the members of a slab in the order in which nodes take them, MOST at a time."""
    members = members[np.argsort(centres[members, axis], kind="stable")]
    if axis == 2:
        return members
    size = slab_size(len(members), axis)
    slabs = [members[i : i + size] for i in range(0, len(members), size)]
    return np.concatenate([tile(centres, slab, axis + 1) for slab in slabs])


def pack_level(boxes: np.ndarray, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Group boxes (n, 6) into nodes.

    Returns
    -------
    order : (n,) int64
        The boxes, those of a node one after the other.
    offsets : (n_nodes + 1,) int64
        Where each node begins.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    n = len(boxes)
    centres = boxes[:, :3] + boxes[:, 3:]
    by_x = np.argsort(centres[:, 0], kind="stable")
    size = slab_size(n, 0)
    slabs = []
    for first in range(0, n, size):
        progress.report(0, 1, "Building bvh")
        slabs.append(tile(centres, by_x[first : first + size], 1))
    offsets = np.append(np.arange(0, n, MOST), n)
    if len(offsets) > 2 and n - offsets[-2] < LEAST:
        offsets[-2] = n - LEAST  # the last but one can spare them
    return np.concatenate(slabs), offsets


def pack(boxes: np.ndarray, progress: Progress) -> RTree:
    """Return the R-tree that is packed from boxes (n, 6).

    Raises
    ------
    Cancelled
        From `progress`.
    """
    all_boxes, children = [boxes], []
    sizes: list[np.ndarray] = []
    levels: list[np.ndarray] = []
    below = 0  # the first entry of the level to be packed
    while not sizes or len(sizes[-1]) > 1:
        order, offsets = pack_level(all_boxes[-1], progress)
        size = np.diff(offsets)
        places = np.minimum(offsets[:-1, None] + np.arange(MOST + 1), len(order) - 1)
        children.append(below + order[places])
        sizes.append(size.astype(np.int32))
        levels.append(np.full(len(size), len(levels), np.int32))
        sorted_boxes = all_boxes[-1][order]
        low = np.minimum.reduceat(sorted_boxes[:, :3], offsets[:-1])
        high = np.maximum.reduceat(sorted_boxes[:, 3:], offsets[:-1])
        below += len(order)
        all_boxes.append(np.concatenate([low, high], axis=1))
    progress.report(1, 1, "Building bvh")
    return RTree(*map(np.concatenate, (all_boxes, children, sizes, levels)))


def build_rtree_str(
    primitives: Primitives, settings: LeafSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    rtree = pack(primitives.boxes, progress)
    level = 1 + binary_levels(rtree) if log else None
    return grouping_of_merges(binary(rtree, progress), LeafRule.of(settings), level)


BUILDER = Builder(
    "R-tree packed by sort-tile-recursive (Leutenegger 1997)",
    LeafSettings,
    build_rtree_str,
    bytes_per_triangle=520,
)
