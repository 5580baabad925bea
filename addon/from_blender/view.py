"""The view of a Blender scene: what pictures need beside its triangles, as plain values."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import bpy

from ...core.scene import Camera, Light, Scene
from ...core.scene.material import MATT, display_of
from .cameras import camera_of
from .lights import Lamps, lamps_of
from .materials import Found, materials_of
from .remarks import Clipping, missing_data, not_run


class View(NamedTuple):
    """Camera, lights and materials, and what is to be said of them and of the file.

    It is taken from Blender in the main thread; a scene is given it in any thread, since that looks
    at all its triangles.
    """

    camera: Camera | None
    clipping: Clipping | None
    lamps: Lamps
    missing: list[str]
    materials: dict[str, Found]
    background: tuple[float, float, float]

    @classmethod
    def of(cls, context: bpy.types.Context) -> View:
        """Return them as they are now."""
        clipping = Clipping.of(context.scene.camera)
        return cls(
            camera_of(context), clipping, lamps_of(context), [*missing_data(), *not_run()],
            materials_of(context), background_of(context),
        )  # fmt: skip

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights."""
        return self.lamps.lights

    def onto(self, shape: Scene) -> Scene:
        """Return triangles, of which their own notes are kept, with all that, and its notes.

        Their materials are known by name; one that was removed since is matt.
        """
        nothing = Found(MATT, "")
        made_of = [self.materials.get(each.name, nothing) for each in shape.materials]
        seen = dataclasses.replace(
            shape, camera=self.camera, lights=self.lamps.lights, background=self.background,
            materials=tuple(found.material for found in made_of),
        )  # fmt: skip
        clipped = self.clipping.remarks(seen) if self.clipping else []
        unread = [
            f"not read of the material {found.material.name}: {found.unread}"
            for found in made_of
            if found.unread
        ]
        notes = (*shape.notes, *self.missing, *clipped, *self.lamps.remarks, *unread)
        return dataclasses.replace(seen, notes=notes)


def background_of(context: bpy.types.Context) -> tuple[float, float, float]:
    """Return the colour of the world as it is shown: that of its background shader, if it has one.

    What nodes it has in front of that are not evaluated.
    """
    world = context.scene.world
    if world is None:
        return 0.0, 0.0, 0.0
    colour, strength = world.color, 1.0
    uses_nodes = bpy.app.version >= (5, 0, 0) or world.use_nodes
    if uses_nodes and world.node_tree is not None:
        for node in world.node_tree.nodes:
            if node.type == "BACKGROUND":
                colour, strength = (
                    node.inputs["Color"].default_value,
                    node.inputs["Strength"].default_value,
                )
    red, green, blue = (display_of(min(max(strength * each, 0.0), 1.0)) for each in colour[:3])
    return red, green, blue
