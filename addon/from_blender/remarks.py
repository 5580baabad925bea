"""What a Blender file has and a scene of ours has not: sentences for its notes."""

from __future__ import annotations

from typing import NamedTuple

import bpy
import numpy as np

from ...core.geometry.box_shape import corners_of
from ...core.geometry.instances import parts_in_world
from ...core.scene import Scene

MOST_NAMES = 5
"""Names that a sentence lists."""


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


def not_run() -> list[str]:
    """Say that the file has drivers or scripts that Blender has refused to run."""
    if not bpy.app.autoexec_fail:
        return []
    last = " ".join(bpy.app.autoexec_fail_message.split())
    return [f"Python of the file was not run, so that nothing follows it; the last was: {last}"]


class Clipping(NamedTuple):
    """Between which distances a camera shows what is before it."""

    start: float
    end: float

    @classmethod
    def of(cls, camera: bpy.types.Object | None) -> Clipping | None:
        """Return those of a scene's camera; None if it is none or of no type CAMERA."""
        if camera is None or camera.type != "CAMERA":
            return None
        return cls(camera.data.clip_start, camera.data.clip_end)

    def remarks(self, scene: Scene) -> list[str]:
        """Say that the camera would cut off part of the scene, as its rays do not; any thread."""
        camera = scene.camera
        if camera is None or not camera.has_rays:
            return []
        forward = camera.target - camera.position
        forward = forward / np.linalg.norm(forward)

        def is_clipped(points: np.ndarray) -> bool:
            depth = (points - camera.position) @ forward
            return bool(((depth > self.end) | ((depth > 0.0) & (depth < self.start))).any())

        def may_be_clipped(box: np.ndarray) -> bool:
            depths = (corners_of(box[None])[0] - camera.position) @ forward
            is_within = depths.max() <= self.end and (
                depths.min() >= self.start or depths.max() <= 0.0
            )
            return not is_within

        # Mostly the box around the scene tells: nothing of it is too near or too far.
        if not may_be_clipped(np.concatenate([scene.lower, scene.upper])):
            return []
        parts = parts_in_world(scene.geometry)
        if not any(may_be_clipped(box) and is_clipped(corners()) for box, corners in parts):
            return []
        return [
            f"the camera {camera.name} clips what is nearer than {self.start:g} or farther than "
            f"{self.end:g}; its rays do not"
        ]
