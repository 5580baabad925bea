"""Snapshot: a scene as it was taken from Blender, and whether Blender still shows it.

Blender tells which objects it has evaluated anew. That is no change yet: entering edit mode, a new
material, or moving something and back again evaluate, too. So those objects are only marked
(:meth:`Look.note_updates`), and what is true is found by comparing fingerprints of what would be
built over now (:meth:`Look.compare`).
"""

from __future__ import annotations

import math
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import bpy

from ..core.scene import Scene
from . import extraction
from .extraction import Found, Key, Part
from .fingerprint import Digest, MeshHash, bytes_of_matrix, fingerprint, movement
from .mesh_check import refuse_invalid_meshes

Place = tuple[Key, int]
"""A mesh in scope: what it comes from, and the how manyth that Blender lists of it."""


@dataclass
class Look:
    """How a scene of Blender's looked, and whether it still does.

    Attributes
    ----------
    scope : str
    owner : int
        Session id of the Blender scene it was taken from.
    digests : dict
        What every object looked like, see :func:`.fingerprint.fingerprint`.
    there : frozenset of int
        All objects that were in the view layer, in scope or not.
    layer : str
        The view layer it was last compared with.
    change : str
        The first change found, in words; empty if there is none.
    is_settled : bool
        Whether `change` is what a comparison would find now.
    """

    scope: str
    owner: int
    digests: dict[Key, Digest]
    there: frozenset[int]
    layer: str
    change: str = ""
    is_settled: bool = True
    _ids: frozenset[int] = frozenset()  # all objects in `digests`
    _hashes: dict[Place, bytes] = field(default_factory=dict)  # of meshes as they are now
    _unread: set[int] = field(default_factory=set)  # objects whose hashes may be others by now
    _reading: dict[Place, MeshHash] = field(default_factory=dict)  # begun, not finished
    _has_read: bool = False  # something, in this comparison

    def __post_init__(self) -> None:
        self._ids = frozenset(uid for key in self.digests for uid in key)
        # Of instances, those without faces are not among the digests, and would be counted here.
        self._hashes = {
            (key, 0): each.meshes[0] for key, each in self.digests.items() if not key[0]
        }

    @classmethod
    def at(cls, context: bpy.types.Context, scope: str, parts: list[Part]) -> Look:
        """Return how the scene looks now, of which `parts` was taken."""
        layer = context.view_layer
        there = frozenset(obj.session_uid for obj in layer.objects)
        return cls(scope, context.scene.session_uid, fingerprint(parts), there, layer.name)

    # What may have changed.

    def note_updates(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Mark what Blender says it has evaluated; cheap, looks at nothing."""
        for update in depsgraph.updates:
            changed = update.id.original
            if isinstance(changed, bpy.types.Object):
                uid = changed.session_uid
                if update.is_updated_geometry:
                    self._unread.add(uid)
                if uid in self._ids or extraction.may_have_geometry(changed):
                    self.is_settled = False
            elif isinstance(changed, (bpy.types.Scene, bpy.types.Collection)):
                # Something was added, removed, hidden or selected.
                self.is_settled = False

    def note_everything(self) -> None:
        """Mark all there is, since Blender does not say what an undo has brought back."""
        self._hashes.clear()
        self._reading.clear()
        self.is_settled = False

    def is_settled_for(self, view_layer: bpy.types.ViewLayer) -> bool:
        """Say whether `change` is what a comparison with a view layer would find now."""
        return self.is_settled and self.layer == view_layer.name

    # What has changed.

    def compare(self, depsgraph: bpy.types.Depsgraph, until: float = math.inf) -> bool:
        """Compare with what would be built over now; say whether that is finished.

        Parameters
        ----------
        until : float
            Time of ``time.monotonic()`` to stop at. The next call goes on.
        """
        self._forget_unread()
        self.layer = depsgraph.view_layer.name
        self._has_read = False
        listed: Counter[Key] = Counter()
        with_faces: Counter[Key] = Counter()
        known: dict[int, bytes] = {}
        is_complete = True
        for found in extraction.meshes_in_scope(depsgraph, self.scope):
            now = self._hash_of((found.key, listed[found.key]), found, known, until)
            listed[found.key] += 1
            if now is None:
                is_complete = False
            elif now:
                change = self._change_of(with_faces[found.key], found, now)
                if change:
                    return self._settle(change)
                with_faces[found.key] += 1
        if not is_complete:
            return False
        return self._settle(self._missing(depsgraph.view_layer, with_faces))

    def _forget_unread(self) -> None:
        places = {*self._hashes, *self._reading}
        for place in [each for each in places if self._unread.intersection(each[0])]:
            self._hashes.pop(place, None)
            self._reading.pop(place, None)
        self._unread.clear()

    def _settle(self, change: str) -> bool:
        self.change, self.is_settled = change, True
        return True

    def _hash_of(
        self, place: Place, found: Found, known: dict[int, bytes], until: float
    ) -> bytes | None:
        """Return the hash of a mesh, empty if it has no faces; None if there is no time for it."""
        if place in self._hashes:
            return self._hashes[place]
        address = found.obj.data.as_pointer()
        if address not in known:
            # However long the list of objects is, every comparison gets some way.
            if self._has_read and time.monotonic() > until:
                return None
            self._has_read = True
            reading = self._reading.get(place)
            if reading is None:
                # As extraction does it: in edit mode the mesh is still in the editor's form.
                mesh = found.obj.to_mesh()
                try:
                    reading = MeshHash(mesh)
                finally:
                    found.obj.to_mesh_clear()
                self._reading[place] = reading
            value = reading.advance(until)
            if value is None:
                return None
            known[address] = value
            del self._reading[place]
        self._hashes[place] = known[address]
        return known[address]

    def _change_of(self, number: int, found: Found, now: bytes) -> str:
        """Return what is different about a mesh with faces, in words.

        Parameters
        ----------
        number : int
            The how manyth of its key it is.
        now : bytes
            Its hash.
        """
        before = self.digests.get(found.key)
        if before is None:
            return self._new(found.key, found.name)
        if number >= len(before.meshes):
            return f"there are more of {found.name}"
        matrix = bytes_of_matrix(found.matrix)
        if matrix != before.matrices[number]:
            return f"{found.name} {movement(before.matrices[number], matrix)}"
        if now != before.meshes[number]:
            return f"the geometry of {found.name} has changed"
        return ""

    def _new(self, key: Key, name: str) -> str:
        if (key[0] or key[1]) not in self.there:
            return f"{name} was added"
        return f"{name} is {self.scope} now"

    def _missing(self, view_layer: bpy.types.ViewLayer, with_faces: Counter[Key]) -> str:
        """Return what is not there any more, in words."""
        for key, digest in self.digests.items():
            count = with_faces[key]
            if count == len(digest.meshes):
                continue
            if count:
                return f"there are fewer of {digest.name}"
            owner = _object_of(key[0] or key[1], view_layer)
            if owner is None:
                return f"{digest.name} was removed"
            name = digest.name if key[0] else owner.name
            if not owner.visible_get(view_layer=view_layer):
                return f"{name} is hidden"
            if self.scope == extraction.SELECTED and not owner.select_get(view_layer=view_layer):
                return f"{name} is no longer selected"
            return f"{name} has no faces any more" if not key[0] else f"{name} is no longer there"
        return ""


class Snapshot(NamedTuple):
    """A scene that was taken from Blender, and how it looked."""

    scene: Scene
    look: Look

    @classmethod
    def take(cls, context: bpy.types.Context, scope: str) -> Snapshot:
        """Take one now.

        Raises
        ------
        InputError
            When there is nothing to build over, or a mesh is invalid.
        """
        refuse_invalid_meshes(context.view_layer)
        parts = extraction.collect(context.evaluated_depsgraph_get(), scope)
        return cls(extraction.scene_of(context, parts), Look.at(context, scope, parts))


def _object_of(uid: int, view_layer: bpy.types.ViewLayer) -> bpy.types.Object | None:
    """Return the object with a session id; None if the view layer does not have it."""
    return next((obj for obj in view_layer.objects if obj.session_uid == uid), None)
