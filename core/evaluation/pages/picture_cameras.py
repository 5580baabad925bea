"""Where pictures of a scene are seen from."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...geometry.box_shape import corners_of
from ...scene import ORTHOGRAPHIC, Camera, Scene
from ...scene.camera_rays import camera_axes, framing_camera, window_of

WIDTH, HEIGHT = 960, 720

Slopes = tuple[tuple[float, float], tuple[float, float]]

MARGIN = 0.94
"""Share of the picture that what it frames takes at most."""


def picture_camera(scene: Scene) -> Camera:
    """Return the scene's own camera, or one that frames the scene; both fill the lower side.

    Own cameras often belong to square pictures: their angle of view is that of the height here,
    so that nothing they show is cut off. Pictures are not mirrored and have square pixels, and
    where the scene's own camera is of a kind that has no rays, they are seen by one that frames it.
    """
    own = own_camera(scene)
    if own is None:
        return framing_camera(scene, WIDTH / HEIGHT)
    return dataclasses.replace(own, fit="height", pixel_aspect=1.0, right=None)


def own_camera(scene: Scene) -> Camera | None:
    """Return the scene's own camera, if it is one that pictures can be seen by."""
    return scene.camera if scene.camera and scene.camera.has_rays else None


def camera_around(camera: Camera, points: np.ndarray) -> Camera:
    """Return a camera that looks the same way, from where it just sees all points.

    Parameters
    ----------
    camera : Camera
        Of a picture as wide as WIDTH by HEIGHT.
    points : (n, 3) float64
        At least one.
    """
    forward, right, up = camera_axes(camera)
    axes = np.stack([right, up, forward])
    window = window_of(camera, WIDTH, HEIGHT)
    wide, high = MARGIN * window.half_width, MARGIN * window.half_height
    seen, scale = points @ axes.T, camera.scale
    if camera.kind == ORTHOGRAPHIC:
        low, size = seen.min(axis=0), np.ptp(seen, axis=0)
        needed = 0.5 * max(size[0] / wide, size[1] / high)
        scale *= float(needed) or 1.0
        place = low + 0.5 * size
        place[2] = low[2] - (float(size.max()) or scale)
    else:
        place = standpoint(seen, ((wide, wide), (high, high)))
    position = place @ axes
    ahead = float(np.abs(position).max()) or 1.0  # a single unit may be nothing beside them
    return dataclasses.replace(
        camera, position=position, target=position + ahead * forward, scale=scale, shift=(0.0, 0.0)
    )


ASIDE = np.radians(45.0)
"""By how much one goes around a scene to see the picture of its camera aslant."""


def camera_aside(scene: Scene, boxes: np.ndarray, is_aside: bool) -> Camera:
    """Return a camera that sees a scene and boxes (n, 6) as well, which may be anywhere.

    Parameters
    ----------
    is_aside : bool
        Whether it goes around the scene, as a camera cannot see its own picture.
    """
    camera = picture_camera(scene)
    forward = camera_axes(camera)[0]
    if is_aside:
        up = np.asarray(camera.up, float) / np.linalg.norm(camera.up)
        along = (forward @ up) * up
        forward = along + np.cos(ASIDE) * (forward - along) + np.sin(ASIDE) * np.cross(up, forward)
    corners = np.concatenate([boxes[:, :3], boxes[:, 3:], [scene.lower, scene.upper]])
    corners = corners_of(np.concatenate([corners.min(axis=0), corners.max(axis=0)])[None])[0]
    turned = dataclasses.replace(camera, target=camera.position + forward)
    return camera_around(turned, corners)


def standpoint(points: np.ndarray, slopes: Slopes) -> np.ndarray:
    """Return the place nearest to points from which all of them are seen, (3,).

    Parameters
    ----------
    points : (n, 3) float64
        To the right, up and forward, as the camera looks; at least one.
    slopes : ((left, right), (down, up))
        How far one sees to each side, per distance forward.
    """
    depth = points[:, 2]
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    back = float(depth.min()) - 1e-3 * extent  # all points lie ahead, whatever follows
    bounds = []
    for along, (low, high) in zip(points.T[:2], slopes, strict=True):
        # A point x at depth z is seen from x0 at depth z0 if x - x0 <= high (z - z0) and
        # x0 - x <= low (z - z0): x0 is at least `least` + high z0 and at most `most` - low z0.
        least, most = float((along - high * depth).max()), float((along + low * depth).min())
        bounds.append((least, most))
        back = min(back, (most - least) / (low + high))
    middles = [
        (least + high * back + most - low * back) / 2.0
        for (least, most), (low, high) in zip(bounds, slopes, strict=True)
    ]
    return np.array([*middles, back])
