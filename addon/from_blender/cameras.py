"""The scene's camera, as Blender itself sees through it.

Blender renders through any object. What is not of type CAMERA counts as a lens of 35 mm, a lamp as
one whose angle is that of its cone. The object's scale does not count, but a negative one mirrors
the picture, and what a parent has sheared stays sheared. Width and height of a picture are those
of the rays: they stand for the render's resolution, whose pixels may be wider than high.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy as np

from ...core.scene import ORTHOGRAPHIC, PERSPECTIVE, Camera

FITS = {"AUTO": "larger", "HORIZONTAL": "width", "VERTICAL": "height"}

VIEW_SENSOR = 36.0
"""Tangent between the middle and the border of a viewport's larger side, times its lens."""

VIEW_FAR = 100.0
"""How far before what an orthographic viewport looks at its rays start, in its own distances."""

FLAT = 1e-6
"""Volume between the three axes, 1 if they are at right angles, below which they are no space."""


class Lens(NamedTuple):
    """What a camera has beside its place; see :class:`...core.scene.Camera`."""

    kind: str
    fov: float
    scale: float = 1.0
    fit: str = "larger"
    shift: tuple[float, float] = (0.0, 0.0)


def camera_of(context: bpy.types.Context) -> Camera | None:
    """Return the scene's camera, None if it has none.

    One that no rays are made of says so in its kind, in words.
    """
    own = context.scene.camera
    if own is None:
        return None
    depsgraph = context.evaluated_depsgraph_get()
    evaluated = own.evaluated_get(depsgraph)
    if own.is_missing:
        return _without_rays(own, "missing, since its library cannot be read")
    matrix = np.array(evaluated.matrix_world, dtype=np.float64)
    axes, position = matrix[:3, :3], matrix[:3, 3]
    lengths = np.linalg.norm(axes, axis=0)
    if not np.isfinite(matrix).all() or not lengths.all():
        return _without_rays(own, "nowhere or has a scale of zero")
    right, up, back = (axes / lengths).T
    if abs(np.linalg.det(axes / lengths)) < FLAT:
        return _without_rays(own, "flat, by the scales of its parents")
    lens = _lens_of(evaluated, depsgraph)
    # Far away from the origin, one unit ahead would be rounded away.
    ahead = max(1.0, 1e-3 * float(np.abs(position).max()))
    render = context.scene.render
    return Camera(
        position,
        position - ahead * back,
        up,
        lens.fov,
        kind=lens.kind,
        scale=lens.scale,
        fit=lens.fit,
        shift=lens.shift,
        pixel_aspect=render.pixel_aspect_x / render.pixel_aspect_y,
        right=right,
        name=own.name,
    )


def camera_of_view(
    context: bpy.types.Context, space: bpy.types.SpaceView3D, region: bpy.types.Region
) -> Camera | None:
    """Return a camera that sees what a viewport shows, from its lower to its upper border.

    Through the scene's camera that is the camera itself; None if there is none.
    """
    view = space.region_3d
    if view.view_perspective == "CAMERA":
        return camera_of(context)
    # Not by its matrices, which are those of what was drawn last.
    _, up, back = np.array(view.view_rotation.to_matrix(), dtype=np.float64).T
    position = np.array(view.view_location) + view.view_distance * back
    # Half of the larger side is seen under that angle.
    slope = VIEW_SENSOR / space.lens * region.height / max(region.width, region.height)
    if view.view_perspective == "PERSP":
        fov = _angle(2.0 * slope)
        return Camera(position, position - view.view_distance * back, up, fov, fit="height")
    height = 2.0 * slope * view.view_distance
    # From before everything: what an orthographic viewport shows begins behind its eye.
    return Camera(position + VIEW_FAR * view.view_distance * back, position, up, 0.0,
                  kind=ORTHOGRAPHIC, scale=height, fit="height")  # fmt: skip


def _without_rays(own: bpy.types.Object, kind: str) -> Camera:
    """Return a camera of which no rays are made, and why."""
    return Camera(np.zeros(3), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0.0, kind,
                  name=own.name)  # fmt: skip


def _lens_of(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Lens:
    """Return the lens of an evaluated object."""
    if camera.type != "CAMERA":
        # The only place where Blender tells what it takes for those.
        matrix = camera.calc_matrix_camera(depsgraph, x=1, y=1)
        return Lens(PERSPECTIVE, _angle(2.0 / matrix[0][0]))
    data = camera.data
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    fit, shift = FITS[data.sensor_fit], (data.shift_x, data.shift_y)
    if data.type == "PERSP":
        return Lens(PERSPECTIVE, _angle(sensor / data.lens), fit=fit, shift=shift)
    if data.type == "ORTHO":
        return Lens(ORTHOGRAPHIC, 0.0, data.ortho_scale, fit, shift)
    return Lens(_kind_in_words(data), 0.0)


def _angle(size: float) -> float:
    """Return the full angle, in degrees, under which `size` is seen from one unit away."""
    return float(np.degrees(2.0 * np.arctan(0.5 * size)))


def _kind_in_words(data: bpy.types.Camera) -> str:
    """Return ``"panoramic (fisheye equisolid)"`` and the like."""
    if data.type != "PANO":
        return f"of the type {data.type.lower()}"
    # Blender 4.5 leaves this to Cycles.
    owner = data if hasattr(data, "panorama_type") else getattr(data, "cycles", None)
    kind = getattr(owner, "panorama_type", "")
    return f"panoramic ({kind.replace('_', ' ').lower()})" if kind else "panoramic"
