"""The directional cube: six faces around a point, through which every direction goes.

A face is a square, ``-1 <= u, v <= 1``. A direction d goes through that of its largest component,
at u and v: the other two, divided by it (Haines and Greenberg 1986). In matrices: a point p has
the coordinates ``a = A (p - o)`` of a face, is seen through it if ``a_w > 0``, and that at
``u = a_u / a_w``, ``v = a_v / a_w``. Of a cube the rows of A are axes.

The picture of a camera is such a face, too, with the eye in the place of the cube's centre. The
plane before a sun is one whose rays are parallel: there u and v are a_u and a_v themselves.

E. Haines, D. Greenberg: The Light Buffer: A Shadow-Testing Accelerator, IEEE CG&A 6(9), 1986.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...kernels import inlined, inner
from ...scene import ORTHOGRAPHIC, Camera
from ...scene.camera_rays import camera_axes, window_of

BEYOND = 1.0 / 64.0
"""How far beyond its border what lies in a face is still known, in u and v."""


class Faces(NamedTuple):
    """Faces as the kernels see them.

    Attributes
    ----------
    origins : (m, 3) float64
        The centre of the cube, the eye of a camera; of parallel rays any point of the plane.
    axes : (m, 3, 3) float64
        Rows u, v and w of A; w is a unit vector.
    back : (m, 3, 3) float64
        Rows: a point seen at u, v at depth a_w = 1 is ``u back[0] + v back[1] + back[2]``, from o.
    is_parallel : (m,) uint8
    scale : (m,) float64
        How much u and v can change, times the depth, where a point is moved by 1.
    spread : (m,) float64
        How far the corners are away at depth 1.
    """

    origins: np.ndarray
    axes: np.ndarray
    back: np.ndarray
    is_parallel: np.ndarray
    scale: np.ndarray
    spread: np.ndarray


def faces_of(origins: np.ndarray, axes: np.ndarray, is_parallel: np.ndarray) -> Faces:
    """Return faces with all that follows from their rows."""
    axes = np.ascontiguousarray(axes, dtype=np.float64)
    across = np.linalg.norm(axes[:, :2], axis=2).max(axis=1)
    back = np.ascontiguousarray(np.linalg.inv(axes).transpose(0, 2, 1))
    signs = (1.0 + BEYOND) * np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
    corners = np.einsum("kc,mcx->mkx", signs, back[:, :2]) + back[:, None, 2]
    return Faces(
        np.ascontiguousarray(origins, dtype=np.float64),
        axes,
        back,
        np.asarray(is_parallel, np.uint8),
        np.where(is_parallel, across, across + (1.0 + BEYOND)),
        np.linalg.norm(corners, axis=2).max(axis=1),
    )


def cube(origin: np.ndarray) -> Faces:
    """Return the six faces around a point: towards +x, -x, +y, -y, +z, -z.

    u is along the axis that follows in x, y, z, x, v along the one after that.
    """
    axes = np.zeros((6, 3, 3))
    for face in range(6):
        axis, is_negative = divmod(face, 2)
        axes[face, 0, (axis + 1) % 3] = 1.0
        axes[face, 1, (axis + 2) % 3] = 1.0
        axes[face, 2, axis] = -1.0 if is_negative else 1.0
    return faces_of(np.tile(np.asarray(origin, float), (6, 1)), axes, np.zeros(6, bool))


def plane_before_sun(direction: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Faces:
    """Return the face across the rays of a sun that shines along a direction, around a box."""
    w = np.asarray(direction, float)
    w = w / np.linalg.norm(w)
    u = np.zeros(3)
    u[np.abs(w).argmin()] = 1.0
    u -= (u @ w) * w
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    centre, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    # The shadow of the box, and some more.
    widths = np.array([np.abs(u) @ half, np.abs(v) @ half]) + 1e-3 * np.linalg.norm(half)
    axes = np.stack([u / widths[0], v / widths[1], w])
    return faces_of(centre[None], axes[None], np.ones(1, bool))


def picture_of(camera: Camera, width: int, height: int) -> Faces:
    """Return the picture of a camera, of `width` by `height` pixels, as a face: u right, v up.

    Raises
    ------
    InputError
        If the camera looks along its own up direction.
    """
    forward, right, up = camera_axes(camera)
    window = window_of(camera, width, height)
    is_parallel = camera.kind == ORTHOGRAPHIC
    # Right and up need not be at right angles; forward is at right angles to both in any case.
    columns = np.stack([right * window.half_width, up * window.half_height, forward], axis=1)
    axes = np.linalg.inv(columns)
    origin = np.asarray(camera.position, float)
    middle = np.array([window.x / window.half_width, window.y / window.half_height])
    if is_parallel:
        origin = origin + window.x * right + window.y * up
    else:
        axes[:2] -= middle[:, None] * axes[2]
    return faces_of(origin[None], axes[None], np.array([is_parallel]))


def joined_faces(parts: Sequence[Faces]) -> Faces:
    """Return the faces of several, one after the other."""
    return Faces(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def solid_angles(u0: np.ndarray, v0: np.ndarray, u1: np.ndarray, v1: np.ndarray) -> np.ndarray:
    """Return the solid angles of rectangles of faces of cubes, (n,)."""
    angle = _from_middle(u1, v1) - _from_middle(u0, v1)
    angle += _from_middle(u0, v0) - _from_middle(u1, v0)
    return angle


def _from_middle(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the solid angle of the rectangle from the middle of a face to u, v."""
    angle: np.ndarray = np.arctan2(u * v, np.sqrt(1.0 + u * u + v * v))
    return angle


@inlined
def face_towards(first, dx, dy, dz):
    """Return the face of a cube, whose first face is given, that a direction goes through."""
    x, y, z = abs(dx), abs(dy), abs(dz)
    if x >= y and x >= z:
        return first + (dx < 0.0)
    if y >= z:
        return first + 2 + (dy < 0.0)
    return first + 4 + (dz < 0.0)


@inner
def in_face(faces, face, x, y, z):
    """Return the coordinates a_u, a_v, a_w of a vector."""
    a = faces.axes[face]
    return (
        a[0, 0] * x + a[0, 1] * y + a[0, 2] * z,
        a[1, 0] * x + a[1, 1] * y + a[1, 2] * z,
        a[2, 0] * x + a[2, 1] * y + a[2, 2] * z,
    )


@inner
def out_of_face(b, u, v):
    """Return the vector from the origin of a face, whose `back` is given, to u, v at depth 1."""
    return (
        u * b[0, 0] + v * b[1, 0] + b[2, 0],
        u * b[0, 1] + v * b[1, 1] + b[2, 1],
        u * b[0, 2] + v * b[1, 2] + b[2, 2],
    )
