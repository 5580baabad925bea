"""What there is to draw of a structure: its cells, and the planes that cut them."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..geometry.box_shape import surface_area
from ..geometry.polygons import Polygons
from ..progress import SILENT, Progress
from ..ranges import ranges

OBJECT, DIRECTIONS, RAYS, IMAGE = "object", "directions", "ray space", "image"
"""What cells may be parts of: the space that objects are in, the directions of rays, rays as points
with a direction, a picture."""

NEVER = np.iinfo(np.int64).max
"""A step of the building that never comes."""

AT_ONCE = 1 << 17
"""Polygons that are sorted between two reports, in some 50 ms."""


@dataclass(frozen=True)
class Cells:
    """Everything there is to draw: one cell or node each.

    Attributes
    ----------
    boxes : (n, 6) float64
        ``[x0, y0, z0, x1, y1, z1]``; around the cell, if that is not a box itself.
    numbers : (n,) int32
        The number by which the step log names the cell. Cells are sorted by depth.
    depth : (n,) int32
    is_leaf : (n,) bool
    count : (n,) int32
        Primitives in a leaf; 0 for inner nodes.
    extra : dict of str to (n,) array
        Figures of this structure's cells only, by name. ``order`` is the step of the building in
        which a cell was made.
    replaced : (n,) int64, optional
        The step of the building in which others took the place of a cell: its children where it
        was divided, that of which it became a child where it was merged; NEVER for those that stay.
        It and ``order`` are there if the build was asked for a log (:mod:`.build_log`).
    faces : Polygons, optional
        Of cells that are not boxes. Cells behind the last owner are drawn as their boxes, and so
        are those that `is_box` names.
    planes : Polygons, optional
        The planes that cut inner nodes, each clipped to its cell.
    areas : (n,) float64, optional
        Surface areas of cells that are not boxes.
    parent : (n,) int32, optional
        Number of the cell that each was divided from, -1 for roots; None if all are roots.
    is_box, is_dashed : (n,) bool, optional
        Which cells are drawn as their boxes, and which with dashed edges.
    n_own : int, optional
        So many cells are the structure's own; those behind are within instances, see
        :mod:`.within`.
    left_out : tuple of str
        What is there and not among the cells: counts of what is, such as ``"2 000 of ..."``.
    space : {OBJECT, DIRECTIONS, RAYS, IMAGE}
        What `boxes` and polygons lie in.
    """

    boxes: np.ndarray
    numbers: np.ndarray
    depth: np.ndarray
    is_leaf: np.ndarray
    count: np.ndarray
    extra: dict[str, np.ndarray] = field(default_factory=dict)
    faces: Polygons | None = None
    planes: Polygons | None = None
    areas: np.ndarray | None = None
    replaced: np.ndarray | None = None
    parent: np.ndarray | None = None
    space: str = OBJECT
    is_box: np.ndarray | None = None
    is_dashed: np.ndarray | None = None
    n_own: int | None = None
    left_out: tuple[str, ...] = ()

    @classmethod
    def sorted_by_depth(
        cls,
        boxes: np.ndarray,
        depth: np.ndarray,
        is_leaf: np.ndarray,
        count: np.ndarray,
        extra: dict[str, np.ndarray] | None = None,
        faces: Polygons | None = None,
        planes: Polygons | None = None,
        areas: np.ndarray | None = None,
        replaced: np.ndarray | None = None,
        parent: np.ndarray | None = None,
        progress: Progress = SILENT,
    ) -> Cells:
        """Order cells numbered 0, 1, ... by depth, so that a depth range is one piece.

        Everything is given in the order of the numbers: owners of polygons are numbers, too.

        Raises
        ------
        Cancelled
            From `progress`.
        """
        order = np.argsort(depth, kind="stable").astype(np.int32)
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        return cls(
            np.ascontiguousarray(boxes[order]), order, depth[order].astype(np.int32),
            is_leaf[order], count[order].astype(np.int32),
            {name: values[order] for name, values in (extra or {}).items()},
            faces and reowned(faces, place, progress), planes and reowned(planes, place, progress),
            None if areas is None else areas[order],
            None if replaced is None else replaced[order],
            None if parent is None else parent[order].astype(np.int32),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.boxes)

    def own(self) -> Cells:
        """Return the structure's own cells, without those within instances."""
        n = self.n_own
        if n is None:
            return self

        def part(values: Any) -> Any:
            return None if values is None else values[:n]

        return dataclasses.replace(
            self, boxes=self.boxes[:n], numbers=self.numbers[:n], depth=self.depth[:n],
            is_leaf=self.is_leaf[:n], count=self.count[:n],
            extra={name: values[:n] for name, values in self.extra.items()},
            faces=first_owners(self.faces, n), planes=first_owners(self.planes, n),
            replaced=part(self.replaced), areas=part(self.areas), parent=part(self.parent),
            is_box=part(self.is_box), is_dashed=None, n_own=None, left_out=(),
        )  # fmt: skip

    @functools.cached_property
    def _by_number(self) -> tuple[np.ndarray, np.ndarray]:
        """All numbers, ascending, and their places."""
        places = np.argsort(self.numbers, kind="stable")
        return self.numbers[places], places

    def sort_numbers(self) -> None:
        """Sort all numbers now, so that no call of :meth:`places_of` has to."""
        _ = self._by_number

    def places_of(self, numbers: np.ndarray) -> np.ndarray:
        """Return the places of the cells with some numbers, ascending, each once.

        Numbers that no cell has are left out. After the first call no more cells are looked at
        than are asked for.
        """
        ascending, places = self._by_number
        # Of the same type: for another one NumPy would convert all numbers first.
        asked = np.asarray(numbers).astype(ascending.dtype)
        ranks = np.searchsorted(ascending, asked)
        known = ranks < len(self)
        known[known] = ascending[ranks[known]] == asked[known]
        return np.unique(places[ranks[known]])

    @property
    def parents(self) -> np.ndarray:
        """Number of the cell that each was divided from, (n,) int32; -1 for roots."""
        return np.full(len(self), -1, np.int32) if self.parent is None else self.parent

    def attributes(self) -> dict[str, np.ndarray]:
        """Return the per-cell figures by name, to colour and to export."""
        return {
            "number": self.numbers,
            "parent": self.parents,
            "depth": self.depth,
            "is_leaf": self.is_leaf,
            "count": self.count,
            "area": surface_area(self.boxes) if self.areas is None else self.areas,
            **self.extra,
        }


def parents_of(count: int, inner: np.ndarray, children: np.ndarray) -> np.ndarray:
    """Return the parent of every node, (count,) int32; -1 for roots.

    Parameters
    ----------
    inner : (k,) int
        Numbers of inner nodes.
    children : (k, c) int
        Numbers of the children of each.
    """
    parent = np.full(count, -1, np.int32)
    parent[children] = inner[:, None]
    return parent


def reowned(polygons: Polygons, place: np.ndarray, progress: Progress = SILENT) -> Polygons:
    """Return polygons whose owner i is now called ``place[i]``, sorted by owner again.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    owners = place[polygons.owners]
    order = np.argsort(owners, kind="stable")
    sizes = np.diff(polygons.offsets)[order]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    begins, points = polygons.offsets[:-1][order], np.empty((offsets[-1], 3))
    for first in range(0, len(order), AT_ONCE):
        progress.report(first, len(order), "Sorting cells")
        last = min(first + AT_ONCE, len(order))
        before = ranges(begins[first:last], sizes[first:last])
        points[offsets[first] : offsets[last]] = polygons.points[before]
    return Polygons(points, offsets, owners[order])


def first_owners(polygons: Polygons | None, most: int) -> Polygons | None:
    """Return the polygons of the first so many owners; None if there are none."""
    if polygons is None:
        return None
    count = int(np.searchsorted(polygons.owners, most))
    offsets = polygons.offsets[: count + 1]
    return Polygons(polygons.points[: offsets[-1]], offsets, polygons.owners[:count])


def planes_across(boxes: np.ndarray, axis: int, position: np.ndarray) -> np.ndarray:
    """Return where planes perpendicular to an axis cut boxes, as (n, 4, 3) corners of rectangles.

    Parameters
    ----------
    boxes : (n, 6) float64
    position : (n,) float64
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    corners = np.empty((len(boxes), 4, 3))
    corners[:, :, axis] = position[:, None]
    corners[:, :, u] = boxes[:, [u, 3 + u, 3 + u, u]]
    corners[:, :, v] = boxes[:, [v, v, 3 + v, 3 + v]]
    return corners


def rectangles(corners: np.ndarray, owners: np.ndarray) -> Polygons:
    """Return rectangles, (n, 4, 3), as polygons sorted by their owners (n,)."""
    order = np.argsort(owners, kind="stable")
    offsets = 4 * np.arange(len(owners) + 1, dtype=np.int64)
    return Polygons(corners[order].reshape(-1, 3), offsets, owners[order])
