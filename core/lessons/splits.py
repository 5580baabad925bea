"""Splits of a tree that was built from the top down, as its log has them: what lessons share."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..contract.build_log import SPLIT
from ..progress import Progress
from ..sah.split_curve import RULES, has_curves
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import ranges_of
from .hierarchy import has_log, is_tree

MOST_SPLITS = 31
"""Splits that are shown: those nearest to the root."""


class Split(NamedTuple):
    """A node that was divided by a plane.

    Attributes
    ----------
    node : int
        Its number in the tree.
    depth : int
    axis : int
    position : float
    cost : float
        Cost(V -> {L, R}).
    ids : tuple of int arrays
        The items left and right, ascending.
    box : (6,) float64
        V.
    sides : (2, 6) float64
        V_L and V_R.
    """

    node: int
    depth: int
    axis: int
    position: float
    cost: float
    ids: tuple[np.ndarray, np.ndarray]
    box: np.ndarray
    sides: np.ndarray


def was_split_by_cost(structure: Any) -> str:
    """Accept trees whose nodes were divided by comparing costs, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if not has_curves(structure):
        known = ", ".join(RULES)
        return (
            f"its nodes are not as a builder has divided them by cost; take one of the builders "
            f"{known}, arity 2, and no optimiser"
        )
    return has_log(structure)


def splits_by_cost(bvh: BVH, progress: Progress) -> list[Split]:
    """Return the splits by a plane that are nearest to the root, in the order of their levels.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    log = bvh.build_log
    assert log is not None
    progress.report(0, MOST_SPLITS, "Reading the splits")
    events = np.flatnonzero((log.kind == SPLIT) & (log.axis >= 0) & np.isfinite(log.cost))
    depths = bvh.depths()
    by_depth = np.argsort(depths[log.cells[log.node[events]]], kind="stable")
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    boxes = bvh.scene.boxes()
    found: list[Split] = []
    for event in events[by_depth[:MOST_SPLITS]].tolist():
        progress.report(len(found), MOST_SPLITS, "Reading the splits")
        node = int(log.cells[log.node[event]])
        cells = log.cells[log.children[event]]
        left, right = (np.sort(bvh.geometry.ids[begin[cell] : end[cell]]) for cell in cells)
        sides = np.stack([box_around(boxes[ids]) for ids in (left, right)])
        box = box_around(sides)
        axis, position, cost = (column[event] for column in (log.axis, log.position, log.cost))
        found.append(
            Split(
                node,
                int(depths[node]),
                int(axis),
                float(position),
                float(cost),
                (left, right),
                box,
                sides,
            )
        )
    return found


def box_around(boxes: np.ndarray) -> np.ndarray:
    """Return the box (6,) around boxes (n, 6)."""
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
