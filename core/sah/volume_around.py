"""One bounding volume around a whole scene, of any kind."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..geometry.fit import fit_all
from ..geometry.geometry import hulls_of
from ..progress import SILENT, Progress
from ..ranges import ranges
from ..scene import Scene


def volume_around(scene: Scene, kind: str, progress: Progress = SILENT) -> Any:
    """Return a volume of a kind around all items of a scene; of unions, halves along its length.

    The members of a union get halves of the items in their order. In that of the mesh a half may
    lie anywhere, so items are put in order along the longest side of the scene's box first.

    Parameters
    ----------
    kind : str
        As :mod:`..geometry.kinds` names it, combined ones too.

    Returns
    -------
    volumes : NamedTuple of arrays
        A list of one.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    corners, places = hulls_of(scene.geometry)
    progress.report(0, 2, "Fitting a volume")
    axis = int((scene.upper - scene.lower).argmax())
    counts = np.diff(places)
    middles = np.add.reduceat(corners[:, :, axis].mean(axis=1), places[:-1]) / counts
    order = np.argsort(middles, kind="stable")
    corners = corners[ranges(places[order], counts[order])]
    places = np.append(0, np.cumsum(counts[order]))
    progress.report(1, 2, "Fitting a volume")
    return fit_all(kind, corners, np.zeros(1, int), np.full(1, len(order)), progress, places)
