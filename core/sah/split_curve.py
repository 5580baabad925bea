"""The curve of cost of a split: what every candidate of a node would have cost.

The builder's own rule is asked once more, over the triangles of one node of the finished tree, with
room to write its candidates down (:func:`..structures.bvh.builders.top_down.recursion.note`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..geometry.box_shape import surface_area
from ..kernels import call, kernel
from ..progress import SILENT, Progress
from ..structures.bvh.builders.top_down import binned_sah, parallel_split, sweep_sah
from ..structures.bvh.builders.top_down.recursion import choose, divide, enclose
from ..structures.bvh.topology.tree import Primitives, ranges_of

if TYPE_CHECKING:
    from ..structures.bvh.hierarchy import BVH

RULES: dict[str, Callable[..., tuple[Callable[[], Any], np.ndarray]]] = {
    "sweep_sah": sweep_sah.sweep_rules,
    "binned_sah": binned_sah.binned_rules,
    "parallel_sah": parallel_split.data_parallel_rules,
}
"""What makes the rules of the builders that choose among candidates by cost."""


class SplitCurve(NamedTuple):
    """The candidates of one node.

    Attributes
    ----------
    axis : (k,) int64
        Ascending. An axis that tells no triangles apart, or is not in turn, has no candidates.
    position : (k,) float64
        Ascending along each axis.
    N_L, N_R : (k,) int64
        Triangles on both sides.
    cost : (k,) float64
        Cost(V -> {L, R}).
    best : int
        The cheapest, -1 if there are none.
    leaf_cost : float
        C_isect N: no split.
    box : (6,) float64
        Around the triangles.
    """

    axis: np.ndarray
    position: np.ndarray
    N_L: np.ndarray
    N_R: np.ndarray
    cost: np.ndarray
    best: int
    leaf_cost: float
    box: np.ndarray


@kernel
def look_at_candidates(rule, count, depth):
    """Let a rule choose how to split all its triangles, and so fill its curve."""
    enclose(rule, 0, count)
    if count > 1:
        choose(rule, 0, count, depth)


@kernel
def look_at_division(rule, count, axis, place, position):
    """Let a rule divide all its triangles; return how many go left."""
    return divide(rule, 0, count, axis, place, position)


def has_curves(bvh: BVH) -> bool:
    """Say whether the nodes are those that the builder split, and by cost."""
    settings = bvh.settings
    as_split = settings.optimise == "none" and settings.arity == "2" and not bvh.is_refitted
    return settings.builder in RULES and as_split


def split_curve(bvh: BVH, node: int, builder: str = "", progress: Progress = SILENT) -> SplitCurve:
    """Return the candidates that the builder had for a node, an inner one or a leaf.

    Parameters
    ----------
    builder : str, optional
        One of RULES: those that another builder would have had, for the same triangles.

    Raises
    ------
    ValueError
        Without :func:`has_curves`.
    Cancelled
        From `progress`.
    """
    text = f"Looking at the candidates of node {node}"
    progress.report(0, 4, text)
    if not has_curves(bvh):
        raise ValueError("the nodes of this tree were not split by comparing costs")
    settings = bvh.settings
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    # By id, as the builder had them: of equal centroids the lower id comes first.
    ids = np.sort(bvh.geometry.ids[begin[node] : end[node]])
    # Boxes as the builder had them: those of the copies that walks test need not be the same.
    primitives = Primitives(bvh.scene.items(ids), bvh.scene.boxes()[ids])
    n_rows = 3 * max(settings.bins, len(ids))
    make_rule, _ = RULES[builder or settings.builder](primitives, settings, n_rows)
    rule = make_rule()
    progress.report(1, 4, text)
    call(look_at_candidates, rule, len(ids), int(bvh.depths()[node]))
    progress.report(2, 4, text)
    rows = rule.curve[np.isfinite(rule.curve[:, 4])]
    progress.report(3, 4, text)
    axis, n_left, n_right = (rows[:, column].astype(np.int64) for column in (0, 2, 3))
    box = rule.bounds[0].copy()
    area = float(surface_area(box))
    # No line hits a box without a surface, whatever its parts are.
    shares = rows[:, 4] / area if area > 0.0 else np.full(len(rows), float(len(ids)))
    cost = settings.C_trav + settings.C_isect * shares
    best = int(np.argmin(rows[:, 4])) if len(rows) else -1
    leaf_cost = settings.C_isect * len(ids)
    progress.report(4, 4, text)
    return SplitCurve(axis, rows[:, 1], n_left, n_right, cost, best, leaf_cost, box)
