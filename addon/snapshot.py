"""Snapshot: a scene as it was taken from Blender, and whether Blender still shows it."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..core.errors import InputError
from ..core.scene import Scene
from . import extraction


@dataclass
class Snapshot:
    """A scene taken from Blender, and what is needed to know whether it is still that.

    Attributes
    ----------
    scene : Scene
    scope : str
    owner : int
        Session id of the Blender scene it was taken from.
    digests : dict
        What every object looked like, see :func:`.extraction.fingerprint`.
    members : frozenset of int
        The objects that were in scope.
    change : str
        The first change since, in words; empty if there is none.
    """

    scene: Scene
    scope: str
    owner: int
    digests: dict[extraction.Key, extraction.Digest]
    members: frozenset[int]
    change: str = ""

    @classmethod
    def take(cls, context: bpy.types.Context, scope: str) -> Snapshot:
        """Take one now.

        Raises
        ------
        InputError
            When there is nothing to build over.
        """
        parts = extraction.collect(context.evaluated_depsgraph_get(), scope)
        return cls(
            extraction.scene_of(context, parts),
            scope,
            context.scene.session_uid,
            extraction.fingerprint(parts),
            extraction.members(context.view_layer, scope),
        )

    def note_updates(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Look at what Blender says it has updated; cheap, evaluates nothing."""
        if self.change:
            return
        ids = {uid for key in self.digests for uid in key}
        for update in depsgraph.updates:
            changed = update.id.original
            if isinstance(changed, (bpy.types.Scene, bpy.types.Collection)):
                self._note_members(depsgraph.view_layer)
            elif isinstance(changed, bpy.types.Object) and changed.session_uid in ids:
                if update.is_updated_geometry:
                    self.change = f"{changed.name} was edited"
                elif update.is_updated_transform:
                    self.change = f"{changed.name} was moved"

    def _note_members(self, view_layer: bpy.types.ViewLayer) -> None:
        now = extraction.members(view_layer, self.scope)
        if now == self.members:
            return
        if now - self.members:
            name = next(obj.name for obj in view_layer.objects
                        if obj.session_uid in now - self.members)  # fmt: skip
            self.change = f"{name} was added"
        else:
            gone = self.members - now
            names = [d.name for key, d in self.digests.items() if gone.intersection(key)]
            self.change = f"{names[0] if names else 'an object'} was removed or hidden"

    def compare(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Look at the objects themselves: after an undo what was changed may be as before."""
        try:
            now = extraction.fingerprint(extraction.collect(depsgraph, self.scope))
        except InputError:
            now = {}
        self.change = ""
        for key, digest in self.digests.items():
            if key not in now:
                self.change = f"{digest.name} was removed or hidden"
            elif now[key].value != digest.value:
                self.change = f"{now[key].name} was changed"
            if self.change:
                return
        for key, digest in now.items():
            if key not in self.digests:
                self.change = f"{digest.name} was added"
                return
