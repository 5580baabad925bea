"""Cells of faces, and the lists of items that may be seen through them, nearest first.

Every face is divided into ``size`` times ``size`` cells, and in adaptive division each of those
into four, again and again, while its list is longer than ``max_list_size``: a quadtree. A cell is a
node of that; lists are those of its leaves.

Items are put in from the nearest to the farthest. So lists are in order, and where an item covers a
cell, those that begin behind it are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inlined, whole
from .faces import Faces

NONE = -1


class Lists(NamedTuple):
    """Cells and their lists, as the kernels see them.

    Attributes
    ----------
    size : int
        Cells along an edge of a face, before any is divided.
    entries : int
        At so many places along an edge a face is entered, not from the top of its quadtree.
    entry : (k,) int32
        The cell there, which is a leaf if the quadtree ends above.
    children : (n,) int32
        First of the four children of a cell, NONE for a leaf. Cell ``i`` along u and ``j`` along v
        of face f has the number ``(f size + j) size + i``; child ``k`` lies on the upper side of u
        if k is odd, of v if it is 2 or 3.
    first, last : (n,) int64
        A leaf has the references ``first <= k < last``.
    cover : (n,) int32
        The item that covers a cell, NONE if none does.
    far : (n,) float64
        How far away that is at most; inf if there is none. Of what lies behind, nothing is listed.
    references : (m,) int32
        Places of items in the geometry.
    nearest : (m,) float64
        How far away each is at least.
    """

    size: int
    entries: int
    entry: np.ndarray
    children: np.ndarray
    first: np.ndarray
    last: np.ndarray
    cover: np.ndarray
    far: np.ndarray
    references: np.ndarray
    nearest: np.ndarray


NOT_DRAWN = np.zeros(0, np.int64)
"""Where drawn items begin, of structures without any (:mod:`.raster`)."""

OF_CELLS = ("children", "first", "last", "cover", "far")
OF_REFERENCES = ("references", "nearest")

ENTRIES = 32
"""Places along an edge at which the quadtree of a face is entered."""

NOWHERE = np.zeros(0, np.int32)
"""Entries of a face that is not finished yet."""


@inlined
def step_along(place, size):
    """Return the cell at a place, -1 to 1, among so many in a row, and the place within it."""
    x = 0.5 * (place + 1.0) * size
    # What lies on the border, or by a rounding beyond it, belongs to the last cell.
    cell = whole(min(max(x, 0.0), size - 1.0))
    return cell, x - cell


@inlined
def cell_at(lists, face, u, v):
    """Return the leaf at u, v of a face."""
    i, x = step_along(u, lists.entries)
    j, y = step_along(v, lists.entries)
    cell = whole(lists.entry[(face * lists.entries + j) * lists.entries + i])
    while lists.children[cell] >= 0:
        x, y = 2.0 * x, 2.0 * y
        is_right, is_upper = x >= 1.0, y >= 1.0
        cell = whole(lists.children[cell]) + is_right + 2 * is_upper
        x, y = x - is_right, y - is_upper
    return cell


def with_entries(lists: Lists, faces: int) -> Lists:
    """Return lists that know where their faces are entered."""
    entries = lists.size if lists.size > 1 else ENTRIES
    number = np.arange(faces * entries * entries)
    face, j, i = number // entries**2, number // entries % entries, number % entries
    if lists.size > 1:
        return lists._replace(entries=entries, entry=number.astype(np.int32))
    cell, half = face, entries // 2
    while half >= 1:
        child = lists.children[cell] + (i & half > 0) + 2 * (j & half > 0)
        cell = np.where(lists.children[cell] >= 0, child, cell)
        half //= 2
    return lists._replace(entries=entries, entry=cell.astype(np.int32))


class Squares(NamedTuple):
    """Where cells lie.

    Attributes
    ----------
    face : (n,) int64
    depth : (n,) int64
    parent : (n,) int64
        NONE for what was never part of a cell.
    u, v, width : (n,) float64
    """

    face: np.ndarray
    depth: np.ndarray
    parent: np.ndarray
    u: np.ndarray
    v: np.ndarray
    width: np.ndarray


def squares_of(lists: Lists, faces: Faces) -> Squares:
    """Return where all cells lie, from the first faces on down to the smallest."""
    count, size = len(lists.children), lists.size
    roots = len(faces.origins) * size * size
    number = np.arange(roots)
    face, parent = np.zeros(count, np.int64), np.full(count, NONE, np.int64)
    u, v, width = np.zeros(count), np.zeros(count), np.full(count, 2.0 / size)
    depth = np.zeros(count, np.int64)
    face[:roots] = number // (size * size)
    u[:roots] = -1.0 + (number % size) * (2.0 / size)
    v[:roots] = -1.0 + (number // size % size) * (2.0 / size)
    level = number
    while len(level := level[lists.children[level] >= 0]):
        children = lists.children[level][:, None] + np.arange(4)
        half = 0.5 * width[level][:, None]
        u[children] = u[level][:, None] + half * (np.arange(4) & 1)
        v[children] = v[level][:, None] + half * (np.arange(4) >> 1)
        width[children], face[children] = half, face[level][:, None]
        depth[children], parent[children] = depth[level][:, None] + 1, level[:, None]
        level = children.ravel()
    return Squares(face, depth, parent, u, v, width)
