"""Cameras: the rays of a picture, perspective or orthographic."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..geometry.rays import Rays
from . import ORTHOGRAPHIC, PERSPECTIVE, Camera, Scene

PRIMARY, SHADOW = CLASS_NAMES = ("primary", "shadow")
"""What the rays of a camera are for."""

REFLECTED, REFRACTED, AMBIENT = "reflected", "refracted", "ambient"
"""What the rays are for that go on from their hits, beside shadow rays."""


def framing_camera(scene: Scene, aspect: float, fov: float = 45.0) -> Camera:
    """Return a camera that looks down on the whole scene from the front right.

    Parameters
    ----------
    aspect : float
        Width of the picture over its height.
    """
    centre = 0.5 * (scene.lower + scene.upper)
    direction = np.array([0.55, -0.75, 0.42])
    direction /= np.linalg.norm(direction)
    # The bounding sphere fills the smaller side.
    half = np.arctan(np.tan(np.radians(fov) / 2) * min(aspect, 1 / aspect))
    distance = 0.5 * scene.diagonal / np.sin(half)
    return Camera(centre + direction * distance, centre, np.array([0.0, 0.0, 1.0]), fov)


def camera_axes(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit vectors forward, right and up of a camera, each (3,).

    Raises
    ------
    InputError
        If it looks along its own up direction, or at its own position.
    """
    forward = np.asarray(camera.target, float) - camera.position
    length = np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    if not length > 0.0 or not np.linalg.norm(right) > 1e-9 * length * np.linalg.norm(camera.up):
        raise InputError("the camera looks along its up direction; choose another 'up'")
    forward = forward / length
    if camera.right is not None:
        return forward, *(axis / np.linalg.norm(axis) for axis in (camera.right, camera.up))
    right = right / np.linalg.norm(right)
    return forward, right, np.cross(right, forward)


class Window(NamedTuple):
    """Where the picture lies in the plane one unit before the camera, to the right and up.

    Of an orthographic camera the plane may be any.
    """

    x: float
    y: float
    half_width: float
    half_height: float


def window_of(camera: Camera, width: float, height: float) -> Window:
    """Return the window of a picture of `width` by `height` pixels."""
    across, above = width * camera.pixel_aspect, height  # the sides in heights of a pixel
    fitted = {"larger": max(across, above), "width": across, "height": above}[camera.fit]
    if camera.kind == ORTHOGRAPHIC:
        half = 0.5 * camera.scale
    else:
        half = float(np.tan(np.radians(camera.fov) / 2))
    x, y = (2.0 * half * shift for shift in camera.shift)
    return Window(x, y, half * across / fitted, half * above / fitted)


def camera_rays(
    camera: Camera,
    width: int,
    height: int,
    corner: bool = False,
    chosen: np.ndarray | None = None,
) -> Rays:
    """Return primary rays, (width * height), row by row from the top left.

    With `corner`, n rays in a row lie at x = -1 + 2 i / (n - 1), else at -1 + (2 i + 1) / n.
    Directions have component 1 along the view direction. Rays of a perspective camera start where
    it stands, those of an orthographic one in the plane through that place; none of them ends.

    Parameters
    ----------
    chosen : (n,) int, optional
        Numbers of the rays that are wanted; without it, all.

    Raises
    ------
    InputError
        If the camera is of another kind, which it names.
    """
    if not camera.has_rays:
        raise InputError(
            f"no rays can be made of the scene's camera '{camera.name}', which is {camera.kind}; "
            "make it perspective or orthographic, choose another, or set From and At of the rays",
            camera.name,
        )
    forward, right, up = camera_axes(camera)

    def places(n: int) -> np.ndarray:
        if corner and n > 1:
            return -1.0 + 2.0 * np.arange(n) / (n - 1)
        return -1.0 + (2.0 * np.arange(n) + 1.0) / n

    window = window_of(camera, width, height)
    x = window.x + window.half_width * places(width)
    y = window.y - window.half_height * places(height)
    middle = forward if camera.kind == PERSPECTIVE else np.asarray(camera.position, float)
    if chosen is None:
        spread = middle + x[None, :, None] * right + y[:, None, None] * up
        spread = spread.reshape(-1, 3)
    else:
        rows, columns = np.divmod(chosen, width)
        spread = middle + x[columns, None] * right + y[rows, None] * up
    if camera.kind == PERSPECTIVE:
        origins, directions = np.broadcast_to(camera.position, spread.shape), spread
    else:
        origins, directions = spread, np.broadcast_to(forward, spread.shape)
    pixels = np.arange(len(directions)) if chosen is None else chosen
    return Rays.from_arrays(origins, directions, class_names=CLASS_NAMES, pixels=pixels)
