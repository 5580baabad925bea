"""A scene of solids and polygons as one of triangles, for what knows triangles alone."""

from __future__ import annotations

import dataclasses

from ..geometry.solids.mixed import Mixed
from ..geometry.solids.tessellation import tessellated
from . import Scene


def as_triangles(scene: Scene, reason: str) -> Scene:
    """Return a scene with its items as triangles, and a note on that; itself if it has no others.

    Parameters
    ----------
    reason : str
        Why, for the note: ``"cones meet triangles only"``.

    Raises
    ------
    InputError
        If instances are of something else than triangles.
    """
    scene = scene.flat()
    geometry = scene.geometry
    if not isinstance(geometry, Mixed):
        return scene
    corners, owners = tessellated(geometry)
    made = Scene.from_triangles(
        corners, scene.name, scene.source, object_ids=scene.object_ids[owners],
        object_names=scene.object_names, camera=scene.camera, lights=scene.lights,
        notes=(
            *scene.notes,
            f"its {len(geometry.ids)} items are seen as {len(corners)} triangles, for {reason}",
        ),
    )  # fmt: skip
    items = owners[made.primitive_ids]
    return dataclasses.replace(
        made, background=scene.background, materials=scene.materials,
        material_ids=None if scene.material_ids is None else scene.material_ids[items],
    )  # fmt: skip
