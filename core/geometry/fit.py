"""Volumes of any kind are fitted to a tree that is there already: any builder, any volume.

Every node gets a volume around all triangles below it, not around the volumes of its children:
that is tighter. Boxes and k-DOPs of parents contain those of their children even so; a sphere or an
oriented box contains the triangles of its children but not their volumes.

The members of a union get a half of the items each. Triangles that stand for the hull of one item,
of something round or moving, go to one member together: it may be anywhere between them, and two
halves of a hull do not contain what is between the halves.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernels import call, kernel
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from ..ranges import ranges
from .combined import Union
from .kinds import make
from .volume import fit, outside


@kernel
def fit_range(volumes, corners, begin, end, first, last):
    """Fit the volumes of the nodes ``first <= node < last``."""
    for node in range(first, last):
        fit(volumes, node, corners, begin[node], end[node])


def fit_all(
    kind: str,
    corners: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    progress: Progress,
    places: np.ndarray | None = None,
) -> Any:
    """Return volumes, one around each range of items.

    Parameters
    ----------
    kind : str
        A key of :mod:`.geometry.kinds`.
    corners : (m, 3, 3) float64
        Of triangles.
    begin, end : (n,) int64
        Ranges of items.
    places : (k + 1,) int64, optional
        Which triangles are the hull of each item, as ``hulls_of`` returns it; by default each is an
        item.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    volumes = make(kind, len(begin))
    fit_members(volumes, corners, begin, end, progress, places)
    return volumes


def fit_members(
    volumes: Any,
    corners: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    progress: Progress,
    places: np.ndarray | None,
) -> None:
    """Fit volumes to ranges of items; of unions each member to a half, both to a single item."""
    if isinstance(volumes, Union):
        middle = (begin + end) // 2
        first_end = np.maximum(middle, begin + 1)
        fit_members(volumes.first, corners, begin, first_end, progress, places)
        fit_members(volumes.second, corners, middle, end, progress, places)
        return
    if places is not None:
        begin, end = places[begin], places[end]

    def work(first: int, last: int) -> None:
        call(fit_range, volumes, corners, begin, end, first, last)

    for_chunks(work, len(begin), 0, progress, "Fitting volumes")


@kernel
def mark_outsiders(volumes, corners, nodes, begin, end, tolerance, sticks_out, first, last):
    """Mark the pairs ``first <= pair < last`` of which some triangle sticks out of the volume."""
    for pair in range(first, last):
        sticks_out[pair] = False
        for i in range(begin[pair], end[pair]):
            for k in range(3):
                x, y, z = corners[i, k, 0], corners[i, k, 1], corners[i, k, 2]
                if not (outside(volumes, nodes[pair], x, y, z) <= tolerance):
                    sticks_out[pair] = True


def sticking_out(
    volumes: Any,
    corners: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    places: np.ndarray | None = None,
) -> np.ndarray:
    """Return the nodes of whose items one is not inside the node's volume, ascending.

    Further than the distance itself is rounded; rays are tested with far more slack. Inside a union
    is what is inside one member, with all of its hull. Parameters as of :func:`fit_all`.
    """
    nodes = np.arange(len(begin))
    if isinstance(volumes, Union):  # one by one: each item has to be in one member
        counts = end - begin
        nodes, begin = np.repeat(nodes, counts), ranges(begin, counts)
        end = begin + 1
    if places is not None:
        begin, end = places[begin], places[end]
    tolerance = 8 * np.finfo(np.float64).eps * float(np.abs(corners).max())
    return np.unique(nodes[are_outside(volumes, corners, nodes, begin, end, tolerance)])


def are_outside(
    volumes: Any,
    corners: np.ndarray,
    nodes: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Say of nodes and ranges of triangles, (k,) int each, whether one of these sticks out."""
    if isinstance(volumes, Union):
        rest = are_outside(volumes.first, corners, nodes, begin, end, tolerance)
        rest[rest] = are_outside(
            volumes.second, corners, nodes[rest], begin[rest], end[rest], tolerance
        )
        return rest
    marks = np.empty(len(nodes), dtype=bool)

    def work(first: int, last: int) -> None:
        call(mark_outsiders, volumes, corners, nodes, begin, end, tolerance, marks, first, last)

    for_chunks(work, len(nodes), 0, SILENT, "Checking volumes")
    return marks
