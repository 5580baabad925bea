"""The start array of a class: a cut through the tree, below which lies all that its shaft meets.

It begins as the root. Then nodes are replaced by their children, where that saves tests:

- A child outside of the shaft is left out, and a node with one child left is that child: so a
  start may lie deep in the tree for nothing.
- A node whose volume a ray of the class meets with probability p costs 1 + 3 p in the mean: its
  test, and, if it is met, a step and the tests of both its children. These alone cost 2. So it is
  opened if p > 1/3, those first that are met most often, until the array is full.

p is the share of some rays of the class, the same ones for each, spread evenly over its origins and
directions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.events import NONE
from ...kernels import call, inner, kernel, whole
from ..ray_classification.beam import MOST_PLANES, bound_beam, box_in_beam
from ..ray_classification.ray_space import U

RAYS = 32
"""Rays that are asked which volumes they meet."""

PAYS = 1.0 / 3.0
"""How likely a volume must be met for it to be opened."""


class Tree(NamedTuple):
    """A binary hierarchy as its shafts see it.

    Attributes
    ----------
    boxes : (n, 6) float64
        Around the volumes.
    first, size : (n,) int32
        As in :class:`..bvh.walks.binary_walk.Binary`.
    root : int
    """

    boxes: np.ndarray
    first: np.ndarray
    size: np.ndarray
    root: int


class Scratch(NamedTuple):
    """Scratch memory for one cut.

    Attributes
    ----------
    planes : (MOST_PLANES, 4) float64
    places : (RAYS, 5) float64
        Where in a class its rays are, from 0 to 1.
    rays : (RAYS, 5) float64
        The same as points of ray space.
    chances : (most,) float64
        How likely each start is met; 0 for a leaf, which cannot be opened.
    """

    planes: np.ndarray
    places: np.ndarray
    rays: np.ndarray
    chances: np.ndarray


def scratch_for(most: int) -> Scratch:
    """Return scratch memory for arrays of so many starts."""
    # Multiples of powers of the root of x^6 = x + 1: points of even spread in five dimensions
    # (M. Roberts: The Unreasonable Effectiveness of Quasirandom Sequences, 2018).
    step = 1.1347241384015194 ** -np.arange(1.0, 6.0)
    places = (0.5 + np.arange(1, RAYS + 1)[:, None] * step) % 1.0
    return Scratch(
        np.zeros((MOST_PLANES, 4)), places, np.zeros((RAYS, 5)), np.zeros(most)
    )  # fmt: skip


@inner
def chance_of(box, rays, root):
    """Return the share of rays, (n, 5) in ray space, that meet a box, (6,)."""
    met = 0
    for i in range(len(rays)):
        enter, leave = 0.0, np.inf
        for other in range(3):
            axis = whole((root // 2 + other) % 3)
            slope = rays[i, U - 1 + other]
            if other == 0:
                slope = 1.0 if root % 2 == 0 else -1.0
            low = (box[axis] - rays[i, axis]) / slope
            high = (box[3 + axis] - rays[i, axis]) / slope
            near = high if high < low else low
            far = low if high < low else high
            enter = near if near > enter else enter
            leave = far if far < leave else leave
        met += enter <= leave
    return met / len(rays)


@inner
def narrowed(tree, node, planes, count, slack):
    """Return the lowest node below which lies all that a beam meets of one that it meets, or NONE.

    Of an inner node both children are met.
    """
    node = whole(node)
    while tree.size[node] == 0:
        left = whole(tree.first[node])
        in_left = box_in_beam(tree.boxes, left, planes, count, slack) >= 0
        in_right = box_in_beam(tree.boxes, left + 1, planes, count, slack) >= 0
        if in_left and in_right:
            break
        if not in_left and not in_right:
            return whole(NONE)
        node = left if in_left else left + 1
    return node


@inner
def put(tree, node, planes, count, slack, scratch, root, starts, slot):
    """Write what a beam meets below a node as a start; return how many that are, 0 or 1."""
    node = narrowed(tree, node, planes, count, slack)
    if node == NONE:
        return 0
    starts[slot], scratch.chances[slot] = node, 0.0
    if tree.size[node] == 0:
        scratch.chances[slot] = chance_of(tree.boxes[node], scratch.rays, root)
    return 1


@kernel
def cut_some(tree, bounds, roots, slack, starts, scratch):
    """Write the starts of classes with these bounds, in any order; NONE behind the last."""
    planes, chances, most = scratch.planes, scratch.chances, starts.shape[1]
    for i in range(len(roots)):
        root, own = roots[i], starts[i]
        count = bound_beam(root, bounds[i], planes)
        for ray in range(RAYS):
            for dimension in range(5):
                low, high = bounds[i, 0, dimension], bounds[i, 1, dimension]
                scratch.rays[ray, dimension] = low + scratch.places[ray, dimension] * (high - low)
        n = put(tree, whole(tree.root), planes, count, slack, scratch, root, own, whole(0))
        while 0 < n < most:
            opened, likeliest = whole(-1), PAYS
            for slot in range(n):
                if chances[slot] > likeliest:
                    opened, likeliest = whole(slot), chances[slot]
            if opened < 0:
                break
            # One child takes its place, the other goes to the end, if anything of them is met.
            left = whole(tree.first[own[opened]])
            last = whole(n)
            n += put(tree, left + 1, planes, count, slack, scratch, root, own, last)
            if put(tree, left, planes, count, slack, scratch, root, own, opened) == 0:
                n -= 1
                own[opened], chances[opened] = own[n], chances[n]
        for slot in range(n, most):
            own[slot] = NONE


def cut_tree(
    tree: Tree, bounds: np.ndarray, roots: np.ndarray, slack: float, most: int
) -> np.ndarray:
    """Return the starts of classes, (n, most) int32, front to back; NONE behind the last.

    Parameters
    ----------
    bounds : (n, 2, 6) float64
    roots : (n,) int64
        Of the classes, see :func:`.classes.bounds_of`.
    slack : float
        By which their shafts are wider.
    """
    starts = np.empty((len(roots), most), np.int32)
    call(cut_some, tree, bounds, roots, slack, starts, scratch_for(most))
    axes, boxes = (roots // 2)[:, None], tree.boxes[starts]
    rows, slots = np.ogrid[: len(roots), :most]
    nearest = np.where(
        roots[:, None] % 2 == 0, boxes[rows, slots, axes], -boxes[rows, slots, 3 + axes]
    )
    nearest[starts == NONE] = np.inf
    order = np.argsort(nearest, axis=1, kind="stable")
    return np.take_along_axis(starts, order, axis=1)
