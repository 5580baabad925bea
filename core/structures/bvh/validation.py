"""What has to be true of every hierarchy, whoever built and rearranged it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...geometry.box import Boxes, boxes_of
from ...geometry.kdop import KDOPs
from ...geometry.rays import ULPS
from ...ranges import ranges
from .fit import sticking_out
from .tree import ranges_of

if TYPE_CHECKING:
    from .hierarchy import BVH

WEIGHTS = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4.0
"""Points of a triangle as weights of its corners: corners, and others evenly between."""


def violations_of(bvh: BVH) -> list[str]:
    """Return the violated invariants of a hierarchy, one sentence each.

    Leaves partition the references, every triangle has one, every node but the root one parent, and
    volumes contain all triangles below them. Boxes and k-DOPs contain those of their children, too.
    """
    violations = []
    volumes, first, count = bvh.arrays.volumes, bvh.arrays.first, bvh.arrays.size
    leaves = np.flatnonzero(count > 0)
    covered = np.concatenate([np.arange(first[n], first[n] + count[n]) for n in leaves])
    ids = bvh.triangles.ids
    if not np.array_equal(np.sort(covered), np.arange(len(ids))):
        violations.append("the leaves do not partition the references")
    if not np.array_equal(np.unique(ids), np.arange(len(bvh.scene))):
        violations.append("a triangle is referenced nowhere")
    inner = np.flatnonzero(count == 0)
    widths = bvh.width()
    width = widths[inner]
    children = ranges(first[inner], width)
    if not np.array_equal(np.sort(children), np.arange(1, len(count))):
        violations.append("a node has no parent or several")
    elif isinstance(volumes, Boxes | KDOPs) and (
        not volumes.contain(np.repeat(inner, width), children).all()
    ):
        violations.append("a node does not contain a child")
    if isinstance(volumes, Boxes) and len(inner) and not violations:
        boxes, starts = volumes.rows, np.cumsum(width) - width
        union_low = np.minimum.reduceat(boxes[children, :3], starts)
        union_high = np.maximum.reduceat(boxes[children, 3:], starts)
        if (boxes[inner] != np.concatenate([union_low, union_high], 1)).any():
            violations.append("a node's box is not the union of its children's")
    if not violations:
        outsiders = sticking_out(volumes, *bvh.referred(*ranges_of(first, count, widths)))
        if len(outsiders):
            violations.append(f"triangles stick out of {len(outsiders)} nodes")
    if bvh.parts is not None and not covers(bvh.scene.triangles, ids, bvh.parts):
        violations.append("the parts of a triangle do not cover it")
    return violations


def covers(triangles: np.ndarray, ids: np.ndarray, boxes: np.ndarray) -> bool:
    """Say whether every triangle is inside the boxes of its references.

    With a single reference its box has to contain the whole triangle. With several, every one of
    the points WEIGHTS has to be in one of the boxes, or as near as rounding allows.

    Parameters
    ----------
    triangles : (n, 3, 3) float64
    ids : (m,) int
        The triangle of each reference.
    boxes : (m, 6) float64
    """
    own = boxes_of(triangles)[ids]
    is_inside = (own[:, :3] >= boxes[:, :3]).all(axis=1) & (own[:, 3:] <= boxes[:, 3:]).all(axis=1)
    is_single = np.bincount(ids, minlength=len(triangles))[ids] == 1
    several, part = ids[~is_single], boxes[~is_single]
    slack = ULPS * np.abs(triangles).max(axis=(0, 1))
    found = np.zeros((len(triangles), len(WEIGHTS)), dtype=bool)
    for place, weights in enumerate(WEIGHTS):
        points = np.einsum("k,nkc->nc", weights, triangles[several])
        inside = (points >= part[:, :3] - slack) & (points <= part[:, 3:] + slack)
        found[several[inside.all(axis=1)], place] = True
    return bool(is_inside[is_single].all() and found[several].all())
