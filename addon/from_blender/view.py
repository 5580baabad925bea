"""The view of a Blender scene: what rays need beside its triangles, as plain values."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import bpy

from ...core.scene import Camera, Scene
from .cameras import camera_of
from .lights import Lamps, lamps_of
from .remarks import Clipping, missing_data, not_run


class View(NamedTuple):
    """Camera and lights, and what is to be said of them and of the file.

    It is taken from Blender in the main thread; a scene is given it in any thread, since that looks
    at all its triangles.
    """

    camera: Camera | None
    clipping: Clipping | None
    lamps: Lamps
    missing: list[str]

    @classmethod
    def of(cls, context: bpy.types.Context) -> View:
        """Return them as they are now."""
        clipping = Clipping.of(context.scene.camera)
        return cls(camera_of(context), clipping, lamps_of(context), [*missing_data(), *not_run()])

    def onto(self, shape: Scene) -> Scene:
        """Return triangles, of which their own notes are kept, with camera, lights and notes."""
        seen = dataclasses.replace(shape, camera=self.camera, lights=self.lamps.lights)
        clipped = self.clipping.remarks(seen) if self.clipping else []
        notes = (*shape.notes, *self.missing, *clipped, *self.lamps.remarks)
        return dataclasses.replace(seen, notes=notes)
