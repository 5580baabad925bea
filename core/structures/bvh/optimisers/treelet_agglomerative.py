"""Agglomerative treelet restructuring (ATRBVH): treelets of nine, joined pair by pair.

As in :mod:`.treelet`, but the tree over the leaves of a treelet is not the best of all: the two
nodes whose common box is smallest become the children of a new one, until one is left. That takes
n^3 steps instead of 3^n, so that treelets can be larger. Where it does not beat the old tree, that
one stays.

L. Domingues, H. Pedrini: Bounding Volume Hierarchy Optimization through Agglomerative Treelet
Restructuring, HPG 2015.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....contract.costs import CostSettings
from ....geometry.box import union_area
from ....kernels import implements
from ....progress import Progress
from ..topology.tree import LinkedTree
from .rearranging import Optimiser, Rearrangement
from .treelet import arrange, restructure

LEAVES = 9
"""Leaves of a treelet, as in the paper."""


class Clusters(NamedTuple):
    """Scratch memory: the nodes that have no parent yet.

    Attributes
    ----------
    numbers : (LEAVES,) int32
        What the treelet calls them.
    boxes : (LEAVES, 6) float64
    distances : (LEAVES, LEAVES) float64
        Area of the box around any two of them, filled in below the diagonal.
    """

    numbers: np.ndarray
    boxes: np.ndarray
    distances: np.ndarray


@implements(arrange, Clusters)
def arrange_pairs(search, tree, treelet, count):
    """Join the nearest pair until one node is left."""
    numbers, boxes, distances = search.numbers, search.boxes, search.distances
    for i in range(count):
        numbers[i] = i
        for side in range(6):
            boxes[i, side] = tree.boxes[treelet.leaves[i], side]
        for j in range(i):
            distances[i, j] = union_area(boxes[i], boxes[j])
    areas = 0.0
    for k in range(count - 2, -1, -1):
        n_clusters = k + 2
        a, b = 1, 0
        for i in range(2, n_clusters):
            for j in range(i):
                if distances[i, j] < distances[a, b]:
                    a, b = i, j
        if k > 0:
            areas += distances[a, b]
        treelet.children[k, 0], treelet.children[k, 1] = numbers[b], numbers[a]
        # The new one takes the place of b, the last one that of a.
        last = n_clusters - 1
        numbers[b], numbers[a] = count + k, numbers[last]
        for axis in range(3):
            boxes[b, axis] = min(boxes[a, axis], boxes[b, axis])
            boxes[b, 3 + axis] = max(boxes[a, 3 + axis], boxes[b, 3 + axis])
        for side in range(6):
            boxes[a, side] = boxes[last, side]
        for i in range(last):
            for changed in (a, b):
                if i != changed:
                    distance = union_area(boxes[i], boxes[changed])
                    distances[max(i, changed), min(i, changed)] = distance
    return areas


def agglomerate_treelets(
    tree: LinkedTree, settings: CostSettings, progress: Progress, log: bool = False
) -> Rearrangement:
    """Replace treelets by those that joining pairs makes, where these are better.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    search = Clusters(np.empty(LEAVES, np.int32), np.empty((LEAVES, 6)), np.empty((LEAVES, LEAVES)))
    return restructure(search, LEAVES, tree, settings, progress, log)


OPTIMISER = Optimiser(
    "Every nine subtrees joined pair by pair (Domingues and Pedrini 2015)",
    CostSettings,
    agglomerate_treelets,
)
