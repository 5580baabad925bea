"""Soft shadows: the share of a light of some size that is seen from a point.

A shadow ray says of one point of a light whether it is hidden. A cone to a round light, a beam to a
rectangular one, says how much of it is: what lies in between is taken out of the light as it is
seen from the point, and what is left over is what shines. With the light itself as cross section,
no matter how it is turned, that is the share of its area, exactly.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984 (round lights). P. Heckbert, P. Hanrahan: Beam
Tracing Polygonal Objects, SIGGRAPH 1984 (beams from polygonal ones).
"""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..geometry.cones import Spread
from ..geometry.rays import Rays
from ..progress import SILENT, Progress
from ..scene import Light
from .beam import Beam, with_apex
from .coverage import UNIT_SQUARE, Covering, areas_in_circle
from .visible import MISS

BEGIN = 1e-9
"""Where a cone begins, in its length: its point lies on a surface, which is not in the way."""


EDGE_ON = 1e-12
"""Sine of the angle below which a light is seen edge-on."""


def light_beam(point: np.ndarray, light: Light) -> Beam | None:
    """Return the beam from a point to an area light: its cross section is the light.

    None if the light is seen edge-on.

    The light's rectangle is the square of side 2, a round light the circle in it.

    Raises
    ------
    InputError
        If the light has no area.
    """
    if light.half_axes is None:
        raise InputError(f"light {light.name or light.kind} has no area; choose an area light")
    middle = np.asarray(light.position, float) - point
    wide, high = np.asarray(light.half_axes, float)
    normal = np.cross(wide, high)
    normal /= np.linalg.norm(normal)
    reach = float(normal @ middle)
    if abs(reach) <= EDGE_ON * np.linalg.norm(middle):
        return None
    # In the light's own axes: a point of its plane is the middle, some of one and of the other.
    linear = np.linalg.inv(np.column_stack([wide, high, middle]))
    side, reach = (normal, reach) if reach > 0.0 else (-normal, -reach)
    bounds = [
        np.append(side, side @ point + BEGIN * reach),
        np.append(-side, -(side @ point + (1.0 - BEGIN) * reach)),
    ]
    return Beam(with_apex(linear, point), (UNIT_SQUARE,), np.array(bounds))


def blockers(scene: Covering, point: np.ndarray, light: Light) -> np.ndarray:
    """Return the triangles that may hide some of an area light from a point, (k,) int.

    Those that the round cone around the light meets, up to where the light ends.

    Raises
    ------
    InputError
        If the light reaches around the point, or the structure takes no cones.
    """
    corners = light.position + UNIT_SQUARE @ np.asarray(light.half_axes, float) - point
    axis = light.position - point
    length = float(np.linalg.norm(axis))
    along = corners @ axis / length
    across = np.sqrt(np.maximum((corners**2).sum(axis=1) - along**2, 0.0))
    if not (along > 0.0).all():
        raise InputError("a light that reaches around a point is too large for a cone to it")
    spread = Spread(float(np.arctan((across / along).max())) * (1.0 + 1e-9))
    rays = Rays.from_arrays(point[None], axis[None], float(along.max()) / length)
    items: np.ndarray = scene.structure.cover(rays, 0, spread)[0]
    return items


def share_seen(scene: Covering, point: np.ndarray, light: Light) -> float:
    """Return the share of an area light that is seen from a point, whichever way it shines.

    Raises
    ------
    InputError
        If the light has no area, or reaches around the point, or the structure takes no cones.
    """
    beam = light_beam(point, light)
    if beam is None:
        return 0.0
    items = blockers(scene, point, light)
    if not len(items):
        return 1.0
    pieces = scene.pieces(items, beam)
    areas = areas_in_circle(pieces) if light.is_round else pieces.areas
    free = float(areas[pieces.items == MISS].sum())
    return min(max(free / (np.pi if light.is_round else 4.0), 0.0), 1.0)


def shares_seen(
    scene: Covering, points: np.ndarray, light: Light, progress: Progress = SILENT
) -> np.ndarray:
    """Return the share of an area light that is seen from each of some points, (n, 3) to (n,).

    Raises
    ------
    InputError
        As of :func:`share_seen`.
    Cancelled
        From `progress`.
    """
    shares = np.empty(len(points))
    for n, point in enumerate(points):
        if n % 64 == 0:
            progress.report(n, len(points), "Asking how much of the light is seen")
        shares[n] = share_seen(scene, point, light)
    return shares
