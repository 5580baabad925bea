"""Volumes of any kind are fitted to a tree that is there already: any builder, any volume.

Every node gets a volume around all triangles below it, not around the volumes of its children:
that is tighter. Boxes and k-DOPs of parents contain those of their children even so; a sphere or an
oriented box contains the triangles of its children but not their volumes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...geometry.kinds import KINDS
from ...geometry.volume import fit
from ...kernels import call, kernel
from ...parallel import for_chunks
from ...progress import Progress


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
        One of KINDS.
    corners : (m, 3, 3) float64
    begin, end : (n,) int64

    Raises
    ------
    Cancelled
        From `progress`.
    """
    volumes = KINDS[kind][1](len(begin))

    def work(first: int, last: int) -> None:
        call(fit_range, volumes, corners, begin, end, first, last)

    for_chunks(work, len(begin), 0, progress, "Fitting volumes")
    return volumes
