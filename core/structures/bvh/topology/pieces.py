"""The parts of triangles that references stand for, where spatial splits have cut triangles.

A hierarchy keeps the box of each part. Boxes as volumes need no more; to fit volumes of another
kind, the triangles are clipped to their boxes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ....geometry.box_shape import hulls_of_boxes
from ....geometry.clip import POLYGON_SIZE, clip
from ....geometry.geometry import hulls_of
from ....geometry.triangles import Triangles
from ....kernels import call, kernel
from ....parallel import for_chunks
from ....progress import Progress


class Pieces(NamedTuple):
    """Parts of triangles, as triangles.

    Attributes
    ----------
    corners : (m, 3, 3) float64
        In the order of the references.
    offsets : (n_references + 1,) int64
        Reference i has ``corners[offsets[i]:offsets[i + 1]]``.
    """

    corners: np.ndarray
    offsets: np.ndarray


@kernel
def clip_references(corners, boxes, first, last, offsets, out, polygon):
    """Write the parts of triangles in their boxes as fans of triangles.

    Where `out` has no room, write how many triangles each fan has, to ``offsets[reference + 1]``.

    Parameters
    ----------
    first, last : int
        Which references.
    polygon : (2 * POLYGON_SIZE, 3) float64
        Scratch.
    """
    for i in range(first, last):
        begin, end = clip(corners, i, boxes[i], polygon)
        if len(out) == 0:
            # Of a part that rounding makes vanish, a corner is left.
            offsets[i + 1] = max(end - begin - 2, 1)
            continue
        to = offsets[i]
        if end - begin < 3:
            for corner in range(3):
                for axis in range(3):
                    out[to, corner, axis] = boxes[i, axis]
        for corner in range(begin + 1, end - 1):
            for axis in range(3):
                out[to, 0, axis] = polygon[begin, axis]
                out[to, 1, axis] = polygon[corner, axis]
                out[to, 2, axis] = polygon[corner + 1, axis]
            to += 1


def pieces_of(corners: np.ndarray, boxes: np.ndarray, progress: Progress) -> Pieces:
    """Return the parts of triangles in boxes.

    Parameters
    ----------
    corners : (n, 3, 3) float64
        The triangle of each reference.
    boxes : (n, 6) float64
        The box of each reference.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    offsets = np.zeros(len(boxes) + 1, np.int64)

    def write(out: np.ndarray) -> None:
        def work(first: int, last: int) -> None:
            polygon = np.empty((2 * POLYGON_SIZE, 3))
            call(clip_references, corners, boxes, first, last, offsets, out, polygon)

        for_chunks(work, len(boxes), 0, progress, "Clipping triangles")

    write(np.empty((0, 3, 3)))
    np.cumsum(offsets, out=offsets)
    pieces = np.empty((int(offsets[-1]), 3, 3))
    write(pieces)
    return Pieces(pieces, offsets)


def referred(
    geometry: Any,
    parts: np.ndarray | None,
    begin: np.ndarray,
    end: np.ndarray,
    progress: Progress,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return triangles, and the ranges of them that ranges of references stand for.

    Parameters
    ----------
    geometry : NamedTuple of arrays
        In the order of the references; of what is no triangle, some whose hull contains it.
    parts : (n_references, 6) float64 or None
        Boxes of the parts that references stand for, if not for whole triangles.
    """
    if parts is not None and isinstance(geometry, Triangles):
        corners, places = pieces_of(geometry.corners, parts, progress)
    elif parts is not None:
        corners, places = hulls_of_boxes(parts)
    else:
        corners, places = hulls_of(geometry)
    return corners, places[begin], places[end]
