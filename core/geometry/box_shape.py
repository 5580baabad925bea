"""The shape of boxes that are rows of six numbers: corners, edges, sides, surface."""

from __future__ import annotations

import numpy as np

UNIT_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=np.float32)
"""Corners of a box, (8, 3): 0 stands for its lower and 1 for its upper bound."""

EDGES = np.array(
    [(i, i | 1 << axis) for axis in range(3) for i in range(8) if not i & 1 << axis],
    dtype=np.int32,
)
"""Edges of a box, (12, 2), as pairs of corners."""

SIDES = np.array([(0, 2, 6, 4), (1, 3, 7, 5), (0, 1, 5, 4), (2, 3, 7, 6), (0, 1, 3, 2),
                  (4, 5, 7, 6)], dtype=np.int32)  # fmt: skip
"""Sides of a box, (6, 4), as corners once around: lower and upper in x, y and z."""


def corners_of(boxes: np.ndarray) -> np.ndarray:
    """Return the corners of boxes (n, 6) in the order of UNIT_CORNERS, (n, 8, 3)."""
    return np.where(UNIT_CORNERS == 0.0, boxes[:, None, :3], boxes[:, None, 3:])


def box_segments(boxes: np.ndarray) -> np.ndarray:
    """Return the edges of boxes (n, 6) as segments, (12 n, 2, 3)."""
    return corners_of(boxes)[:, EDGES].reshape(-1, 2, 3)


def surface_area(boxes: np.ndarray) -> np.ndarray:
    """Return the surface areas of boxes, (n, 6) to (n,): 2 (ab + bc + ca)."""
    size = boxes[..., 3:] - boxes[..., :3]
    x, y, z = size[..., 0], size[..., 1], size[..., 2]
    return 2.0 * (x * y + y * z + z * x)


def hulls_of_boxes(boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return three triangles for each box (n, 6), whose nine corners are its eight and one twice.

    Returns
    -------
    corners : (3 n, 3, 3) float64
    offsets : (n + 1,) int64
        Box i has ``corners[offsets[i]:offsets[i + 1]]``.
    """
    corners = corners_of(boxes)[:, [0, 1, 2, 3, 4, 5, 6, 7, 7]]
    return corners.reshape(-1, 3, 3), 3 * np.arange(len(boxes) + 1)
