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

Where the time goes, in Suzanne with 251,904 triangles on one core: a triangle passes eighteen
nodes. In one of 64 or more it takes 5 ns to fit the boxes, 11 to fill the bins and 10 to 14 to be
divided, in which half is guessed wrongly; in one of four 40 to 60, most of it for sweeping. Filling
the bins axis by axis took 25 to 35, sweeping over empty ones as well twice as long. Dividing
without branches, or with the row that is moved kept in registers, is not faster.

I. Wald: On fast Construction of SAH-based Bounding Volume Hierarchies, RT 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .....geometry.box import NOTHING, area_of, around, box_at, put_box
from .....kernels import dispatched, implements, inlined, inner, unsigned
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


class BinsOfAxes(NamedTuple):
    """Scratch memory of one thread: of k bins per axis, those that are used.

    Attributes
    ----------
    boxes : (3 k, 6) float64
        Around what is in each bin. Of an axis, all bins follow each other.
    counts : (3 k,) int64
        Triangles in each.
    scales : (3,) float64
        Bins per unit of doubled centres along each axis; 0 where no plane is looked for.
    filled : (k + 1,) int64
        The bins of an axis that are not empty, and an end.
    right_costs : (k,) float64
        SA N of everything behind each of those.
    """

    boxes: np.ndarray
    counts: np.ndarray
    scales: np.ndarray
    filled: np.ndarray
    right_costs: np.ndarray


def make_bins_of_axes(count: int) -> BinsOfAxes:
    """Return so many bins per axis."""
    return BinsOfAxes(
        np.empty((3 * count, 6)), np.empty(3 * count, np.int64), np.empty(3),
        np.empty(count + 1, np.int64), np.empty(count),
    )  # fmt: skip


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
    bins : BinsOfAxes
    """

    limits: Limits
    bounds: np.ndarray
    curve: np.ndarray
    boxes: np.ndarray
    order: np.ndarray
    bins: BinsOfAxes


@inlined
def bin_of(centre, low, scale, bins):
    """Return the bin of a triangle's doubled centre; used alike for counting and for dividing."""
    return min(int((centre - low) * scale), bins - 1)


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
    return min(len(rule.bins.right_costs), 4 + rows)


@inner
def scale_along(centres, axis, bins):
    """Return how many bins there are per unit of doubled centres; 0 if nothing tells them apart.

    `centres`, (6,), is the box around them.
    """
    extent = centres[3 + axis] - centres[axis]
    if not extent > 0.0:
        return 0.0
    scale = bins * (1.0 - 1e-6) / extent
    return scale if scale < np.inf else 0.0


@inner
def list_filled(counts, begin, bins, filled):
    """List which bins of an axis, from row `begin` on, are not empty; return how many those are."""
    n_filled = 0
    for b in range(bins):
        filled[unsigned(n_filled)] = b
        n_filled += 1 if counts[unsigned(begin + b)] > 0 else 0
    filled[unsigned(n_filled)] = bins
    return n_filled


@inner
def choose_between_bins(rule, first, end, count, depth):
    """Return the cheapest of 3 (bins - 1) planes between the rows ``first ... end - 1``.

    They have `count` triangles; ``rule.bounds[1]`` is the box around their centres, doubled. What
    is returned is what :func:`choose` does; `place` is the bin that the plane is behind.

    Planes behind empty bins divide as the one before them does, and are not looked at.
    """
    limits, curve, within, centres = rule.limits, rule.curve, rule.bins, rule.bounds[1]
    bin_boxes, counts, scales = within.boxes, within.counts, within.scales
    filled, right_costs = within.filled, within.right_costs
    bins = bins_for(rule, end - first)
    # The axes that tell triangles apart; of axes in turn only the first.
    an_axis = -1
    for turn in range(3):
        axis = axis_at(limits, depth, turn)
        is_out = limits.in_turn and an_axis >= 0
        scales[axis] = 0.0 if is_out else scale_along(centres, axis, bins)
        if an_axis < 0 and scales[axis] > 0.0:
            an_axis = axis
    if an_axis < 0:
        return -1, 0, 0.0, np.inf
    if end == first + 2 and len(curve) == 0:
        # Whatever parts them costs the same. They are over a third of all nodes.
        cost = weight_of(rule, first) * area_of(rule.boxes[first])
        cost += weight_of(rule, first + 1) * area_of(rule.boxes[first + 1])
        return an_axis, 0, 0.5 * (centres[an_axis] + 1.0 / scales[an_axis]), cost
    # Into the bins, of all axes at once.
    for i in range(unsigned(3 * bins)):
        counts[i] = 0
        put_box(bin_boxes, i, NOTHING)
    low_x, low_y, low_z = centres[0], centres[1], centres[2]
    scale_x, scale_y, scale_z = scales[0], scales[1], scales[2]
    for row in range(unsigned(first), unsigned(end)):
        box, weight = box_at(rule.boxes, row), weight_of(rule, row)
        x = unsigned(bin_of(box[0] + box[3], low_x, scale_x, bins))
        y = unsigned(bins + bin_of(box[1] + box[4], low_y, scale_y, bins))
        z = unsigned(2 * bins + bin_of(box[2] + box[5], low_z, scale_z, bins))
        counts[x] += weight
        counts[y] += weight
        counts[z] += weight
        put_box(bin_boxes, x, around(box_at(bin_boxes, x), box))
        put_box(bin_boxes, y, around(box_at(bin_boxes, y), box))
        put_box(bin_boxes, z, around(box_at(bin_boxes, z), box))
    best_axis, best_bin, best_cost = -1, 0, np.inf
    for axis in range(3):
        if scales[axis] == 0.0:
            continue
        begin = axis * bins
        n_filled = list_filled(counts, begin, bins, filled)
        # From the right: SA N of everything behind each bin.
        side, n = NOTHING, 0
        for k in range(n_filled - 1, 0, -1):
            b = unsigned(begin + filled[unsigned(k)])
            side = around(side, box_at(bin_boxes, b))
            n += counts[b]
            right_costs[unsigned(k - 1)] = n * area_of(side)
        # From the left, with the other side at hand.
        side, n = NOTHING, 0
        for k in range(unsigned(n_filled - 1)):
            b = unsigned(begin + filled[k])
            side = around(side, box_at(bin_boxes, b))
            n += counts[b]
            cost = n * area_of(side) + right_costs[k]
            if cost < best_cost:
                best_axis, best_bin, best_cost = axis, filled[k], cost
            if len(curve) > 0:
                for alike in range(filled[k], filled[k + unsigned(1)]):
                    row = axis * (bins - 1) + alike
                    position = 0.5 * (centres[axis] + (alike + 1) / scales[axis])
                    note(curve, row, axis, position, n, count - n, cost)
    if best_axis < 0:
        return -1, 0, 0.0, np.inf
    position = 0.5 * (centres[best_axis] + (best_bin + 1) / scales[best_axis])
    return best_axis, best_bin, position, best_cost


@implements(enclose, Binned, inline=True)
def enclose_binned(rule, first, count):
    """Fit both boxes."""
    enclose_boxes(rule.boxes, first, count, rule.bounds)


@implements(choose, Binned, inline=True)
def choose_binned(rule, first, count, depth):
    """Take the cheapest plane at the borders of bins."""
    return choose_between_bins(rule, first, first + count, count, depth)


@implements(divide, Binned)
def divide_binned(rule, first, count, axis, place, position):
    """Swap those in bins up to `place` to the front."""
    boxes, order, low = rule.boxes, rule.order, rule.bounds[1, axis]
    bins = bins_for(rule, count)
    scale = scale_along(rule.bounds[1], axis, bins)
    i, j = first, first + count - 1
    while i <= j:
        if bin_of(boxes[i, axis] + boxes[i, 3 + axis], low, scale, bins) <= place:
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
            limits, np.empty((2, 6)), curve, primitives.boxes, order, make_bins_of_axes(bins),
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
