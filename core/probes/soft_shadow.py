"""Soft shadows: the share of a light of some size that is seen from a point.

A shadow ray says of one point of a light whether it is hidden. A cone to a round light, a beam to a
polygonal one, says how much of it is: what lies in between is taken out of the light as it is seen
from the point, and what is left over is what shines. With the light itself as cross section, no
matter how it is turned, that is the share of its area, exactly.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984 (round lights). P. Heckbert, P. Hanrahan: Beam
Tracing Polygonal Objects, SIGGRAPH 1984 (beams from polygonal ones).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..geometry.cones import Spread
from ..geometry.rays import Rays
from ..geometry.solids.making import PLANAR
from ..geometry.triangulation import triangulate
from ..progress import SILENT, Progress
from ..scene import Light
from .beam import Beam, area_of, with_apex
from .coverage import UNIT_SQUARE, Covering, areas_in_circle
from .visible import MISS

BEGIN = 1e-9
"""Where a cone begins, in its length: its point lies on a surface, which is not in the way."""


EDGE_ON = 1e-12
"""Sine of the angle below which a light is seen edge-on."""


class Lamp(NamedTuple):
    """A flat light of some shape, in its own two axes; make it with :func:`lamp_of`.

    Attributes
    ----------
    middle : (3,) float64
        Where its axes cross.
    half_axes : (2, 3) float64
    parts : tuple of (k, 2) float64
        Convex polygons that it is made of, each once around counter-clockwise, in half-axes.
    is_round : bool
        Whether it is the unit circle in the square that is its only part.
    """

    middle: np.ndarray
    half_axes: np.ndarray
    parts: tuple[np.ndarray, ...]
    is_round: bool = False

    @property
    def area(self) -> float:
        """Its area, in half-axes."""
        return float(np.pi) if self.is_round else sum(area_of(part) for part in self.parts)

    @property
    def corners(self) -> np.ndarray:
        """The corners of its parts, (k, 3)."""
        corners: np.ndarray = self.middle + np.concatenate(self.parts) @ self.half_axes
        return corners


def lamp_of(light: Light | np.ndarray) -> Lamp:
    """Return an area light, or a polygon of light, for beams.

    Parameters
    ----------
    light : Light or (k, 3) float
        The corners of a flat polygon, once around; it may be hollow.

    Raises
    ------
    InputError
        If it has no area, or is no flat polygon.
    """
    if isinstance(light, Light):
        if light.half_axes is None:
            raise InputError(f"light {light.name or light.kind} has no area; choose an area light")
        half_axes, middle = np.asarray(light.half_axes, float), np.asarray(light.position, float)
        return Lamp(middle, half_axes, (UNIT_SQUARE,), light.is_round)
    corners = np.asarray(light, float)
    if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) < 3:
        raise InputError("a polygon of light is made of three corners or more, of x, y and z each")
    if not np.isfinite(corners).all():
        raise InputError("a corner of a polygon of light is not finite")
    middle = corners.mean(axis=0)
    seen = corners - middle
    normal = np.cross(seen, np.roll(seen, -1, axis=0)).sum(axis=0)
    size = float(np.linalg.norm(seen, axis=1).max())
    if not np.linalg.norm(normal) > 1e-12 * size * size:
        raise InputError("a polygon of light has no area; move its corners apart")
    normal /= np.linalg.norm(normal)
    if np.abs(seen @ normal).max() > PLANAR * size:
        raise InputError("a polygon of light is not flat; move its corners into one plane")
    wide = seen[np.linalg.norm(seen, axis=1).argmax()]
    wide = wide - (wide @ normal) * normal
    half_axes = np.array([wide, np.cross(normal, wide)])
    flat = seen @ half_axes.T / (wide @ wide)
    count = np.array([len(corners)])
    parts = [flat[each] for each in triangulate(corners, np.arange(len(corners)), count)]
    return Lamp(middle, half_axes, tuple(part for part in parts if area_of(part) > 0.0))


def light_beam(point: np.ndarray, lamp: Lamp) -> Beam | None:
    """Return the beam from a point to a light: its cross section is the light.

    None if the light is seen edge-on.
    """
    middle = lamp.middle - point
    wide, high = lamp.half_axes
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
    return Beam(with_apex(linear, point), lamp.parts, np.array(bounds))


def blockers(scene: Covering, point: np.ndarray, lamp: Lamp) -> np.ndarray:
    """Return the triangles that may hide some of a light from a point, (k,) int.

    Those that the round cone around the light meets, up to where the light ends.

    Raises
    ------
    InputError
        If the light reaches around the point, or the structure takes no cones.
    """
    corners, axis = lamp.corners - point, lamp.middle - point
    length = float(np.linalg.norm(axis))
    along = corners @ axis / length
    across = np.sqrt(np.maximum((corners**2).sum(axis=1) - along**2, 0.0))
    if not (along > 0.0).all():
        raise InputError("a light that reaches around a point is too large for a cone to it")
    spread = Spread(float(np.arctan((across / along).max())) * (1.0 + 1e-9))
    rays = Rays.from_arrays(point[None], axis[None], float(along.max()) / length)
    items: np.ndarray = scene.structure.cover(rays, 0, spread)[0]
    return items


def share_seen(scene: Covering, point: np.ndarray, light: Light | np.ndarray | Lamp) -> float:
    """Return the share of a light's area that is seen from a point, whichever way it shines.

    Parameters
    ----------
    light : Light, (k, 3) float or Lamp
        As :func:`lamp_of` takes it, or what that has made of it.

    Raises
    ------
    InputError
        If the light has no area, or reaches around the point, or the structure takes no cones, or
        something else than triangles is in the way.
    """
    lamp = light if isinstance(light, Lamp) else lamp_of(light)
    beam = light_beam(point, lamp)
    if beam is None:
        return 0.0
    items = blockers(scene, point, lamp)
    if not len(items):
        return 1.0
    pieces = scene.pieces(items, beam)
    areas = areas_in_circle(pieces) if lamp.is_round else pieces.areas
    free = float(areas[pieces.items == MISS].sum())
    return min(max(free / lamp.area, 0.0), 1.0)


def shares_seen(
    scene: Covering,
    points: np.ndarray,
    light: Light | np.ndarray | Lamp,
    progress: Progress = SILENT,
) -> np.ndarray:
    """Return the share of a light that is seen from each of some points, (n, 3) to (n,).

    Raises
    ------
    InputError
        As of :func:`share_seen`.
    Cancelled
        From `progress`.
    """
    lamp, shares = light if isinstance(light, Lamp) else lamp_of(light), np.empty(len(points))
    for n, point in enumerate(points):
        if n % 64 == 0:
            progress.report(n, len(points), "Asking how much of the light is seen")
        shares[n] = share_seen(scene, point, lamp)
    return shares
