"""What has to be true of every hierarchy, whoever built and rearranged it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....geometry.box import Boxes
from ....geometry.fit import sticking_out
from ....geometry.kdop import KDOPs
from ....geometry.rays import ULPS
from ....geometry.triangles import Triangles
from ....progress import SILENT
from ....ranges import ranges
from .pieces import referred
from .tree import ranges_of

WEIGHTS = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4.0
"""Points of a triangle as weights of its corners: corners, and others evenly between."""


def violations_of(
    tree: Any,
    widths: np.ndarray,
    referred_to: Any,
    parts: np.ndarray | None,
    geometry: Any,
    around: np.ndarray,
) -> list[str]:
    """Return the violated invariants of a hierarchy, one sentence each.

    Leaves partition the references, every triangle has one, every node but the root one parent, and
    volumes contain all triangles below them. Boxes and k-DOPs contain those of their children, too.

    Parameters
    ----------
    tree : Binary or Wide
    widths : (n_nodes,) int
        How many children every node has.
    referred_to : NamedTuple of arrays
        The geometry in the order of the references.
    parts : (n_references, 6) float64 or None
        Boxes of the parts that references stand for, if not for whole triangles.
    geometry : NamedTuple of arrays
        Of the scene.
    around : (n, 6) float64
        The boxes of its items.
    """
    violations = []
    volumes, first, count = tree.volumes, tree.first, tree.size
    leaves = np.flatnonzero(count > 0)
    covered = np.concatenate([np.arange(first[n], first[n] + count[n]) for n in leaves])
    ids = referred_to.ids
    if not np.array_equal(np.sort(covered), np.arange(len(ids))):
        violations.append("the leaves do not partition the references")
    if not np.array_equal(np.unique(ids), np.arange(len(around))):
        violations.append("an item is referenced nowhere")
    inner = np.flatnonzero(count == 0)
    width = widths[inner]
    children = ranges(first[inner], width)
    if not np.array_equal(np.sort(children), np.arange(1, len(count))):
        violations.append("a node has no parent or several")
    elif isinstance(volumes, Boxes | KDOPs) and (
        not volumes.contain(np.repeat(inner, width), children).all()
    ):
        violations.append("a node does not contain a child")
    # Of a solid that is cut, ever less is left the better the cell is known.
    is_exact = parts is None or isinstance(geometry, Triangles)
    if isinstance(volumes, Boxes) and len(inner) and not violations and is_exact:
        boxes, starts = volumes.rows, np.cumsum(width) - width
        union_low = np.minimum.reduceat(boxes[children, :3], starts)
        union_high = np.maximum.reduceat(boxes[children, 3:], starts)
        if (boxes[inner] != np.concatenate([union_low, union_high], 1)).any():
            violations.append("a node's box is not the union of its children's")
    if not violations:
        if isinstance(volumes, Boxes) and parts is None:
            # Not the triangles around items: those of what is round are larger than its box.
            own, starts = around[ids[covered]], np.cumsum(count[leaves]) - count[leaves]
            is_inside = (np.minimum.reduceat(own[:, :3], starts) >= volumes.rows[leaves, :3]) & (
                np.maximum.reduceat(own[:, 3:], starts) <= volumes.rows[leaves, 3:]
            )
            outsiders = leaves[~is_inside.all(axis=1)]
        else:
            ranges_below = ranges_of(first, count, widths)
            outsiders = sticking_out(volumes, *referred(referred_to, parts, *ranges_below, SILENT))
        if len(outsiders):
            violations.append(f"items stick out of {len(outsiders)} nodes")
    is_cut = parts is not None and isinstance(geometry, Triangles)
    if is_cut and not covers(geometry, around, ids, np.asarray(parts)):
        violations.append("the parts of a triangle do not cover it")
    return violations


def covers(triangles: Triangles, around: np.ndarray, ids: np.ndarray, boxes: np.ndarray) -> bool:
    """Say whether every triangle is inside the boxes of its references.

    With a single reference its box has to contain the whole triangle. With several, every one of
    the points WEIGHTS has to be in one of the boxes, or as near as rounding allows.

    Parameters
    ----------
    triangles : Triangles
    around : (n, 6) float64
        Their boxes.
    ids : (m,) int
        The triangle of each reference.
    boxes : (m, 6) float64
    """
    corners, own = triangles.corners, around[ids]
    is_inside = (own[:, :3] >= boxes[:, :3]).all(axis=1) & (own[:, 3:] <= boxes[:, 3:]).all(axis=1)
    is_single = np.bincount(ids, minlength=len(corners))[ids] == 1
    several, part = ids[~is_single], boxes[~is_single]
    slack = ULPS * np.abs(corners).max(axis=(0, 1))
    found = np.zeros((len(corners), len(WEIGHTS)), dtype=bool)
    for place, weights in enumerate(WEIGHTS):
        points = np.einsum("k,nkc->nc", weights, corners[several])
        inside = (points >= part[:, :3] - slack) & (points <= part[:, 3:] + slack)
        found[several[inside.all(axis=1)], place] = True
    return bool(is_inside[is_single].all() and found[several].all())
