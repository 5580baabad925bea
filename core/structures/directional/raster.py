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

from collections.abc import Callable
from functools import partial

import numpy as np

from ...kernels import call, inner, kernel
from ...progress import Progress
from .faces import out_of_face
from .filling import AT_ONCE
from .insertion import View, cells_around, distance_to_plane, edge_of, view_of
from .lists import NONE, Lists
from .projection import ANGLE, NEAREST, OUTLINE, Insertion, X, Y, Z, footprints_of


def with_drawn(
    lists: Lists, insertion: Insertion, pixels: int, dilation: int, progress: Progress
) -> tuple[Lists, np.ndarray]:
    """Draw items into the cells of all faces; what is visible at the middles of pixels is kept.

    Parameters
    ----------
    lists : Lists
        Of uniform cells.
    pixels : int
        Along an edge of a cell.
    dilation : int
        So many pixels around a cell are its own as well.

    Returns
    -------
    lists : Lists
        Those, and behind their references the drawn ones.
    drawn : (n_cells + 1,) int64
        Where these begin, cell by cell.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    size = lists.size
    faces, width = insertion.faces, size * pixels
    counts, references, nearest = [], [lists.references], [lists.nearest]
    for face in range(len(faces.origins)):
        told = partial(progress.report, face, len(faces.origins), "Drawing items into cells")
        footprints = footprints_of(insertion, face, told)
        shown = drawn_face(view_of(insertion, face, footprints), width, told)
        cell, k = visible_in_cells(shown, size, pixels, dilation)
        # Footprints are in the order of their distance, and so are the lists.
        counts.append(np.bincount(cell, minlength=size * size))
        references.append(footprints.item[k])
        nearest.append(footprints.rows[k, NEAREST])
    drawn = len(lists.references) + np.cumsum([0, *np.concatenate(counts)])
    return lists._replace(
        references=np.concatenate(references), nearest=np.concatenate(nearest)
    ), drawn


def drawn_face(view: View, width: int, check: Callable[[], object]) -> np.ndarray:
    """Return which footprint each pixel of a face shows, (width, width) int64; NONE for none.

    Rows lie along v.

    Parameters
    ----------
    check : callable
        Is called now and then, and may raise.
    """
    shown, depth = np.full((width, width), NONE, np.int64), np.full((width, width), np.inf)
    count = len(view.footprints.item)
    for begin in range(0, count, AT_ONCE):
        check()
        call(draw_items, view, begin, min(begin + AT_ONCE, count), shown, depth)
    return shown


def visible_in_cells(
    shown: np.ndarray, size: int, pixels: int, dilation: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return which footprints are visible in which cells, each pair once, in order of both.

    Parameters
    ----------
    shown : (size * pixels, size * pixels) int64
        The footprint that each pixel shows, row by row along v; NONE for none.
    """
    width = size * pixels
    row, column = np.nonzero(shown >= 0)
    k = shown[row, column]
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
def draw_items(view, begin, end, shown, depth):
    """Draw some items into a face: each pixel shows the nearest at its middle.

    Parameters
    ----------
    view : View
    begin, end : int
        Of which footprints.
    shown : (n, n) int64
        NONE before any; in the end the footprint that each pixel shows.
    depth : (n, n) float64
        inf before any; in the end how far away that is.
    """
    width = len(shown)
    step = 2.0 / width
    for k in range(begin, end):
        left, right, low, high = cells_around(view.footprints.rows[k], width)
        for j in range(low, high + 1):
            for i in range(left, right + 1):
                distance = distance_at(view, k, -1.0 + (i + 0.5) * step, -1.0 + (j + 0.5) * step)
                if distance < depth[j, i]:
                    shown[j, i], depth[j, i] = k, distance


@inner
def distance_at(view, k, u, v):
    """Return how far away an item is at a place of a face, inf where it is not."""
    footprints, row = view.footprints, view.footprints.rows[k]
    if footprints.kind[k] == OUTLINE:
        for edge in range(footprints.first[k], footprints.first[k + 1]):
            a, b, c, _ = edge_of(footprints, k, edge)
            if a * u + b * v + c < 0.0:
                return np.inf
        return distance_to_plane(view, row, u, v)
    if view.is_parallel or row[ANGLE] >= 0.5 * np.pi:
        return row[NEAREST]
    # Where the ray enters the ball: its middle is at p, its radius that times the sine.
    x, y, z = out_of_face(view.back, u, v)
    length = np.sqrt(x * x + y * y + z * z)
    along = (x * row[X] + y * row[Y] + z * row[Z]) / length
    square = row[X] * row[X] + row[Y] * row[Y] + row[Z] * row[Z]
    under = (np.sin(row[ANGLE]) ** 2 - 1.0) * square + along * along
    return along - np.sqrt(under) if under >= 0.0 and along > 0.0 else np.inf
