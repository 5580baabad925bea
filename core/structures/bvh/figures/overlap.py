"""Overlap of siblings: how much of a node lies in two of its children at once.

    overlap = SA(L and R) / SA(parent)

is the chance that a line that hits the node passes through what both children share, and has to
search both there. Of more than two children all pairs are added up. Volumes are taken by the
axis-aligned boxes around them, also those of other kinds.

Boxes are closed: two that only touch share a rectangle, whose two sides count. A flat scene would
have no overlap otherwise.
"""

from __future__ import annotations

import numpy as np

from ....geometry.box import area_of
from ....kernels import call, inner, kernel


def sibling_overlap(boxes: np.ndarray, first: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Return the overlap of the children of every node, (n_nodes,); 0 for leaves.

    Parameters
    ----------
    boxes : (n_nodes, 6) float64
    first, width : (n_nodes,) int
        First child and number of children, which follow each other.
    """
    overlap = np.zeros(len(boxes))
    call(add_overlaps, boxes, first, width, np.empty(6), overlap)
    return overlap


@kernel
def add_overlaps(boxes, first, width, shared, overlap):
    """Add up the overlap of all pairs of siblings; `shared` is scratch memory, (6,)."""
    for node in range(len(width)):
        area = area_of(boxes[node])
        for b in range(first[node], first[node] + width[node]):
            for a in range(first[node], b):
                share_box(boxes, a, b, shared)
                if area > 0.0:
                    overlap[node] += area_of(shared) / area


@inner
def share_box(boxes, a, b, shared):
    """Write the intersection of two boxes; a point if there is none."""
    for axis in range(3):
        low, high = boxes[a, axis], boxes[a, 3 + axis]
        low = boxes[b, axis] if boxes[b, axis] > low else low
        high = boxes[b, 3 + axis] if boxes[b, 3 + axis] < high else high
        if low > high:
            for side in range(6):
                shared[side] = 0.0
            return
        shared[axis], shared[3 + axis] = low, high


def shared_boxes(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the intersections of boxes (n, 6) with others, (n, 6).

    Where there is none, it is a point.
    """
    low, high = np.maximum(a[:, :3], b[:, :3]), np.minimum(a[:, 3:], b[:, 3:])
    shared = np.concatenate([low, high], axis=1)
    shared[(low > high).any(axis=1)] = 0.0
    return shared
