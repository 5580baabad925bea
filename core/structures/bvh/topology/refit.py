"""Refit: triangles have moved, the tree stays, its volumes are fitted anew.

A fraction of the time of a build, since nothing is sorted or decided. But the tree was made for
where the triangles were: what was near then may be far apart now, and the volumes grow and overlap.
How far the cost rises above that of a new tree, :mod:`....evaluation.records.animation` measures.

Boxes go from the leaves up, each around its children: O(N). Volumes of other kinds are fitted to
all the triangles below, as by the build.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....geometry.box import Boxes, clear, include
from ....geometry.fit import fit_all
from ....kernels import call, kernel
from ....progress import SILENT, Progress
from .pieces import referred
from .tree import ranges_of


@kernel
def refit_boxes(volumes, boxes, first, size, width):
    """Fit the boxes of leaves to those of their items, those of inner nodes to their children."""
    for node in range(len(size) - 1, -1, -1):
        box = volumes.rows[node]
        if size[node] > 0:
            clear(box)
            for i in range(first[node], first[node] + size[node]):
                include(box, boxes[i])
            continue
        for axis in range(3):
            low, high = np.inf, -np.inf
            for child in range(first[node], first[node] + width[node]):
                a, b = volumes.rows[child, axis], volumes.rows[child, 3 + axis]
                low = a if a < low else low
                high = b if b > high else high
            box[axis], box[3 + axis] = low, high


def refitted_volumes(
    arrays: Any,
    width: np.ndarray,
    kind: str,
    items: Any,
    boxes: np.ndarray,
    progress: Progress = SILENT,
) -> Any:
    """Return the volumes of a tree, fitted to where its triangles are now.

    Parameters
    ----------
    arrays : Binary or Wide
        The tree with the volumes that it had.
    width : (n_nodes,) int
        How many children every node has.
    kind : str
        Of volumes, if they are not boxes.
    items : NamedTuple of arrays
        The geometry, moved, in the order of the references.
    boxes : (n, 6) float64
        Of the scene's items: `items` may draw triangles without an area together to a point, and
        boxes are fitted as by builders.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    progress.report(0, 1, "Refitting bvh")
    if isinstance(arrays.volumes, Boxes):
        volumes = Boxes(np.empty((len(arrays.size), 6)))
        in_order = boxes[items.ids]
        call(refit_boxes, volumes, in_order, arrays.first, arrays.size, width)
        volumes = Boxes.of(volumes.rows, items)
    else:
        begin, end = ranges_of(arrays.first, arrays.size, width)
        volumes = fit_all(kind, *referred(items, None, begin, end, progress), progress)
    progress.report(1, 1, "Refitting bvh")
    return volumes
