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

from ...core.geometry.instance_settings import PLAIN
from ...core.progress import SILENT, Progress
from ...core.scene import Scene
from ...core.scene.placing import KEEP, OBJECTS, is_shared
from . import extraction
from .booleans import has_booleans
from .extraction import ListedMesh, RawScene
from .fingerprint import Digest, MeshHash, bytes_of_matrix, fingerprint, movement
from .parts import Key, Part, Standing

Place = tuple[Key, int]
"""A mesh in scope: what it comes from, and the how manyth that Blender lists of it."""


@dataclass
class InLayer:
    """What is known of how a scene looks in one of its view layers.

    Attributes
    ----------
    change : str
        The first change found, in words; empty if there is none.
    is_settled : bool
        Whether `change` is what a comparison would find now.
    hashes : dict of Place to bytes
        Of meshes as they are now.
    unread : set of int
        Objects whose hashes may be others by now.
    reading : dict of Place to MeshHash
        Those begun, not finished.
    """

    change: str = ""
    is_settled: bool = False
    hashes: dict[Place, bytes] = field(default_factory=dict)
    unread: set[int] = field(default_factory=set)
    reading: dict[Place, MeshHash] = field(default_factory=dict)

    def settle(self, change: str) -> None:
        """Note what a comparison has found that has come to its end."""
        self.change, self.is_settled = change, True

    def forget_unread(self) -> None:
        """Forget the hashes of what Blender has evaluated since."""
        places = {*self.hashes, *self.reading}
        for place in [each for each in places if self.unread.intersection(each[0])]:
            self.hashes.pop(place, None)
            self.reading.pop(place, None)
        self.unread.clear()

    def forget_all(self) -> None:
        """Forget whatever is known."""
        self.hashes.clear()
        self.reading.clear()
        self.is_settled = False


@dataclass
class Look:
    """How a scene of Blender's looked, and whether it still does.

    Windows may show one scene in several view layers, each of which hides and evaluates objects for
    itself: what is true in one may be wrong in another.

    Attributes
    ----------
    scope : str
    owner : int
        Session id of the Blender scene it was taken from.
    digests : dict
        What every object looked like, see :func:`.fingerprint.fingerprint`.
    there : frozenset of int
        All objects that were in the view layer, in scope or not.
    instances : str
        What became of instances; empty if it is the same whether they are kept or flattened.
    layers : dict of str to InLayer
        The view layers that it was compared with, by their names.
    """

    scope: str
    owner: int
    digests: dict[Key, Digest]
    there: frozenset[int]
    instances: str = ""
    layers: dict[str, InLayer] = field(default_factory=dict)
    _ids: frozenset[int] = frozenset()  # all objects in `digests`

    def __post_init__(self) -> None:
        self._ids = frozenset(uid for key in self.digests for uid in key)

    @classmethod
    def at(cls, context: bpy.types.Context, scope: str, instances: str, parts: list[Part]) -> Look:
        """Return how the scene looks now, of which `parts` was taken."""
        layer = context.view_layer
        there = frozenset(obj.session_uid for obj in layer.objects)
        matters = (
            instances == OBJECTS
            or is_shared([part.mesh for part in parts])
            or any(part.descriptor != PLAIN for part in parts)
        )
        uid = context.scene.session_uid
        look = cls(scope, uid, fingerprint(parts), there, instances if matters else "")
        # Of instances, those without faces are not among the digests, and would be counted here.
        hashes = {(key, 0): each.meshes[0] for key, each in look.digests.items() if not key[0]}
        look.layers[layer.name] = InLayer(is_settled=True, hashes=hashes)
        return look

    # What may have changed.

    @property
    def is_settled(self) -> bool:
        """Whether nothing may have changed in any view layer that it was compared with."""
        return all(each.is_settled for each in self.layers.values())

    def note_updates(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Mark what Blender says it has evaluated; cheap, looks at nothing.

        Returns
        -------
        bool
            Whether something was settled that is not any more.
        """
        may_differ, unread = False, set()
        for update in depsgraph.updates:
            changed = update.id.original
            if isinstance(changed, bpy.types.Object):
                uid = changed.session_uid
                if update.is_updated_geometry:
                    unread.add(uid)
                if uid in self._ids or extraction.may_have_geometry(changed):
                    may_differ = True
            elif isinstance(changed, (bpy.types.Scene, bpy.types.Collection)):
                # Something was added, removed, hidden or selected.
                may_differ = True
        is_news = may_differ and any(each.is_settled for each in self.layers.values())
        for layer in self.layers.values():
            layer.unread |= unread
            layer.is_settled &= not may_differ
        return is_news

    def note_everything(self) -> None:
        """Mark all there is, since Blender does not say what an undo has brought back."""
        for layer in self.layers.values():
            layer.forget_all()

    def is_settled_for(self, view_layer: bpy.types.ViewLayer) -> bool:
        """Say whether it is known what a comparison with a view layer would find now."""
        return view_layer.name in self.layers and self.layers[view_layer.name].is_settled

    def change_in(self, view_layer: bpy.types.ViewLayer) -> str:
        """Return the first change that the last comparison with a view layer has found, in words.

        Empty if there is none.
        """
        return self.layers[view_layer.name].change

    # What has changed.

    def compare(self, depsgraph: bpy.types.Depsgraph, until: float = math.inf) -> bool:
        """Compare with what would be built over now; say whether that is finished.

        Until it is, nothing is settled of that view layer.

        Parameters
        ----------
        until : float
            Time of ``time.monotonic()`` to stop at. The next call goes on.
        """
        layer = self.layers.setdefault(depsgraph.view_layer.name, InLayer())
        layer.is_settled = False
        layer.forget_unread()
        reader = _Reader(layer, until, depsgraph)
        listed: Counter[Key] = Counter()
        with_faces: Counter[Key] = Counter()
        is_complete = True
        for found in extraction.meshes_in_scope(depsgraph, self.scope):
            now = reader.hash_of((found.key, listed[found.key]), found)
            listed[found.key] += 1
            if now is None:
                is_complete = False
            elif now:
                change = self._change_of(with_faces[found.key], found, now)
                if change:
                    layer.settle(change)
                    return True
                with_faces[found.key] += 1
        if is_complete:
            layer.settle(self._missing(depsgraph.view_layer, with_faces))
        return is_complete

    def _change_of(self, number: int, found: ListedMesh, now: bytes) -> str:
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
        if found.descriptor != before.descriptors[number]:
            return f"what {found.name} says of itself as an instance has changed"
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


class _Reader:
    """Hashes the meshes of one comparison, as long as there is time."""

    def __init__(self, layer: InLayer, until: float, depsgraph: bpy.types.Depsgraph) -> None:
        self._layer, self._until = layer, until
        self._depsgraph = depsgraph
        self._known: dict[int, bytes] = {}  # by the address of a mesh that several objects share
        self._has_read = False

    def hash_of(self, place: Place, found: ListedMesh) -> bytes | None:
        """Return the hash of a mesh, empty if it has no faces; None if there is no time for it."""
        layer, known = self._layer, self._known
        is_tree = has_booleans(found.obj.original)
        if is_tree and place in layer.hashes:
            return layer.hashes[place]
        standing = extraction.standing_of(found.obj.original, self._depsgraph)
        if isinstance(standing, Standing):
            if is_tree:
                layer.hashes[place] = standing.digest
            return standing.digest
        if place in layer.hashes:
            return layer.hashes[place]
        address = found.obj.data.as_pointer()
        if address not in known:
            # However long the list of objects is, every comparison gets some way.
            if self._has_read and time.monotonic() > self._until:
                return None
            self._has_read = True
            reading = layer.reading.get(place)
            if reading is None:
                # As extraction does it: in edit mode the mesh is still in the editor's form.
                mesh = found.obj.to_mesh()
                try:
                    reading = MeshHash(mesh)
                finally:
                    found.obj.to_mesh_clear()
                layer.reading[place] = reading
            value = reading.advance(self._until)
            if value is None:
                return None
            known[address] = value
            del layer.reading[place]
        layer.hashes[place] = known[address]
        return known[address]


class Snapshot(NamedTuple):
    """A scene of ours, and how it looked in Blender.

    Attributes
    ----------
    shape : Scene
        What can be hit alone, whatever camera and lights there are.
    scene : Scene
        With those of the moment when it was taken.
    look : Look
    """

    shape: Scene
    scene: Scene
    look: Look


class Taken(NamedTuple):
    """A scene that was taken from Blender, and how it looked."""

    raw: RawScene
    look: Look

    @classmethod
    def at(cls, context: bpy.types.Context, scope: str, instances: str = KEEP) -> Taken:
        """Take one now, in the main thread.

        Parameters
        ----------
        scope : {"visible", "selected"}
        instances : {"keep", "objects", "flatten"}

        Raises
        ------
        InputError
            When there is nothing to build over, or a mesh is invalid.
        """
        raw = RawScene.at(context, scope, instances)
        return cls(raw, Look.at(context, scope, instances, raw.parts))

    def snapshot(self, progress: Progress = SILENT) -> Snapshot:
        """Make a scene of it, in any thread.

        Raises
        ------
        InputError
            When there is no triangle that a ray could hit, or too many for the memory.
        Cancelled
            From `progress`.
        """
        shape = self.raw.shape(progress)
        progress.report(0, 1, "Looking at triangles")
        return Snapshot(shape, self.raw.view.onto(shape), self.look)


def _object_of(uid: int, view_layer: bpy.types.ViewLayer) -> bpy.types.Object | None:
    """Return the object with a session id; None if the view layer does not have it."""
    return next((obj for obj in view_layer.objects if obj.session_uid == uid), None)
