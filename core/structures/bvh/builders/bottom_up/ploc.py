"""Parallel locally-ordered clustering (PLOC): every cluster merges with its nearest, if both agree.

Building from the bottom up, one would like to merge the two clusters whose common box has the least
surface area, then the next two, and so on; finding them is what costs. Here the clusters are sorted
along the Morton curve, and each looks for its nearest only among the `radius` next ones on both
sides. Where two are each other's nearest they merge at once, all over the scene. One iteration is

1. the search for the nearest,
2. the merging of mutually nearest clusters,
3. the compaction of what is left, by a prefix sum over how many are left in each block,

and the last one leaves a single cluster. Leaves are chosen afterwards
(:mod:`...topology.collapse`).

Pairs of equal area are told apart by the exclusive or of their places i and j: for every i all
i ^ j differ, so nobody hesitates between two, and the pair that is smallest of all is mutual. Of
identical triangles the half merge in one iteration.

D. Meister, J. Bittner: Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy
Construction, IEEE TVCG 24(3), 2018.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .....kernels import call, kernel
from .....parallel import BLOCK, Team
from .....progress import Progress
from .....settings import setting
from ...topology.build_log import grouping_of_merges
from ...topology.collapse import LeafRule
from ...topology.tree import Builder, Grouping, LinkedTree, Primitives, leaves_only
from ..morton.codes import MortonSettings, sort_by_code

PAIRS = 1 << 18
"""Pairs of clusters that a thread measures at once, in about a millisecond."""

FEW, SLOW = 1024, 32
"""With more than FEW clusters, at least one of SLOW is to merge in every iteration; otherwise all
neighbours do. Where triangles nest like dolls only the innermost two find each other."""


@dataclass(frozen=True)
class Settings(MortonSettings):
    """Settings of PLOC."""

    radius: int = setting(
        14,
        "Radius",
        "How far PLOC looks for a neighbour along the Morton curve",
        unit="clusters",
        minimum=1,
        maximum=512,
    )


@kernel
def find_nearest(boxes, count, radius, areas, partners, nearest, first, last):
    """Write the nearest of the clusters ``first <= i < last``.

    Every pair is measured once, and both partners hear of it.

    Parameters
    ----------
    boxes : (count, 6) float64
        Of the clusters along the curve.
    areas : (last - first + 2 radius,) float64
        All inf: least area of a common box, half of it, from cluster ``first - radius`` on.
    partners : (last - first + 2 radius,) int32
        All 0: with whom.
    """
    base = first - radius
    for i in range(max(base, 0), last):
        x0, y0, z0 = boxes[i, 0], boxes[i, 1], boxes[i, 2]
        x1, y1, z1 = boxes[i, 3], boxes[i, 4], boxes[i, 5]
        least, partner = areas[i - base], partners[i - base]
        for j in range(max(i + 1, first), min(i + radius + 1, count)):
            a, b = boxes[j, 0], boxes[j, 3]
            x = (b if b > x1 else x1) - (a if a < x0 else x0)
            a, b = boxes[j, 1], boxes[j, 4]
            y = (b if b > y1 else y1) - (a if a < y0 else y0)
            a, b = boxes[j, 2], boxes[j, 5]
            z = (b if b > z1 else z1) - (a if a < z0 else z0)
            area = x * y + y * z + z * x
            if area < least or (area == least and i ^ j < i ^ partner):
                least, partner = area, j
            k = j - base
            if area < areas[k] or (area == areas[k] and i ^ j < j ^ partners[k]):
                areas[k], partners[k] = area, i
        if i >= first:
            nearest[i] = partner


@kernel
def count_left(nearest, first, last):
    """Return how many of the clusters ``first <= i < last`` are left, and how many are merged."""
    left, merged = 0, 0
    for i in range(first, last):
        partner = nearest[i]
        is_mutual = nearest[partner] == i
        if is_mutual and i < partner:
            merged += 1
        if not is_mutual or i < partner:
            left += 1
    return left, merged


@kernel
def merge(tree, nearest, now, out, place, node, first, last):
    """Write what is left of the clusters ``first <= i < last`` to `place` and behind.

    Mutually nearest ones become the inner nodes `node` and following; the first of both keeps its
    place along the curve.
    """
    for i in range(first, last):
        partner = nearest[i]
        is_mutual = nearest[partner] == i
        if is_mutual and i > partner:
            continue
        out.nodes[place] = now.nodes[i]
        for side in range(6):
            out.boxes[place, side] = now.boxes[i, side]
        if is_mutual:
            left, right = now.nodes[i], now.nodes[partner]
            out.nodes[place] = node
            tree.left[node], tree.right[node] = left, right
            tree.parent[left] = tree.parent[right] = node
            for side in range(3):
                a, b = now.boxes[i, side], now.boxes[partner, side]
                out.boxes[place, side] = b if b < a else a
                a, b = now.boxes[i, 3 + side], now.boxes[partner, 3 + side]
                out.boxes[place, 3 + side] = b if b > a else a
            for side in range(6):
                tree.boxes[node, side] = out.boxes[place, side]
            node += 1
        place += 1


class Clusters(NamedTuple):
    """Clusters along the curve.

    Attributes
    ----------
    nodes : (n,) int32
        The node that each has become in the tree.
    boxes : (n, 6) float64
    """

    nodes: np.ndarray
    boxes: np.ndarray


def iterations(tree: LinkedTree, radius: int, team: Team) -> Iterator[np.ndarray]:
    """Build a tree over its leaves, which are there already; yield its clusters in between.

    Parameters
    ----------
    tree : LinkedTree
        Its leaves lie along the curve; inner nodes are numbered as they are made.

    Yields
    ------
    (count,) int32
        The nodes that are clusters after each iteration, along the curve. It changes in the
        iteration after the next.

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    count = next_node = (len(tree.left) + 1) // 2
    now = Clusters(np.arange(count, dtype=np.int32), tree.boxes[:count].copy())
    out = Clusters(np.empty(count, np.int32), np.empty((count, 6)))
    nearest = np.empty(count, np.int32)
    while count > 1:
        search(now.boxes, count, radius, nearest, team)
        counts = count_blocks(nearest, count, team)
        if count > FEW and counts[:, 1].sum() * SLOW < count:
            # 0 with 1, 2 with 3, ...; if one is left over, it finds nobody who agrees.
            nearest[:count] = np.arange(count) ^ 1
            nearest[count - 1] = count - 2
            counts = count_blocks(nearest, count, team)
        merge_blocks(tree, nearest, counts, next_node, now, out, count, team)
        left, merged = counts.sum(axis=0).tolist()
        count, next_node = left, next_node + merged
        now, out = out, now
        yield now.nodes[:count]


def search(boxes: np.ndarray, count: int, radius: int, nearest: np.ndarray, team: Team) -> None:
    """Write the nearest of every cluster."""

    def search_block(first: int, last: int) -> None:
        size = last - first + 2 * radius
        areas, partners = np.full(size, np.inf), np.zeros(size, np.int32)
        call(find_nearest, boxes, count, radius, areas, partners, nearest, first, last)

    # The pairs between two blocks are measured in both: blocks are much larger than the radius.
    team.run(search_block, count, max(PAIRS // radius, 4 * radius))


def count_blocks(nearest: np.ndarray, count: int, team: Team) -> np.ndarray:
    """Return how many clusters of each block are left, and how many are merged, (blocks, 2)."""
    return np.array(team.run(lambda *block: call(count_left, nearest, *block), count))


def merge_blocks(
    tree: LinkedTree,
    nearest: np.ndarray,
    counts: np.ndarray,
    next_node: int,
    now: Clusters,
    out: Clusters,
    count: int,
    team: Team,
) -> None:
    """Merge in all blocks; a prefix sum over `counts` says where each one writes."""
    before = (np.cumsum(counts, axis=0) - counts).tolist()

    def merge_block(first: int, last: int) -> None:
        left, merged = before[first // BLOCK]
        call(merge, tree, nearest, now, out, left, next_node + merged, first, last)

    team.run(merge_block, count)


def build_ploc(
    primitives: Primitives, settings: Settings, progress: Progress, log: bool = False
) -> Grouping:
    """Sort, merge, choose leaves.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    with Team(progress, "Building bvh") as team:
        _, order = sort_by_code(primitives.boxes, settings, team)
        tree = leaves_only(primitives.boxes[order])
        counts = [len(order)]
        for clusters in iterations(tree, settings.radius, team):
            counts.append(len(clusters))
    merged = -np.diff(counts)
    iteration = np.repeat(np.arange(1, len(counts)), merged) if log else None
    made = grouping_of_merges(tree, LeafRule.of(settings), iteration)
    return replace(made, order=order[made.order], figures={"clusters": counts})


BUILDER = Builder(
    "Bottom-up, neighbours along the Morton curve merge (Meister 2018)",
    Settings,
    build_ploc,
    bytes_per_triangle=470,
)
