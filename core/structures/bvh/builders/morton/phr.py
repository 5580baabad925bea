"""Progressive hierarchical refinement (PHR): SAH over a cut through a tree that is quickly built.

An *auxiliary* tree is there first, that of :mod:`.lbvh`. From the top down a new one is built,
whose nodes do not hold triangles but *clusters*: nodes of the auxiliary tree, a cut through a part
of it. A node of the new tree, in depth d,

1. *refines* its cut: every cluster whose surface area is larger than the threshold

       t_d = S / 2^(alpha d + delta),    S: surface area of the scene's box

   is opened, which means that its children take its place, until none is larger. A cluster that is
   left alone is opened, too;
2. divides its clusters by their centres, where SA(L) N_L + SA(R) N_R is least at the borders of
   bins, as in :mod:`..top_down.binned_sah`; N counts the triangles in the clusters. Each half goes
   on with its part of the cut.

So the upper nodes, which nearly every ray visits, are divided with care but in few clusters, and
the work of a node is not that of all its triangles. A small `alpha` lets cuts become short from
level to level: where a node has shrunk to the threshold's size what is below is the auxiliary tree
as it is. A large `delta` begins with a fine cut; with one that opens everything this is
:mod:`..top_down.binned_sah`, node by node.

SAH cost (1.2 and 1, leaves of up to 4 triangles), and processor time to build relative to
`binned_sah`:

    builder, alpha, delta    Suzanne 250k   Sponza        kitchen       dragon 203k
    binned_sah               39.0           77.6          62.7          51.0
    ploc                     43.1, 0.93     72.9, 1.02    54.1, 0.95    57.0, 0.89
    hlbvh                    42.3, 0.32     79.5, 0.63    62.6, 0.38    57.4, 0.37
    lbvh                     46.4, 0.27     103.9, 0.30   88.1, 0.21    62.5, 0.25
    phr, 0.4, 6              42.3, 0.71     78.5, 0.88    63.0, 0.49    56.8, 0.60
    phr, 0.5, 6              41.0, 0.72     79.0, 1.02    62.6, 0.56    54.4, 0.68
    phr, 0.6, 6              40.0, 0.64     77.7, 0.96    61.9, 0.64    53.0, 0.83
    phr, 0.5, 9              39.6, 1.05     77.6, 0.98    65.1, 0.64    52.1, 0.97
    phr, 0.55, 9             39.7, 0.95     79.4, 1.16    65.0, 0.79    51.9, 1.10

The times were taken beside other work and are good to a tenth. 0.5 and 6 take 0.73 of what
`binned_sah` takes, for a cost that is 3% higher, in the geometric mean, and are the defaults; 9
takes as long as binning everything, which then is the better choice. Building and tracing a million
random lines together take 0.94 of what they take with `binned_sah`, 0.93 with `hlbvh`, 1.04 with
`ploc` (``python tests/bench/hierarchies.py --sections builders``). At its peak a build holds 310
bytes a triangle beside the boxes it is given: both trees, and one while it is packed.

J. Hendrich, D. Meister, J. Bittner: Parallel BVH Construction using Progressive Hierarchical
Refinement, Computer Graphics Forum 36(2), 2017. Their spatial splits are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .....contract.workspace import MAXIMUM_DEPTH
from .....geometry.box import area_of
from .....geometry.box_shape import surface_area
from .....kernels import call, implements, inner, kernel
from .....parallel import Team
from .....progress import Progress
from .....settings import setting
from ...topology.tree import Builder, Grouping, Primitives, Tree, find_ranges
from ..top_down.binned_sah import (
    BinnedSettings,
    BinsOfAxes,
    bin_of,
    bins_for,
    choose_between_bins,
    make_bins_of_axes,
    scale_along,
    weight_of,
)
from ..top_down.recursion import (
    Limits,
    choose,
    divide,
    enclose,
    enclose_boxes,
    limits_of,
    split_recursively,
    swap,
)
from .codes import MortonSettings
from .lbvh import build_lbvh

OPEN_ALL = -1.0
"""A threshold above which every surface is."""


@dataclass(frozen=True)
class Settings(BinnedSettings, MortonSettings):
    """Settings of PHR."""

    cut_alpha: float = setting(
        0.5,
        "Cut Alpha",
        "By how many powers of two the threshold of cuts falls from level to level",
        minimum=0.0,
        maximum=4.0,
    )
    cut_delta: float = setting(
        6.0,
        "Cut Delta",
        "The threshold of the first cut is the scene's surface over two to the power of this",
        minimum=0.0,
        maximum=1024.0,
    )


class Auxiliary(NamedTuple):
    """The auxiliary tree; every leaf has one reference.

    Attributes
    ----------
    boxes, first, size
        As in :class:`...topology.tree.Tree`.
    begin, end : (n_nodes,) int32
        The references below every node.
    order : (n,) int32
        The triangle of each reference.
    """

    boxes: np.ndarray
    first: np.ndarray
    size: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    order: np.ndarray


class Cuts(NamedTuple):
    """The rule, with the scratch memory of one thread.

    A node that has the references ``first ... first + count - 1`` in the end keeps its cut in the
    rows from `first` on, as many as it takes to have so many references: never more than `count`.

    Attributes
    ----------
    limits : Limits
    bounds : (2, 6) float64
    curve : (0, 5) float64
    auxiliary : Auxiliary
    thresholds : (MAXIMUM_DEPTH,) float64
        Surface area by depth above which clusters are opened.
    clusters : (n,) int32
        Numbers of auxiliary nodes.
    boxes : (n, 6) float64
        Of the clusters.
    bins : BinsOfAxes
    """

    limits: Limits
    bounds: np.ndarray
    curve: np.ndarray
    auxiliary: Auxiliary
    thresholds: np.ndarray
    clusters: np.ndarray
    boxes: np.ndarray
    bins: BinsOfAxes


@implements(weight_of, Cuts, inline=True)
def weight_of_cluster(rule, row):
    """Return how many references the cluster of a row has."""
    cluster = rule.clusters[row]
    return rule.auxiliary.end[cluster] - rule.auxiliary.begin[cluster]


@inner
def put(rule, row, cluster):
    """Write an auxiliary node into a row."""
    rule.clusters[row] = cluster
    for side in range(6):
        rule.boxes[row, side] = rule.auxiliary.boxes[cluster, side]


@inner
def end_of_cut(rule, first, count):
    """Return the row behind the last cluster of a node."""
    row, last = first, first + count
    while first < last:
        first += weight_of(rule, row)
        row += 1
    return row


@inner
def open_cluster(rule, row, end):
    """Put the children of the cluster in a row into that one and the row `end`."""
    child = rule.auxiliary.first[rule.clusters[row]]
    put(rule, row, child)
    put(rule, end, child + 1)


@inner
def refine(rule, first, end, threshold):
    """Open the clusters in the rows ``first ... end - 1``; return the row behind the last then."""
    row = first
    while row < end:
        is_leaf = rule.auxiliary.size[rule.clusters[row]] > 0
        if is_leaf or area_of(rule.boxes[row]) <= threshold:
            row += 1
        else:
            open_cluster(rule, row, end)
            end += 1
    if end == first + 1 and rule.auxiliary.size[rule.clusters[first]] == 0:
        open_cluster(rule, first, end)
        end += 1
    return end


@implements(enclose, Cuts)
def enclose_cut(rule, first, count):
    """Fit both boxes."""
    enclose_boxes(rule.boxes, first, end_of_cut(rule, first, count) - first, rule.bounds)


@implements(choose, Cuts)
def choose_in_cut(rule, first, count, depth):
    """Refine the cut, and take the cheapest plane between clusters at the borders of bins.

    Where nothing tells the clusters apart all are opened, for a node that no plane divides is split
    by index.
    """
    end = refine(rule, first, end_of_cut(rule, first, count), rule.thresholds[depth])
    enclose_boxes(rule.boxes, first, end - first, rule.bounds)  # the centres are others now
    axis, place, position, cost = choose_between_bins(rule, first, end, count, depth)
    if axis < 0:
        refine(rule, first, end, OPEN_ALL)
    return axis, place, position, cost


@implements(divide, Cuts)
def divide_cut(rule, first, count, axis, place, position):
    """Swap the clusters in bins up to `place` to the front, and move the others to their rows."""
    end = end_of_cut(rule, first, count)
    bins, low = bins_for(rule, end - first), rule.bounds[1, axis]
    scale = scale_along(rule.bounds[1], axis, bins)
    middle, last, n_left = first, end - 1, 0
    while middle <= last:
        centre = rule.boxes[middle, axis] + rule.boxes[middle, 3 + axis]
        if bin_of(centre, low, scale, bins) <= place:
            n_left += weight_of(rule, middle)
            middle += 1
        else:
            swap(rule.boxes, rule.clusters, middle, last)
            last -= 1
    # The rows of the right child begin where its references will; from the far end, since what is
    # written may not have been read.
    for row in range(end - 1, middle - 1, -1):
        copy(rule, row, row + first + n_left - middle)
    return n_left


@inner
def copy(rule, source, target):
    """Copy a row."""
    rule.clusters[target] = rule.clusters[source]
    for side in range(6):
        rule.boxes[target, side] = rule.boxes[source, side]


@kernel
def write_order(tree, auxiliary, clusters, order, first, last):
    """Write the triangles of the leaves among the nodes ``first <= node < last``."""
    for node in range(first, last):
        row = done = tree.first[node]
        while done < tree.first[node] + tree.size[node]:
            cluster = clusters[row]
            for reference in range(auxiliary.begin[cluster], auxiliary.end[cluster]):
                order[done] = auxiliary.order[reference]
                done += 1
            row += 1


def auxiliary_tree(primitives: Primitives, settings: Settings, progress: Progress) -> Auxiliary:
    """Build the auxiliary tree.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    tree, order = built_quickly(primitives, settings, progress)
    begin, end = np.empty(len(tree.size), np.int32), np.empty(len(tree.size), np.int32)
    call(find_ranges, tree.first, tree.size, np.full(len(tree.size), 2), begin, end)
    return Auxiliary(*tree, begin, end, order)


def built_quickly(
    primitives: Primitives, settings: Settings, progress: Progress
) -> tuple[Tree, np.ndarray]:
    """Return the tree of LBVH with one reference per leaf, and the triangle of each reference."""
    grouping = build_lbvh(primitives, replace(settings, max_leaf_size=1), progress)
    return grouping.tree, grouping.order


def thresholds_of(surface: float, settings: Settings) -> np.ndarray:
    """Return the surface area, by depth, above which clusters are opened, (MAXIMUM_DEPTH,).

    Below half of MAXIMUM_DEPTH nodes are split by index (:mod:`..top_down.recursion`): before they
    are, all clusters are opened.
    """
    depth = np.arange(MAXIMUM_DEPTH)
    thresholds = surface * 2.0 ** -(settings.cut_alpha * depth + settings.cut_delta)
    thresholds[MAXIMUM_DEPTH // 2 - 1 :] = OPEN_ALL
    return thresholds


def rule_over(auxiliary: Auxiliary, boxes: np.ndarray, settings: Settings) -> Cuts:
    """Return a rule whose first cut is the root.

    Parameters
    ----------
    boxes : (n, 6) float64
        Room for those of clusters.
    """
    surface = float(surface_area(auxiliary.boxes[:1])[0])
    boxes[0] = auxiliary.boxes[0]
    return Cuts(
        limits_of(settings), np.empty((2, 6)), np.empty((0, 5)), auxiliary,
        thresholds_of(surface, settings), np.zeros(len(boxes), np.int32), boxes,
        make_bins_of_axes(settings.bins),
    )  # fmt: skip


def build_phr(
    primitives: Primitives, settings: Settings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the auxiliary tree, then the tree; the boxes of the primitives are overwritten.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    auxiliary = auxiliary_tree(primitives, settings, progress)
    shared = rule_over(auxiliary, primitives.boxes, settings)

    def make_rule() -> Cuts:
        return shared._replace(bounds=np.empty((2, 6)), bins=make_bins_of_axes(settings.bins))

    count = len(auxiliary.order)
    tree, told = split_recursively(make_rule, count, progress, log)
    order = np.empty(count, np.int32)
    with Team(progress, "Building bvh") as team:
        team.run(
            lambda *block: call(write_order, tree, auxiliary, shared.clusters, order, *block),
            len(tree.size),
        )
    return Grouping(tree, order, log=told)


BUILDER = Builder(
    "SAH over a cut through the tree of LBVH, refined level by level (Hendrich 2017)",
    Settings,
    build_phr,
    bytes_per_triangle=420,
)
