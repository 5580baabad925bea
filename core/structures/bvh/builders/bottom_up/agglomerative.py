"""Bottom-up construction: agglomerative clustering, exact.

Every triangle starts as a cluster of its own. Again and again the two clusters are merged that are
closest to each other, where the distance is the surface area of the box around both,

    d(A, B) = SA(A u B),

until one is left: the root. Of equally close pairs that with the lowest numbers is merged; a merged
cluster takes over the lower number of its two.

A cluster only gets farther from all others when it grows. So two clusters that are each other's
nearest neighbour stay so until they are merged, whatever is merged before, and it need not be the
closest pair of all that is merged next: any such pair leads to the same tree. The walk from a
cluster to its nearest neighbour, from there to the next one and so on finds one, since the
distances on the way get ever smaller. When the pair is merged, the rest of this chain stays good.

The nearest neighbour is looked for in a tree over the clusters, from where the cluster is upward.
A node knows how far the boxes below it must reach: each begins no later than `hull[:3]` and ends no
earlier than `hull[3:]`. So a box around one of them and another cluster contains this hull, and
nothing below the node is closer than that.

B. Walter, K. Bala, M. Kulkarni, K. Pingali: Fast Agglomerative Clustering for Rendering, RT 2008.
F. Murtagh: A Survey of Recent Advances in Hierarchical Clustering Algorithms, 1983 (the chain).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....geometry.box import union_area
from .....kernels import call, inner, kernel
from .....progress import Progress
from ...topology.build_log import grouping_of_merges
from ...topology.collapse import LeafRule, LeafSettings
from ...topology.tree import Builder, Grouping, LinkedTree, Primitives, leaves_only

VISITS = 250_000
"""Nodes of the search tree that one kernel call visits, in some 10 ms; then the cancel button is
looked at."""

NOBODY = np.iinfo(np.int32).max
"""In place of a cluster's number where there is none."""


SPREAD = np.array([sum((x >> bit & 1) << 6 * bit for bit in range(10)) for x in range(1024)])
"""The bits of a number of ten bits, six places from each other."""


class Clusters(NamedTuple):
    """The clusters, as leaves of the tree they are searched in: cluster i is its node n + i.

    Node 1 is the root, nodes 2i and 2i + 1 are the children of node i.

    Attributes
    ----------
    hull : (2n, 6) float64
        The greatest lower and the least upper corner of the boxes below; of a leaf, its box.
    lowest : (2n,) int32
        The lowest number of a cluster below; NOBODY where all have been merged into others.
    nodes : (n,) int32
        The node of the hierarchy that the cluster is.
    """

    hull: np.ndarray
    lowest: np.ndarray
    nodes: np.ndarray


@inner
def summarise(clusters, node):
    """Fill in a node of the search tree from its two children."""
    a, b = clusters.hull[2 * node], clusters.hull[2 * node + 1]
    for axis in range(3):
        clusters.hull[node, axis] = max(a[axis], b[axis])
        clusters.hull[node, 3 + axis] = min(a[3 + axis], b[3 + axis])
    clusters.lowest[node] = min(clusters.lowest[2 * node], clusters.lowest[2 * node + 1])


@kernel
def summarise_all(clusters):
    """Fill in the search tree above its leaves."""
    for node in range(len(clusters.nodes) - 1, 0, -1):
        summarise(clusters, node)


@inner
def nearest(clusters, leaf, stack, distances):
    """Return the leaf of the nearest neighbour of a leaf's cluster, and the nodes looked at.

    Of several at the same distance that of the lowest number. From the leaf upward, what is below
    the sibling is searched, the closer half first, and left out where nothing can be closer.
    """
    box = clusters.hull[leaf]
    best, best_number, best_leaf = np.inf, NOBODY, 0
    visits = 0
    up = leaf
    while up > 1:
        stack[0] = up ^ 1
        distances[0] = union_area(box, clusters.hull[up ^ 1])
        up >>= 1
        height = 1
        while height > 0:
            height -= 1
            node, distance = stack[height], distances[height]
            number = clusters.lowest[node]
            # Where nobody is left, the distance is infinite and the number NOBODY.
            if distance > best or (distance == best and number >= best_number):
                continue
            visits += 1
            if node >= len(clusters.nodes):
                best, best_number, best_leaf = distance, number, node
                continue
            left = 2 * node
            near = union_area(box, clusters.hull[left])
            far = union_area(box, clusters.hull[left + 1])
            swap = far < near or (far == near and clusters.lowest[left + 1] < clusters.lowest[left])
            stack[height], stack[height + 1] = left + 1 - swap, left + swap
            distances[height], distances[height + 1] = (near, far) if swap else (far, near)
            height += 2
    return best_leaf, visits


@inner
def update_above(clusters, leaf):
    """Fill in the search tree above a leaf."""
    node = leaf >> 1
    while node > 0:
        summarise(clusters, node)
        node >>= 1


@inner
def merge(clusters, tree, a, b, made):
    """Make the clusters of two leaves one, node `made` of the hierarchy; it stays at leaf `a`."""
    n = len(clusters.nodes)
    left, right = clusters.nodes[a - n], clusters.nodes[b - n]
    if clusters.lowest[b] < clusters.lowest[a]:
        left, right = right, left
    tree.left[made], tree.right[made] = left, right
    tree.parent[left] = tree.parent[right] = made
    for axis in range(3):
        low = min(clusters.hull[a, axis], clusters.hull[b, axis])
        high = max(clusters.hull[a, 3 + axis], clusters.hull[b, 3 + axis])
        tree.boxes[made, axis], tree.boxes[made, 3 + axis] = low, high
        clusters.hull[a, axis], clusters.hull[a, 3 + axis] = low, high
        clusters.hull[b, axis], clusters.hull[b, 3 + axis] = -np.inf, np.inf
    clusters.nodes[a - n] = made
    clusters.lowest[a] = min(clusters.lowest[a], clusters.lowest[b])
    clusters.lowest[b] = NOBODY
    update_above(clusters, a)
    update_above(clusters, b)


@inner
def first_cluster(clusters):
    """Return the leaf of the cluster with the lowest number."""
    node = 1
    while node < len(clusters.nodes):
        node = 2 * node + (clusters.lowest[2 * node] != clusters.lowest[node])
    return node


@kernel
def merge_some(clusters, tree, chain, state, enough, stack, distances):
    """Follow the chain of nearest neighbours and merge, until `enough` nodes are made.

    Parameters
    ----------
    chain : (n,) int32
        Leaves, each the nearest neighbour of the one before it.
    state : (2,) int64
        Length of the chain, and how many nodes the hierarchy has; it can end before `enough`.
    """
    height, made, visits = state[0], state[1], 0
    while made < enough and visits < VISITS:
        if height == 0:
            chain[0] = first_cluster(clusters)
            height = 1
        last = chain[height - 1]
        neighbour, looked_at = nearest(clusters, last, stack, distances)
        visits += looked_at
        if height > 1 and chain[height - 2] == neighbour:
            merge(clusters, tree, neighbour, last, made)
            made += 1
            height -= 2
        else:
            chain[height] = neighbour
            height += 1
    state[0], state[1] = height, made


def arrange(boxes: np.ndarray) -> np.ndarray:
    """Return an order of boxes in which those that follow each other are alike.

    In place and in size: a box is a point in six dimensions, and this is a Morton curve through
    them. One through the centres alone takes five times as long where large triangles overlap.
    """
    low = boxes.min(axis=0)
    size = (boxes.max(axis=0) - low).max()
    cells = ((boxes - low) / (size or 1.0) * 1023.0).astype(np.int64)
    codes = np.zeros(len(boxes), np.int64)
    for axis in range(6):
        codes |= SPREAD[cells[:, axis]] << axis
    return np.argsort(codes, kind="stable")


def clusters_of(tree: LinkedTree, nodes: np.ndarray, numbers: np.ndarray) -> Clusters:
    """Return nodes of a hierarchy as clusters to be searched."""
    n = len(nodes)
    order = arrange(tree.boxes[nodes])
    clusters = Clusters(np.empty((2 * n, 6)), np.empty(2 * n, np.int32), nodes[order])
    clusters.hull[n:], clusters.lowest[n:] = tree.boxes[clusters.nodes], numbers[order]
    call(summarise_all, clusters)
    return clusters


def cluster(boxes: np.ndarray, progress: Progress) -> LinkedTree:
    """Return the hierarchy of all clusters over boxes, (n, 6).

    Raises
    ------
    Cancelled
        From `progress`.
    """
    n = len(boxes)
    tree = leaves_only(boxes)
    nodes = numbers = np.arange(n, dtype=np.int32)
    state = np.array([0, n])
    stack, distances = np.empty(64, np.int64), np.empty(64)
    while len(nodes) > 1:
        # When half of the clusters are gone, the search tree is made anew; the chain with it.
        progress.report(state[1] - n, n, "Building bvh")
        clusters = clusters_of(tree, nodes, numbers)
        chain = np.empty(len(nodes), np.int32)
        enough = state[1] + (len(nodes) + 1) // 2
        state[0] = 0
        while state[1] < enough:
            call(merge_some, clusters, tree, chain, state, enough, stack, distances)
            progress.report(state[1] - n, n, "Building bvh")
        numbers = clusters.lowest[len(nodes) :]
        left = numbers != NOBODY
        nodes, numbers = clusters.nodes[left], numbers[left]
    return tree


def build_agglomerative(
    primitives: Primitives, settings: LeafSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    tree = cluster(primitives.boxes, progress)
    one_by_one = np.arange(1, len(primitives.boxes))
    return grouping_of_merges(tree, LeafRule.of(settings), one_by_one if log else None)


BUILDER = Builder(
    "Bottom-up, the two closest clusters merged (Walter 2008)",
    LeafSettings,
    build_agglomerative,
    bytes_per_triangle=460,
)
