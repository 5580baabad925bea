"""Beams: an apex, and a polygonal cross section through which it looks.

A beam has a space of its own: the apex is the origin, the cross section lies in the plane z = 1. An
affine map leads there from the scene, and that is all that a mirror changes. What is seen in it is
the scene mirrored, so the beam that goes on from it is the one that came, its map preceded by that
of the mirror, and its cross section the pieces in which the mirror is seen. In the scene, it comes
from the mirrored apex and begins at the mirror; that is exact.

Refraction at a plane is not affine: rays from one point do not seem to come from one point any
more. Heckbert and Hanrahan take the nearest map that is: what lies behind the surface is moved
along its normal so that one ray, here the one through the middle of what is seen of the surface, is
refracted as Snell's law has it. All others are so **approximately**: the error grows with the angle
between them and that ray.

P. Heckbert, P. Hanrahan: Beam Tracing Polygonal Objects, SIGGRAPH 1984.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from ..scene import PERSPECTIVE, Camera
from ..scene.camera_rays import camera_axes, window_of

EYE, MIRRORED, REFRACTED = "eye", "mirrored", "refracted"

EVERYWHERE = np.empty((0, 4))


@dataclass(frozen=True)
class Beam:
    """One beam.

    Attributes
    ----------
    matrix : (3, 4) float64
        From the scene to the beam's space: a linear part and a translation.
    windows : tuple of (k, 2) float64
        The cross section in convex parts, each once around, without common inner points.
    bounds : (k, 4) float64
        Half-spaces in which it is: of each a unit normal n and a position c, for n p > c. So it
        begins at the surface that it has come from; with none of them, at its apex.
    """

    matrix: np.ndarray
    windows: tuple[np.ndarray, ...]
    bounds: np.ndarray = field(default_factory=EVERYWHERE.copy)

    @property
    def apex(self) -> np.ndarray:
        """Where it comes from, (3,), in the scene."""
        return -np.linalg.solve(self.matrix[:, :3], self.matrix[:, 3])

    @property
    def area(self) -> float:
        """Area of the cross section."""
        return float(sum(area_of(window) for window in self.windows))

    def directions(self, points: np.ndarray) -> np.ndarray:
        """Return where points of the cross section, (n, 2), lie from the apex, in the scene."""
        there = np.column_stack([points, np.ones(len(points))])
        return np.linalg.solve(self.matrix[:, :3], there.T).T

    def plane_seen(self, plane: np.ndarray) -> np.ndarray:
        """Return planes of the scene, (..., 4), in the beam's space, positions multiplied alike."""
        linear, moved = self.matrix[:, :3], self.matrix[:, 3]
        # Cofactors: so that a plane's corners run about its normal as before, mirrored or not.
        a, b, c = linear
        cofactors = np.array([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
        normals = plane[..., :3] @ cofactors.T
        positions = plane[..., 3] * np.linalg.det(linear) + normals @ moved
        return np.concatenate([normals, positions[..., None]], axis=-1)

    def on_plane(self, points: np.ndarray, plane: np.ndarray) -> np.ndarray:
        """Return where a plane of the scene, (4,), is seen through the cross section, (n, 3)."""
        apex, directions = self.apex, self.directions(points)
        height = plane[3] - plane[:3] @ apex
        return apex + directions * (height / (directions @ plane[:3]))[:, None]


def area_of(polygon: np.ndarray) -> float:
    """Return the area of a flat polygon, (k, 2); negative if it runs clockwise."""
    x, y = (polygon - polygon[0]).T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def camera_beam(camera: Camera, width: int, height: int) -> Beam:
    """Return the beam of a whole picture: its cross section is the camera's window.

    The points of the cross section are those of the window, see :func:`..scene.camera_rays`: x runs
    to the right, y up, the view direction is z.

    Raises
    ------
    InputError
        If the camera has no apex, or no axes.
    """
    if camera.kind != PERSPECTIVE:
        raise InputError(
            f"a beam has an apex, which the {camera.kind} camera has not; choose a perspective one"
        )
    forward, right, up = camera_axes(camera)
    window = window_of(camera, width, height)
    signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    corners = (window.x, window.y) + signs * (window.half_width, window.half_height)
    # Coordinates to the right and up, also where these are not at right angles.
    linear = np.linalg.inv(np.column_stack([right, up, forward]))
    return Beam(with_apex(linear, np.asarray(camera.position, float)), (corners,))


def beam_through(apex: np.ndarray, corners: np.ndarray) -> Beam:
    """Return the beam from an apex through a convex polygon, (k, 3), such as a light.

    Raises
    ------
    InputError
        If the polygon has no area as seen from there, or some of it lies behind the apex.
    """
    rays = corners - apex
    towards = rays.mean(axis=0)
    length = np.linalg.norm(towards)
    beside = np.eye(3)[np.abs(towards).argmin()]
    right = np.cross(towards, beside)
    if not length > 0.0 or not (rays @ towards > 0.0).all():
        raise InputError("a beam needs a polygon that lies wholly on one side of its apex")
    forward, right = towards / length, right / np.linalg.norm(right)
    linear = np.array([right, np.cross(forward, right), forward])
    x, y, z = linear @ rays.T
    window = np.column_stack([x / z, y / z])
    area = area_of(window)
    if abs(area) < 1e-18:
        raise InputError("a beam needs a polygon that is not seen edge-on")
    return Beam(with_apex(linear, apex), (window if area > 0.0 else window[::-1],))


def with_apex(linear: np.ndarray, apex: np.ndarray) -> np.ndarray:
    """Return the map, (3, 4), that is linear but for taking the apex to the origin."""
    return np.column_stack([linear, -(linear @ apex)])


def preceded(matrix: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return the map that does `first` and then `matrix`, (3, 4) each."""
    return np.column_stack(
        [matrix[:, :3] @ first[:, :3], matrix[:, :3] @ first[:, 3] + matrix[:, 3]]
    )


def scaled_along(plane: np.ndarray, factor: float) -> np.ndarray:
    """Return the map, (3, 4), that moves points along a plane's normal; -1 mirrors them.

    Parameters
    ----------
    plane : (4,) float64
        Unit normal and position along it.
    factor : float
        What a point's height above the plane is multiplied by.
    """
    normal, position = plane[:3], plane[3]
    linear = np.eye(3) + (factor - 1.0) * np.outer(normal, normal)
    return np.column_stack([linear, -(factor - 1.0) * position * normal])


def mirrored_beam(beam: Beam, plane: np.ndarray, windows: tuple[np.ndarray, ...]) -> Beam:
    """Return the beam that goes on from a planar mirror; exact.

    Parameters
    ----------
    plane : (4,) float64
        Of the mirror: unit normal and position along it.
    windows : tuple of (k, 2) float64
        The pieces of the cross section in which the mirror is seen.
    """
    return Beam(
        preceded(beam.matrix, scaled_along(plane, -1.0)), windows, side_of(beam, plane)[None]
    )


def side_of(beam: Beam, plane: np.ndarray) -> np.ndarray:
    """Return the half-space, (4,), before a plane, where a beam comes from."""
    return plane if plane[:3] @ beam.apex > plane[3] else -plane


def refracted_beam(
    beam: Beam, plane: np.ndarray, windows: tuple[np.ndarray, ...], ratio: float
) -> Beam | None:
    """Return the beam that goes on through a plane, linearly approximated; None if none does.

    Parameters
    ----------
    plane, windows
        As of :func:`mirrored_beam`.
    ratio : float
        The index of refraction of where the beam comes from, over that of where it goes to.
    """
    areas = np.array([abs(area_of(window)) for window in windows])
    middles = np.array([window.mean(axis=0) for window in windows])
    middle = (areas @ middles) / areas.sum()
    direction = beam.directions(middle[None])[0]
    cosine = abs(plane[:3] @ direction) / np.linalg.norm(direction)
    beyond = 1.0 - ratio * ratio * (1.0 - cosine * cosine)  # cosine of the other angle, squared
    if not beyond > 0.0:
        return None  # total reflection
    # Of depths, tan(theta_2) / tan(theta_1): with sin(theta_2) = ratio sin(theta_1).
    factor = ratio * cosine / np.sqrt(beyond)
    matrix = preceded(beam.matrix, scaled_along(plane, float(factor)))
    return Beam(matrix, windows, -side_of(beam, plane)[None])
