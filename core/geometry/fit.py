"""Volumes of any kind are fitted to a tree that is there already: any builder, any volume.

Every node gets a volume around all triangles below it, not around the volumes of its children:
that is tighter. Boxes and k-DOPs of parents contain those of their children even so; a sphere or an
oriented box contains the triangles of its children but not their volumes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernels import call, kernel
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from .kinds import make
from .volume import fit, outside


@kernel
def fit_range(volumes, corners, begin, end, first, last):
    """Fit the volumes of the nodes ``first <= node < last``."""
    for node in range(first, last):
        fit(volumes, node, corners, begin[node], end[node])


def fit_all(
    kind: str, corners: np.ndarray, begin: np.ndarray, end: np.ndarray, progress: Progress
) -> Any:
    """Return volumes, one around each range of triangles.

    Parameters
    ----------
    kind : str
        A key of :mod:`.geometry.kinds`.
    corners : (m, 3, 3) float64
    begin, end : (n,) int64

    Raises
    ------
    Cancelled
        From `progress`.
    """
    volumes = make(kind, len(begin))

    def work(first: int, last: int) -> None:
        call(fit_range, volumes, corners, begin, end, first, last)

    for_chunks(work, len(begin), 0, progress, "Fitting volumes")
    return volumes


@kernel
def mark_outsiders(volumes, corners, begin, end, tolerance, sticks_out, first, last):
    """Mark the nodes ``first <= node < last`` of which some triangle sticks out."""
    for node in range(first, last):
        sticks_out[node] = False
        for i in range(begin[node], end[node]):
            for k in range(3):
                x, y, z = corners[i, k, 0], corners[i, k, 1], corners[i, k, 2]
                if not (outside(volumes, node, x, y, z) <= tolerance):
                    sticks_out[node] = True


def sticking_out(
    volumes: Any, corners: np.ndarray, begin: np.ndarray, end: np.ndarray
) -> np.ndarray:
    """Return the nodes of whose triangles one is not inside the node's volume.

    Further than the distance itself is rounded; rays are tested with far more slack.
    """
    tolerance = 8 * np.finfo(np.float64).eps * float(np.abs(corners).max())
    marks = np.empty(len(begin), dtype=bool)

    def work(first: int, last: int) -> None:
        call(mark_outsiders, volumes, corners, begin, end, tolerance, marks, first, last)

    for_chunks(work, len(begin), 0, SILENT, "Checking volumes")
    return np.flatnonzero(marks)
