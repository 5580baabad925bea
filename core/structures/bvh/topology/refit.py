"""Refit: triangles have moved, the tree stays, its volumes are fitted anew.

A fraction of the time of a build, since nothing is sorted or decided. But the tree was made for
where the triangles were: what was near then may be far apart now, and the volumes grow and overlap.
How far the cost rises above that of a new tree, :mod:`....evaluation.records.animation` measures.

Boxes go from the leaves up, each around its children: O(N). Volumes of other kinds are fitted to
all the triangles below, as by the build.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ....errors import InputError
from ....geometry.box import Boxes
from ....geometry.triangle import triangles_of
from ....geometry.volume import fit
from ....kernels import call, kernel
from ....progress import SILENT, Progress
from ....scene import Scene
from .fit import fit_all
from .tree import ranges_of

if TYPE_CHECKING:
    from ..hierarchy import BVH


@kernel
def refit_boxes(volumes, corners, first, size, width):
    """Fit the boxes of leaves to their triangles, those of inner nodes to their children."""
    for node in range(len(size) - 1, -1, -1):
        if size[node] > 0:
            fit(volumes, node, corners, first[node], first[node] + size[node])
            continue
        box = volumes.rows[node]
        for axis in range(3):
            low, high = np.inf, -np.inf
            for child in range(first[node], first[node] + width[node]):
                a, b = volumes.rows[child, axis], volumes.rows[child, 3 + axis]
                low = a if a < low else low
                high = b if b > high else high
            box[axis], box[3 + axis] = low, high


def refit(structure: BVH, scene: Scene, progress: Progress = SILENT) -> BVH:
    """Return a hierarchy with the tree of another one over a scene whose triangles have moved.

    Parameters
    ----------
    structure : BVH
        Stays as it is.
    scene : Scene
        The same triangles in the same order, elsewhere.

    Raises
    ------
    InputError
        If the triangles are not the same, or the tree cuts them into pieces.
    Cancelled
        From `progress`.
    """
    before = structure.scene
    if structure.parts is not None:
        raise InputError(
            f"a tree of {structure.settings.builder} cuts triangles into pieces, which cannot "
            "follow when they move; choose another builder"
        )
    if len(scene) != len(before) or not np.array_equal(scene.primitive_ids, before.primitive_ids):
        raise InputError(
            f"the tree was built over {len(before)} triangles, now there are {len(scene)}, or "
            "others were left out; a refit needs the same ones: build anew"
        )
    arrays, width = structure.arrays, structure.width()
    triangles = triangles_of(scene, structure.triangles.ids)
    progress.report(0, 1, "Refitting bvh")
    if isinstance(arrays.volumes, Boxes):
        volumes = Boxes(np.empty((len(arrays.size), 6)))
        # As by builders, around the scene's own corners: `triangles` draws those without an area
        # together to a point.
        corners = scene.triangles[triangles.ids]
        call(refit_boxes, volumes, corners, arrays.first, arrays.size, width)
    else:
        begin, end = ranges_of(arrays.first, arrays.size, width)
        kind = structure.settings.volume
        volumes = fit_all(kind, triangles.corners, begin, end, progress)
    moved = type(structure)(scene, structure.settings, arrays._replace(volumes=volumes), triangles)
    progress.report(1, 1, "Refitting bvh")
    return moved
