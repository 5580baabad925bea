"""What a Blender file has and a scene of ours has not: sentences for its notes."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.scene import Scene
from . import lights

MOST_NAMES = 5
"""Names that a sentence lists."""


def remarks_of(context: bpy.types.Context, scene: Scene) -> tuple[str, ...]:
    """Return all there is to say of a scene taken from the file that is open."""
    return (*missing_data(), *clipped(context, scene), *lights.remarks(context))


def missing_data() -> list[str]:
    """Return a sentence for each linked library of which something is missing.

    Blender puts empty data-blocks where a library, or something in it, is not found.
    """
    libraries = list(bpy.data.libraries)
    if not libraries:
        return []
    missing: dict[str, list[str]] = {library.name: [] for library in libraries}
    for block in bpy.data.user_map():
        if block.library and block.is_missing:
            missing[block.library.name].append(f"{block.bl_rna.name} {block.name}")
    sentences = []
    for library in libraries:
        names = sorted(missing[library.name])
        listed = ", ".join(names[:MOST_NAMES])
        if len(names) > MOST_NAMES:
            listed += f" and {len(names) - MOST_NAMES} more"
        if library.is_missing:
            without = f", so that these are left out: {listed}" if names else ""
            sentences.append(f"the linked library {library.filepath} cannot be read{without}")
        elif names:
            sentences.append(f"the linked library {library.filepath} lacks what is used: {listed}")
    return sentences


def clipped(context: bpy.types.Context, scene: Scene) -> list[str]:
    """Say that the camera would cut off part of the scene, as its rays do not."""
    own, camera = context.scene.camera, scene.camera
    if camera is None or not camera.has_rays or own.type != "CAMERA":
        return []
    forward = camera.target - camera.position
    forward = forward / np.linalg.norm(forward)
    depth = scene.triangles @ forward - camera.position @ forward
    start, end = own.data.clip_start, own.data.clip_end
    if not ((depth > end) | ((depth > 0.0) & (depth < start))).any():
        return []
    return [
        f"the camera {camera.name} clips what is nearer than {start:g} or farther than {end:g}; "
        "its rays do not"
    ]
