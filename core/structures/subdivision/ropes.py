"""Ropes: links from every leaf to its neighbours, the lecture's "finger tree".

A rope leads through one face of a leaf to the smallest node that covers the whole face: the
neighbour on the same level, a larger leaf, or, if the other side is divided more finely, an inner
node, from which the walk goes down. They are made from the top down: an inner face of a node's
children leads to the sibling, an outer one to where the node's own rope leads. Then each rope is
pushed down as long as one child still covers the whole face.

H. Samet: Neighbor Finding in Images Represented by Octrees, CVGIP 46(3), 1989.
V. Havran, J. Bittner, J. Žára: Ray Tracing with Rope Trees, SCCG 1998.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kernels import call, inner, kernel
from .tree import STACK, child, leaf_index, planes


@inner
def push_down(tree, rope, face, boxes, node):
    """Return the smallest node below `rope` that covers a face of `node`."""
    across = face % 3
    while rope >= 0 and leaf_index(tree, rope) < 0:
        split = planes(tree, rope)
        side = 0
        for axis in range(3):
            plane = split[axis]
            if plane != plane:
                continue
            if axis == across:
                upper = 1 if face < 3 else 0  # the child at the face
            elif plane >= boxes[node, 3 + axis]:
                upper = 0
            elif plane <= boxes[node, axis]:
                upper = 1
            else:
                return rope
            side += upper << axis
        rope = child(tree, rope, side)
    return rope


@kernel
def link_leaves(tree, boxes, out, stack_nodes, stack_ropes):
    """Go through the tree with the ropes of the current node; write those of leaves."""
    stack_nodes[0] = 0
    for face in range(6):
        stack_ropes[0, face] = -1
    height = 1
    while height > 0:
        height -= 1
        node = stack_nodes[height]
        index = leaf_index(tree, node)
        if index >= 0:
            for face in range(6):
                out[index, face] = push_down(tree, stack_ropes[height, face], face, boxes, node)
            continue
        split = planes(tree, node)
        divided = 0
        for axis in range(3):
            if split[axis] == split[axis]:
                divided |= 1 << axis
        # The node's own ropes lie where its first child's will.
        own = stack_ropes.shape[0] - 1
        for face in range(6):
            stack_ropes[own, face] = stack_ropes[height, face]
        for side in range(8):
            if side & ~divided:
                continue
            stack_nodes[height] = child(tree, node, side)
            for face in range(6):
                axis, upper = face % 3, face // 3
                inside = divided >> axis & 1 and (side >> axis & 1) != upper
                stack_ropes[height, face] = (
                    child(tree, node, side ^ (1 << axis)) if inside else stack_ropes[own, face]
                )
            height += 1


def link(tree: Any, boxes: np.ndarray, leaves: np.ndarray) -> np.ndarray:
    """Return the ropes of all leaves, (n_leaves, 6) int32; -1 leads out of the root.

    Parameters
    ----------
    boxes : (n_nodes, 6) float64
    leaves : (n_leaves,)
        Node of every leaf.
    """
    ropes = np.empty((len(leaves), 6), np.int32)
    scratch = np.empty(STACK, np.int32), np.empty((STACK, 6), np.int32)
    call(link_leaves, tree, boxes, ropes, *scratch)
    return ropes
