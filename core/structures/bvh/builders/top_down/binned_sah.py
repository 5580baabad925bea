"""Top-down construction by the surface area heuristic (SAH), evaluated at bin borders.

At each node a plane divides the triangles by their centroids: the one of least cost
(:mod:`.recursion`). Binning evaluates the cost at a fixed number of planes per axis: count
triangles and boxes per bin in one pass, then sweep over the bins from both sides.

Its trees of interiors cost more than others do. That is not the bins' fault: sweeping over all
centroids, or twice as many bins, saves little. A plane puts a large triangle on one side as a
whole, both sides overlap by that, and the choice is greedy, as if both sides became leaves. Spatial
splits mend the one, reinsertion afterwards mends the other. SAH cost (1.2 and 1, leaves of up to
4 triangles):

    scene      16 bins   32 bins   sweep_sah   ploc    sbvh    16 bins and reinsert
    Sponza     77.7      77.9      75.9        74.4    64.8    65.4
    kitchen    62.7      61.7      60.9        54.1    50.7    48.0
    dragon     51.0      50.6      50.4        57.0    50.4    49.6

I. Wald: On fast Construction of SAH-based Bounding Volume Hierarchies, RT 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .....geometry.box import area_of, clear, include
from .....kernels import dispatched, implements, inner
from .....progress import Progress
from .....settings import setting
from ...topology.tree import Builder, Grouping, Primitives
from .recursion import (
    Limits,
    TopDownSettings,
    axis_at,
    choose,
    divide,
    enclose,
    enclose_boxes,
    limits_of,
    note,
    split_recursively,
    swap,
)


def bins_setting() -> Any:
    """Declare the number of candidate planes."""
    return setting(16, "Bins", "Candidate intervals per axis", unit="bins", minimum=2, maximum=64)


@dataclass(frozen=True)
class BinnedSettings(TopDownSettings):
    """Settings of builders that compare planes at the borders of bins."""

    bins: int = bins_setting()


class Binned(NamedTuple):
    """The rule, with the scratch memory of one thread.

    Attributes
    ----------
    limits : Limits
    bounds : (2, 6) float64
    curve : (rows, 5) float64
        Candidate b of an axis, behind bin b, has row ``axis * (bins - 1) + b``.
    boxes : (n, 6) float64
    order : (n,) int32
        Reordered together.
    bin_boxes : (bins, 6) float64
    bin_counts : (bins,) int64
    right_costs : (bins,) float64
    side_box : (6,) float64
    """

    limits: Limits
    bounds: np.ndarray
    curve: np.ndarray
    boxes: np.ndarray
    order: np.ndarray
    bin_boxes: np.ndarray
    bin_counts: np.ndarray
    right_costs: np.ndarray
    side_box: np.ndarray


@inner
def bin_of(box, axis, low, scale, bins):
    """Return the bin of a triangle's centroid; used alike for counting and for dividing."""
    return min(int((box[axis] + box[3 + axis] - low) * scale), bins - 1)


# A row is a triangle here. That of :mod:`..morton.phr` is a cluster of them.


@dispatched
def weight_of(rule, row):
    """Return how many triangles there are in a row of ``rule.boxes``."""
    raise TypeError(f"no weight_of for {type(rule).__name__}")


@implements(weight_of, Binned, inline=True)
def weight_of_triangle(rule, row):
    """Return 1."""
    return 1


@inner
def bins_for(rule, rows):
    """Return how many bins are used: more than rows would mostly be empty."""
    return min(len(rule.bin_counts), 4 + rows)


@inner
def scale_along(rule, axis, bins):
    """Return how many bins there are per unit of doubled centres; 0 if nothing tells them apart."""
    extent = rule.bounds[1, 3 + axis] - rule.bounds[1, axis]
    if not extent > 0.0:
        return 0.0
    scale = bins * (1.0 - 1e-6) / extent
    return scale if scale < np.inf else 0.0


@inner
def choose_between_bins(rule, first, end, count, depth):
    """Return the cheapest of 3 (bins - 1) planes between the rows ``first ... end - 1``.

    They have `count` triangles; ``rule.bounds[1]`` is the box around their centres, doubled. What
    is returned is what :func:`choose` does; `place` is the bin that the plane is behind.
    """
    boxes, bounds = rule.boxes, rule.bounds
    bin_boxes, bin_counts, right_costs = rule.bin_boxes, rule.bin_counts, rule.right_costs
    side = rule.side_box
    bins = bins_for(rule, end - first)
    best_axis, best_bin, best_position, best_cost = -1, 0, 0.0, np.inf
    for turn in range(3):
        axis = axis_at(rule.limits, depth, turn)
        low, scale = bounds[1, axis], scale_along(rule, axis, bins)
        if scale == 0.0:
            continue
        if end == first + 2 and len(rule.curve) == 0:
            # Whatever parts them costs the same. They are over a third of all nodes.
            cost = weight_of(rule, first) * area_of(boxes[first])
            cost += weight_of(rule, first + 1) * area_of(boxes[first + 1])
            return axis, 0, 0.5 * (low + 1.0 / scale), cost
        for b in range(bins):
            bin_counts[b] = 0
            clear(bin_boxes[b])
        for row in range(first, end):
            box = boxes[row]
            b = bin_of(box, axis, low, scale, bins)
            bin_counts[b] += weight_of(rule, row)
            include(bin_boxes[b], box)
        # From the right: right_costs[b] is SA N of everything behind bin b.
        clear(side)
        n = 0
        for b in range(bins - 1, 0, -1):
            include(side, bin_boxes[b])
            n += bin_counts[b]
            right_costs[b - 1] = n * area_of(side) if n > 0 else np.inf
        # From the left, with the other side at hand.
        clear(side)
        n = 0
        for b in range(bins - 1):
            include(side, bin_boxes[b])
            n += bin_counts[b]
            if n == 0 or n == count:
                continue
            cost = n * area_of(side) + right_costs[b]
            position = 0.5 * (low + (b + 1) / scale)
            note(rule.curve, axis * (bins - 1) + b, axis, position, n, count - n, cost)
            if cost < best_cost:
                best_axis, best_bin, best_position, best_cost = axis, b, position, cost
        if rule.limits.in_turn and best_axis >= 0:
            break
    return best_axis, best_bin, best_position, best_cost


@implements(enclose, Binned)
def enclose_binned(rule, first, count):
    """Fit both boxes."""
    enclose_boxes(rule.boxes, first, count, rule.bounds)


@implements(choose, Binned)
def choose_binned(rule, first, count, depth):
    """Take the cheapest plane at the borders of bins."""
    return choose_between_bins(rule, first, first + count, count, depth)


@implements(divide, Binned)
def divide_binned(rule, first, count, axis, place, position):
    """Swap those in bins up to `place` to the front."""
    boxes, order, low = rule.boxes, rule.order, rule.bounds[1, axis]
    bins = bins_for(rule, count)
    scale = scale_along(rule, axis, bins)
    i, j = first, first + count - 1
    while i <= j:
        if bin_of(boxes[i], axis, low, scale, bins) <= place:
            i += 1
        else:
            swap(boxes, order, i, j)
            j -= 1
    return i - first


def binned_rules(
    primitives: Primitives, settings: BinnedSettings, curve_rows: int = 0
) -> tuple[Callable[[], Binned], np.ndarray]:
    """Return what makes a rule for one thread, and the order of the triangles while they are split.

    The boxes of the primitives are reordered.
    """
    limits, bins = limits_of(settings), settings.bins
    order = np.arange(len(primitives.boxes), dtype=np.int32)
    curve = np.full((curve_rows, 5), np.nan)

    def make_rule() -> Binned:
        return Binned(
            limits, np.empty((2, 6)), curve, primitives.boxes, order,
            np.empty((bins, 6)), np.empty(bins, np.int64), np.empty(bins), np.empty(6),
        )  # fmt: skip

    return make_rule, order


def build_binned_sah(
    primitives: Primitives, settings: BinnedSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree; the boxes of the primitives are reordered.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    make_rule, order = binned_rules(primitives, settings)
    tree, told = split_recursively(make_rule, len(order), progress, log)
    return Grouping(tree, order, log=told)


BUILDER = Builder(
    "From the top down, SAH evaluated at bin borders (Wald 2007)",
    BinnedSettings,
    build_binned_sah,
)
