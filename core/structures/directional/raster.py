"""Rasterised insertion: items are drawn into the faces of a cube with a depth buffer.

That is how graphics hardware fills uniform cells (lecture, "HW rasterization and visibility
(depth-buffer) can be used for uniform division"): every cell has some pixels, and lists what is
visible at the middle of one. Lists are short, for what is hidden is not on them, and what is small
falls between the pixels: this is *not conservative*. To *dilate*, a cell takes the pixels around it
as well, and misses less.

So what is drawn is asked first, and a ray that it does not block is tested against the exact list:
no shadow is lost, and what was overlooked is counted.

A flat item is drawn as it is, any other as its ball.
"""

from __future__ import annotations

import numpy as np

from ...kernels import call, inner, kernel
from ...progress import Progress
from .faces import out_of_face
from .insertion import edge_of
from .lists import NONE, NOWHERE, Lists, step_along, with_entries
from .projection import (
    ANGLE,
    HEIGHT,
    NEAREST,
    NX,
    NY,
    NZ,
    OUTLINE,
    U0,
    U1,
    V0,
    V1,
    Insertion,
    X,
    Y,
    Z,
    footprints_of,
)


def drawn_lists(
    insertion: Insertion, size: int, pixels: int, dilation: int, progress: Progress
) -> Lists:
    """Return what is visible through the cells of all faces at the middles of their pixels.

    Parameters
    ----------
    size, pixels : int
        Cells along an edge of a face, and pixels along an edge of a cell.
    dilation : int
        So many pixels around a cell are its own as well.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    faces, width = insertion.faces, size * pixels
    counts, references, nearest = [], [], []
    for face in range(len(faces.origins)):
        progress.report(face, len(faces.origins), "Drawing items into cells")
        footprints = footprints_of(insertion, face)
        drawn, depth = np.full((width, width), NONE, np.int64), np.full((width, width), np.inf)
        call(draw_items, footprints, faces, face, drawn, depth)
        cell, k = visible_in_cells(drawn, size, pixels, dilation)
        # Footprints are in the order of their distance, and so are the lists.
        counts.append(np.bincount(cell, minlength=size * size))
        references.append(footprints.item[k])
        nearest.append(footprints.rows[k, NEAREST])
    ends = np.cumsum(np.concatenate(counts))
    cells = len(ends)
    lists = Lists(
        size, 0, NOWHERE, np.full(cells, NONE, np.int32), ends - np.concatenate(counts), ends,
        np.full(cells, NONE, np.int32), np.full(cells, np.inf), np.concatenate(references),
        np.concatenate(nearest),
    )  # fmt: skip
    return with_entries(lists, len(faces.origins))


def visible_in_cells(
    drawn: np.ndarray, size: int, pixels: int, dilation: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return which footprints are visible in which cells, each pair once, in order of both.

    Parameters
    ----------
    drawn : (size * pixels, size * pixels) int64
        The footprint that each pixel shows, row by row along v; NONE for none.
    """
    width = size * pixels
    row, column = np.nonzero(drawn >= 0)
    k = drawn[row, column]
    most = int(k.max(initial=0)) + 1
    found = [np.zeros(0, np.int64)]
    for down in range(-dilation, dilation + 1):
        for across in range(-dilation, dilation + 1):
            j, i = row + down, column + across
            inside = (j >= 0) & (j < width) & (i >= 0) & (i < width)
            cell = j[inside] // pixels * size + i[inside] // pixels
            found.append(np.unique(cell * most + k[inside]))
    pairs = np.unique(np.concatenate(found))
    return pairs // most, pairs % most


@kernel
def draw_items(footprints, faces, face, drawn, depth):
    """Draw all items into a face: each pixel shows the nearest at its middle.

    Parameters
    ----------
    drawn : (n, n) int64
        NONE; in the end the footprint that each pixel shows.
    depth : (n, n) float64
        inf; in the end how far away that is.
    """
    width = len(drawn)
    step = 2.0 / width
    for k in range(len(footprints.item)):
        row = footprints.rows[k]
        left, _ = step_along(row[U0], width)
        right, _ = step_along(row[U1], width)
        low, _ = step_along(row[V0], width)
        high, _ = step_along(row[V1], width)
        for j in range(low, high + 1):
            for i in range(left, right + 1):
                u, v = -1.0 + (i + 0.5) * step, -1.0 + (j + 0.5) * step
                distance = distance_at(footprints, faces, face, k, u, v)
                if distance < depth[j, i]:
                    drawn[j, i], depth[j, i] = k, distance


@inner
def distance_at(footprints, faces, face, k, u, v):
    """Return how far away an item is at a place of a face, inf where it is not."""
    row = footprints.rows[k]
    x, y, z = out_of_face(faces, face, u, v)
    if footprints.kind[k] == OUTLINE:
        for edge in range(footprints.first[k], footprints.first[k + 1]):
            a, b, c = edge_of(footprints, k, edge)
            if a * u + b * v + c < 0.0:
                return np.inf
        w = faces.axes[face, 2]
        if faces.is_parallel[face]:
            x, y, z = x - w[0], y - w[1], z - w[2]
            along = row[NX] * w[0] + row[NY] * w[1] + row[NZ] * w[2]
            return (row[HEIGHT] - (row[NX] * x + row[NY] * y + row[NZ] * z)) / along
        along = row[NX] * x + row[NY] * y + row[NZ] * z
        return row[HEIGHT] / along * np.sqrt(x * x + y * y + z * z)
    if faces.is_parallel[face] or row[ANGLE] >= 0.5 * np.pi:
        return row[NEAREST]
    # Where the ray enters the ball: its middle is at p, its radius that times the sine.
    length = np.sqrt(x * x + y * y + z * z)
    along = (x * row[X] + y * row[Y] + z * row[Z]) / length
    square = row[X] * row[X] + row[Y] * row[Y] + row[Z] * row[Z]
    under = (np.sin(row[ANGLE]) ** 2 - 1.0) * square + along * along
    return along - np.sqrt(under) if under >= 0.0 and along > 0.0 else np.inf
