"""The path of one recorded ray as coloured line segments: the ray, and the cells it entered."""

from __future__ import annotations

import numpy as np

from ..core.geometry.rays import Rays
from ..core.scene import Scene
from ..core.structures.cells import Cells
from ..core.structures.steps import HIT, POSTPONE, TEST, VISIT_EMPTY, VISIT_INNER, VISIT_LEAF, Steps

HIT_COLOUR = (1.0, 0.85, 0.1, 1.0)
MISS_COLOUR = (0.6, 0.6, 0.6, 1.0)
INNER_COLOUR = (1.0, 1.0, 1.0, 0.35)
LEAF_COLOUR = (1.0, 0.45, 0.0, 0.9)
EMPTY_COLOUR = (0.2, 0.6, 1.0, 0.7)
TEST_COLOUR = (0.9, 0.3, 0.6, 0.9)
FOUND_COLOUR = (0.2, 1.0, 0.3, 1.0)

# Corners of a box as columns of [x0, y0, z0, x1, y1, z1], and its edges as pairs of corners.
_CORNERS = np.array([[x, y, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)])
_EDGES = np.array([(a, b) for a in range(8) for b in range(a) if (a ^ b).bit_count() == 1])


def segments_of(
    rays: Rays, index: int, t_hit: float, steps: Steps, cells: Cells, scene: Scene
) -> tuple[np.ndarray, np.ndarray]:
    """Return what to draw of a recorded ray.

    The ray up to its hit, or until it has left the scene; the edges of every cell it entered (inner
    nodes faint, empty leaves in another colour); the outlines of the triangles tested, and of the
    one that is hit.

    Parameters
    ----------
    t_hit : float
        Ray parameter of the hit, inf for a miss.

    Returns
    -------
    segments : (k, 2, 3) float64
    colours : (k, 4) float64
    """
    origin, direction = rays.origins[index], rays.directions[index]
    found = np.isfinite(t_hit)
    end = origin + direction * (t_hit if found else _until_outside(rays, index, scene))
    pieces = [np.array([[origin, end]])]
    colours = [HIT_COLOUR if found else MISS_COLOUR]

    place_of = np.full(int(cells.numbers.max()) + 1, -1)
    place_of[cells.numbers] = np.arange(len(cells))
    for kind, colour in (
        (VISIT_INNER, INNER_COLOUR),
        (VISIT_LEAF, LEAF_COLOUR),
        (VISIT_EMPTY, EMPTY_COLOUR),
    ):
        entered = np.unique(steps.cell[steps.kind == kind])
        boxes = cells.boxes[place_of[entered]]
        pieces.append(boxes[:, _CORNERS][:, _EDGES].reshape(-1, 2, 3))
        colours.append(colour)

    tested = np.unique(steps.primitive[steps.kind == TEST])
    last_hits = steps.primitive[(steps.kind == HIT) | (steps.kind == POSTPONE)][-1:]
    for primitives, colour in ((tested, TEST_COLOUR), (last_hits, FOUND_COLOUR)):
        corners = scene.triangles[primitives]
        pieces.append(corners[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2, 3))
        colours.append(colour)
    repeated = [np.tile(colour, (len(piece), 1)) for piece, colour in zip(pieces, colours)]
    return np.concatenate(pieces), np.concatenate(repeated)


def _until_outside(rays: Rays, index: int, scene: Scene) -> float:
    """Return a ray parameter at which a ray that hits nothing has left the scene, or its t_max."""
    direction = rays.directions[index]
    to_centre = 0.5 * (scene.lower + scene.upper) - rays.origins[index]
    length = np.linalg.norm(direction)
    nearest = max(float(to_centre @ direction) / length, 0.0)
    return min((nearest + 0.75 * scene.diagonal) / float(length), float(rays.t_max[index]))
