"""Edges and faces of cells, whatever their shape: what all drawing of cells is made of.

A cell is a box, or a convex polyhedron given by its faces. Two faces of a polyhedron meet in an
edge and bring its ends along each for itself: equal ends are found and joined here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..geometry.box_shape import EDGES, SIDES, corners_of
from ..progress import SILENT, Progress
from ..ranges import ranges

if TYPE_CHECKING:  # only the types: their module brings Numba in
    from .cells import Cells, Polygons

JOINED = 1e-7
"""Corners of a polyhedron as near as this share of its size are one."""

AT_ONCE = 1000
"""Polyhedra whose edges are found together."""


DASHES = 6
"""Dashes of an edge: few enough to be told apart, and enough for none to be taken for an edge."""


class Wires(NamedTuple):
    """Edges without faces.

    Attributes
    ----------
    points : (m, 3) float64
    edges : (k, 2) int64
        Pairs of points; no two edges of a cell are equal.
    owners : (m,) int64
        Place in `Cells` of the cell that each point belongs to, ascending along `edges`, too.
    """

    points: np.ndarray
    edges: np.ndarray
    owners: np.ndarray

    def segments(self) -> np.ndarray:
        """Return both ends of every edge, (k, 2, 3)."""
        return self.points[self.edges]

    def edge_owners(self) -> np.ndarray:
        """Return the place of the cell that each edge belongs to, (k,)."""
        return self.owners[self.edges[:, 0]]


def wires_of(cells: Cells, places: np.ndarray, progress: Progress = SILENT) -> Wires:
    """Return the edges of some cells.

    Parameters
    ----------
    places : (k,) int
        Ascending.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    shaped, boxes = _by_faces(cells, places)
    points = corners_of(cells.boxes[boxes]).reshape(-1, 3)
    edges = (8 * np.arange(len(boxes))[:, None, None] + EDGES).reshape(-1, 2)
    owners = np.repeat(boxes, 8)
    if cells.faces is None:
        return _dashed(cells, Wires(points, edges, owners))
    parts = []
    # Not too many at once: what is sorted should stay in the cache, and a cancel is noticed.
    for first in range(0, len(shaped), AT_ONCE):
        progress.report(first, len(shaped), "Finding edges")
        parts.append(_joined(_chosen(cells.faces, shaped[first : first + AT_ONCE]), cells.boxes))
    return _dashed(cells, _all_of([*parts, Wires(points, edges, owners)]))


def _all_of(parts: Sequence[Wires]) -> Wires:
    """Return the edges of several lists as one."""
    begins = np.cumsum([0] + [len(part.points) for part in parts])
    return Wires(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.edges + begin for part, begin in zip(parts, begins)]),
        np.concatenate([part.owners for part in parts]),
    )


def by_shape(cells: Cells, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return those of some ascending places that are drawn edge by edge, and the boxes."""
    shaped, boxes = _by_faces(cells, places)
    if cells.is_dashed is None:
        return shaped, boxes
    is_dashed = cells.is_dashed[boxes]
    return np.sort(np.concatenate([shaped, boxes[is_dashed]])), boxes[~is_dashed]


def _by_faces(cells: Cells, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return those of some ascending places whose edges are those of their faces, and the boxes."""
    if cells.faces is None:
        return places[:0], places
    is_shaped = places <= cells.faces.owners.max(initial=-1)
    if cells.is_box is not None:
        is_shaped &= ~cells.is_box[places]
    return places[is_shaped], places[~is_shaped]


def dashes_of(segments: np.ndarray) -> np.ndarray:
    """Return segments, (n, 2, 3), as DASHES dashes each, one at either end, (DASHES n, 2, 3)."""
    ends = np.arange(2 * DASHES).reshape(1, DASHES, 2, 1) / (2 * DASHES - 1)
    begin, end = segments[:, None, :1], segments[:, None, 1:]
    return ((1.0 - ends) * begin + ends * end).reshape(-1, 2, 3)


def _dashed(cells: Cells, wires: Wires) -> Wires:
    """Return edges in the order of their cells, those of cells that are dashed in dashes."""
    if cells.is_dashed is None:
        return wires
    owners, segments = wires.edge_owners(), wires.segments()
    dashed = cells.is_dashed[owners]
    segments = np.concatenate([segments[~dashed], dashes_of(segments[dashed])])
    owners = np.concatenate([owners[~dashed], np.repeat(owners[dashed], DASHES)])
    order = np.argsort(owners, kind="stable")
    edges = np.arange(2 * len(order)).reshape(-1, 2)
    return Wires(segments[order].reshape(-1, 3), edges, np.repeat(owners[order], 2))


def outlines_of(polygons: Polygons) -> Wires:
    """Return the sides of polygons."""
    sizes = np.diff(polygons.offsets)
    corners = np.arange(len(polygons.points))
    following = corners + 1
    # The last side of a polygon leads back to its first corner. There are no empty polygons.
    following[polygons.offsets[1:] - 1] = polygons.offsets[:-1]
    edges = np.stack([corners, following], axis=1)
    return Wires(polygons.points, edges, np.repeat(polygons.owners, sizes))


def faces_of(cells: Cells, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces of some cells as triangles.

    Parameters
    ----------
    places : (k,) int
        Ascending.

    Returns
    -------
    triangles : (m, 3, 3) float64
    owners : (m,) int64
        Ascending.
    """
    shaped, boxes = _by_faces(cells, places)
    around = corners_of(cells.boxes[boxes])[:, SIDES]
    halves = around[:, :, [(0, 1, 2), (0, 2, 3)]].reshape(-1, 3, 3)
    owners = np.repeat(boxes, 12)
    if cells.faces is None:
        return halves, owners
    triangles, first_owners = triangles_of(_chosen(cells.faces, shaped))
    owners = np.concatenate([first_owners, owners])
    order = np.argsort(owners, kind="stable")
    return np.concatenate([triangles, halves])[order], owners[order]


def triangles_of(polygons: Polygons) -> tuple[np.ndarray, np.ndarray]:
    """Return convex polygons as fans of triangles (m, 3, 3), and the owner of each (m,)."""
    sizes = np.diff(polygons.offsets)
    per_polygon = np.maximum(sizes - 2, 0)
    first = np.repeat(polygons.offsets[:-1], per_polygon)
    rank = ranges(0, per_polygon)  # of a triangle in its fan
    triangles = polygons.points[np.stack([first, first + rank + 1, first + rank + 2], axis=1)]
    return triangles, np.repeat(polygons.owners, per_polygon)


def _chosen(polygons: Polygons, places: np.ndarray) -> Polygons:
    """Return the polygons of some owners, which ascend; looks at no others."""
    begins = np.searchsorted(polygons.owners, places, side="left")
    ends = np.searchsorted(polygons.owners, places, side="right")
    kept = ranges(begins, ends - begins)
    sizes = polygons.offsets[kept + 1] - polygons.offsets[kept]
    corners = ranges(polygons.offsets[kept], sizes)
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    return type(polygons)(polygons.points[corners], offsets, polygons.owners[kept])


def _joined(polygons: Polygons, boxes: np.ndarray) -> Wires:
    """Return the edges of polyhedra, each once though two faces have it."""
    apart = outlines_of(polygons)
    around = boxes[apart.owners]
    size = (around[:, 3:] - around[:, :3]).max(axis=1, initial=0.0)
    grain = np.where(size > 0.0, JOINED * size, 1.0)
    whole = np.rint((apart.points - around[:, :3]) / grain[:, None]).astype(np.int64)
    order = np.lexsort((*whole.T, apart.owners))
    named = np.column_stack([apart.owners, whole])[order]
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = (named[1:] != named[:-1]).any(axis=1)
    joined = np.empty(len(order), dtype=np.int64)
    joined[order] = np.cumsum(is_new) - 1
    points, owners = apart.points[order[is_new]], apart.owners[order[is_new]]

    low, high = np.sort(joined[apart.edges], axis=1).T
    code = np.unique(low[low != high] * len(points) + high[low != high])
    return Wires(points, np.stack(np.divmod(code, max(len(points), 1)), axis=1), owners)
