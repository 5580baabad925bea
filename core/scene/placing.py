"""Scenes of meshes in places: each mesh once with its matrices, or all triangles in world space.

What reads scenes (files, Blender) says which mesh stands where. Whether a mesh in several places
stays one is the user's choice; where none is, and where instances could not be computed with, the
scene is one of triangles.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from ..geometry.csg.description import ClosedMesh, Node, is_tree, leaves_of, moved_node
from ..geometry.csg.making import Described
from ..geometry.csg.trees import Csg
from ..geometry.geometry import in_order
from ..geometry.instance_settings import PLAIN, InstanceSettings, checked
from ..geometry.instances import Instanced, instanced, inverted, mirrors, moved_points
from ..geometry.solids.description import Item, moved_item
from ..geometry.solids.making import in_turn, mixed_of, mixed_of_triangles
from ..geometry.triangles import all_triangles, extent
from ..memory import refuse_if_too_large
from ..progress import SILENT, Progress
from ..settings import setting
from . import LARGEST, Scene, has_area, is_computable
from .material import MATT, Material

KEEP, OBJECTS, FLATTEN = "keep", "objects", "flatten"

MOST_OBJECTS = 4096
"""Of a scene of triangles, that become instances: each of them costs a build of its own."""

BYTES_PER_TRIANGLE = 300  # at the peak of making a scene of them

BYTES_PER_INSTANCE = 600

BYTES_PER_ITEM = 1200  # of solids, and of triangles beside them; at the peak of making a scene


@dataclass(frozen=True)
class PlacingSettings:
    """How scenes are made of what is read."""

    instances: str = setting(
        KEEP, "Instances", "What becomes of meshes that are in several places",
        choices={
            KEEP: "Each mesh once, and a matrix for each of its places",
            OBJECTS: "Every object an instance of its mesh, in one place or in several",
            FLATTEN: "All triangles in world space, as if no mesh were in several places",
        },
    )  # fmt: skip


class Mesh(NamedTuple):
    """Triangles that share vertices, in a space of their own.

    Attributes
    ----------
    vertices : (n_vertices, 3) float
    triangles : (n, 3) int
    slots : (n,) int or None
        Which of its object's materials each triangle is of; None if all are of the first.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    slots: np.ndarray | None = None


class Solids(NamedTuple):
    """Items of any kind, in a space of their own: what a mesh stands for.

    Attributes
    ----------
    items : sequence of Item or Node
        Trees of solids, too.
    slots : sequence of int or None
        Which of its object's materials each leaf is of, if there are trees; None if all are of the
        first.
    """

    items: Sequence[Node]
    slots: Sequence[int] | None = None


class PlacedMesh(NamedTuple):
    """A mesh, or what one stands for, in the world: an object of the scene.

    Attributes
    ----------
    name : str
    mesh : Mesh or Solids
        The same one, not an equal one, where it is in several places.
    matrix : (4, 4) float64
        To world space.
    materials : tuple of Material
        What it is made of, by slot; matt, if there is none.
    descriptor : InstanceSettings
        What it says of itself as an instance.
    """

    name: str
    mesh: Mesh | Solids
    matrix: np.ndarray
    materials: tuple[Material, ...] = ()
    descriptor: InstanceSettings = PLAIN


class _Kept(NamedTuple):
    """Instances, and the number of the object that each is, or begins with.

    Attributes
    ----------
    in_world : (n_objects,) bool
        Which objects stand in world space.
    """

    geometry: Instanced
    object_ids: np.ndarray
    in_world: np.ndarray


def is_shared(meshes: Sequence[object]) -> bool:
    """Say whether one of the meshes is in several places."""
    return max(Counter(map(id, meshes)).values(), default=0) > 1


def moved_vertices(vertices: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return vertices, (n, 3), moved by a matrix, (4, 4), unless that is the identity."""
    if np.array_equal(matrix, np.eye(4)):
        return vertices
    return moved_points(vertices, matrix[:3])


def scene_of(
    objects: Sequence[PlacedMesh],
    instances: str,
    name: str,
    source: str = "",
    *,
    notes: tuple[str, ...] = (),
    advice: str = "take a part of it",
    progress: Progress = SILENT,
) -> Scene:
    """Return a scene of meshes in places.

    Meshes that are in one place only stand in world space, and those that follow each other are one
    mesh, whose matrix is the identity. So what overlaps has one tree, made for the axes of the
    world, as it had without instances, and rays are not rounded on their way in. Only those that
    follow each other, for the triangles of a scene have the same numbers either way; and only those
    that say the same of themselves.

    Parameters
    ----------
    instances : {KEEP, OBJECTS, FLATTEN}
        Kept are instances only where a mesh is in several places or an object has a descriptor of
        its own, and none stands for solids. With OBJECTS no mesh stands in world space, but for
        those that a matrix makes flat.
    advice : str
        What to do if there is too little memory.

    Raises
    ------
    InputError
        When there is no triangle that a ray could hit, or too many for the memory.
    Cancelled
        From `progress`.
    """
    names = tuple(each.name for each in objects)
    for each in objects:
        checked(each.descriptor, f"{each.name} as an instance")
    has_descriptors = any(each.descriptor != PLAIN for each in objects)
    meshes = [each.mesh for each in objects if isinstance(each.mesh, Mesh)]
    if len(meshes) < len(objects):
        if instances == OBJECTS or (instances == KEEP and (is_shared(meshes) or has_descriptors)):
            notes = (*notes, "its instances are flattened, for they are beside solids")
        return _of_items(objects, name, source, names, notes, advice, progress)
    if instances == OBJECTS or (instances == KEEP and (is_shared(meshes) or has_descriptors)):
        once = sum(len(mesh.triangles) for mesh in {id(mesh): mesh for mesh in meshes}.values())
        refuse_if_too_large(
            once * BYTES_PER_TRIANGLE + len(objects) * BYTES_PER_INSTANCE,
            f"{name} with {len(objects)} instances of {once} triangles", advice,
        )  # fmt: skip
        with np.errstate(all="ignore"):
            kept = _kept(objects, meshes, instances, progress)
        if kept is not None:
            scene = Scene.from_instances(
                kept.geometry, name, source, object_ids=kept.object_ids, object_names=names,
                notes=notes,
            )  # fmt: skip
            counts = [len(mesh.triangles) for mesh in meshes]
            scene = dataclasses.replace(scene, object_first=np.cumsum([0, *counts]))
            return _surfaced(scene, objects, counts, kept.in_world)
        notes = (*notes, "its instances are flattened, for some cannot be computed with in place")
    if has_descriptors and instances == FLATTEN:
        notes = (*notes, "masks and what else instances say have no effect, for they are flattened")
    counts = [len(mesh.triangles) for mesh in meshes]
    total = sum(counts)
    if instances == FLATTEN and is_shared(meshes):
        advice += " or choose --instances keep"
    refuse_if_too_large(total * BYTES_PER_TRIANGLE, f"{name} of {total} triangles", advice)
    corners = np.empty((total, 3, 3))
    first = 0
    for placed, mesh, count in zip(objects, meshes, counts, strict=True):
        progress.report(first, total, "Taking triangles")
        corners[first : first + count] = _in_world(mesh, placed.matrix)
        first += count
    progress.report(total, total, "Taking triangles")
    scene = Scene.from_triangles(
        corners, name, source, notes=notes,
        object_ids=np.repeat(np.arange(len(objects), dtype=np.int32), counts), object_names=names,
        progress=progress,
    )  # fmt: skip
    return _surfaced(scene, objects, counts, np.ones(len(objects), bool))


def by_objects(scene: Scene) -> Scene:
    """Return a scene whose objects are instances, each in one place.

    One that holds instances is returned as it is. Primitives keep their numbers: every run of those
    of one object is an instance. Of more than MOST_OBJECTS runs all are one.

    Raises
    ------
    InputError
        If it holds trees of solids (CSG), which stand in no instance.
    """
    if isinstance(scene.geometry, Instanced):
        return scene
    if isinstance(scene.geometry, Csg):
        raise InputError(
            f"instances hold triangles and solids, and {scene.name} holds trees of them; choose "
            "another structure than two_level",
            scene.name,
        )
    begins = np.append(0, 1 + np.flatnonzero(np.diff(scene.object_ids)))
    if len(begins) > MOST_OBJECTS:
        begins = begins[:1]
    ends = np.append(begins[1:], len(scene))
    meshes = [
        # As far as all of it, so that rays have the same slack, and hits the same bits.
        in_order(scene.geometry, np.arange(begin, end))._replace(
            ids=np.arange(end - begin, dtype=np.int32), reach=scene.geometry.reach
        )
        for begin, end in zip(begins, ends, strict=True)
    ]
    places = np.tile(np.eye(3, 4), (len(meshes), 1, 1))
    geometry = instanced(meshes, np.arange(len(meshes)), places)
    return dataclasses.replace(
        scene, geometry=geometry, primitive_ids=geometry.ids, object_ids=scene.object_ids[begins],
        lower=geometry.boxes[:, :3].min(axis=0), upper=geometry.boxes[:, 3:].max(axis=0),
    )  # fmt: skip


def _in_world(mesh: Mesh, matrix: np.ndarray) -> np.ndarray:
    """Return the triangles of a mesh, (n, 3, 3), in its own precision.

    NaN and infinite numbers are no affair here: their triangles are dropped and counted later.
    """
    with np.errstate(all="ignore"):
        return moved_vertices(mesh.vertices, matrix)[mesh.triangles]


def _of_items(
    objects: Sequence[PlacedMesh],
    name: str,
    source: str,
    names: tuple[str, ...],
    notes: tuple[str, ...],
    advice: str,
    progress: Progress,
) -> Scene:
    """Return a scene of items of any kind, those of one object after those of the other."""
    counts = [
        len(mesh.items if isinstance(mesh, Solids) else mesh.triangles)
        for mesh in (placed.mesh for placed in objects)
    ]
    total = sum(counts)
    refuse_if_too_large(total * BYTES_PER_ITEM, f"{name} of {total} items", advice)
    solids = [placed.mesh.items for placed in objects if isinstance(placed.mesh, Solids)]
    if any(is_tree(item) for items in solids for item in items):
        return _of_trees(objects, name, source, names, notes, progress)
    owners = np.repeat(np.arange(len(objects), dtype=np.int32), counts)
    is_solid = np.zeros(total, bool)
    items: list[Item] = []
    corners = [np.empty((0, 3, 3))]
    first = 0
    for number, (placed, count) in enumerate(zip(objects, counts, strict=True)):
        progress.report(number, len(objects), "Taking solids")
        if isinstance(placed.mesh, Solids):
            items += [moved_item(item, placed.matrix) for item in _plain(placed.mesh)]
            is_solid[first : first + count] = True
        else:
            corners.append(_in_world(placed.mesh, placed.matrix).astype(np.float64))
        first += count
    triangles = np.concatenate(corners)
    usable = (np.abs(triangles) < LARGEST).all(axis=(1, 2))
    # Places in the scene: first those of solids, then those of triangles, as they are made.
    places = np.concatenate([np.flatnonzero(is_solid), np.flatnonzero(~is_solid)[usable]])
    order = np.argsort(places, kind="stable")
    progress.report(len(objects), len(objects), "Taking solids")
    geometry = in_turn([mixed_of(items), mixed_of_triangles(triangles[usable])], order)
    kept = places[order].astype(np.int32)
    scene = Scene.from_mixed(
        geometry, name, source, object_ids=owners[kept], object_names=names, primitive_ids=kept,
        dropped=total - len(kept), notes=notes,
    )  # fmt: skip
    # Solids are seen through their matrices, and polygons, which are not, have no inside.
    has_corners = np.array([isinstance(each.mesh, Mesh) for each in objects])
    return _surfaced(scene, objects, counts, has_corners)


def _plain(solids: Solids) -> list[Any]:
    """Return the items of what has no trees."""
    return [item for item in solids.items if not is_tree(item)]


def _of_trees(
    objects: Sequence[PlacedMesh],
    name: str,
    source: str,
    names: tuple[str, ...],
    notes: tuple[str, ...],
    progress: Progress,
) -> Scene:
    """Return a scene of trees of solids, and of plain items and triangles beside them."""
    described: list[Described] = []
    n_items, n_primitives, slots = [], [], []
    dropped = 0
    for number, placed in enumerate(objects):
        progress.report(number, len(objects), "Taking trees of solids")
        mesh = placed.mesh
        if isinstance(mesh, Solids):
            described += [moved_node(item, placed.matrix) for item in mesh.items]
            leaves = [leaf for item in mesh.items for leaf in leaves_of(item)]
            counts = [len(leaf.triangles) if isinstance(leaf, ClosedMesh) else 1 for leaf in leaves]
            own = np.zeros(len(leaves), np.int64) if mesh.slots is None else np.array(mesh.slots)
            slots.append(np.repeat(own, counts))
            n_items.append(len(mesh.items))
        else:
            corners = _in_world(mesh, placed.matrix).astype(np.float64)
            usable = (np.abs(corners) < LARGEST).all(axis=(1, 2))
            described.append(mixed_of_triangles(corners[usable]))
            own = np.zeros(len(usable), np.int64) if mesh.slots is None else mesh.slots
            slots.append(own[usable])
            n_items.append(int(usable.sum()))
            dropped += int((~usable).sum())
        n_primitives.append(len(slots[-1]))
    progress.report(len(objects), len(objects), "Taking trees of solids")
    scene = Scene.from_trees(
        described, name, source, notes=notes, object_names=names,
        object_ids=np.repeat(np.arange(len(objects)), n_items),
    )  # fmt: skip
    has_corners = np.array([isinstance(each.mesh, Mesh) for each in objects])
    scene = dataclasses.replace(scene, dropped=dropped)
    return _surfaced(scene, objects, n_primitives, has_corners, slots)


def _surfaced(
    scene: Scene,
    objects: Sequence[PlacedMesh],
    counts: Sequence[int],
    in_world: np.ndarray,
    given_slots: Sequence[np.ndarray] = (),
) -> Scene:
    """Return a scene with the materials of its objects, and which of them are turned.

    Parameters
    ----------
    counts : sequence of int
        Items of each object.
    in_world : (n_objects,) bool
        Which of them have corners that were moved by their matrices.
    given_slots : sequence of (count,) int, optional
        Which of its object's materials each item is of; by default as meshes say.
    """
    first = np.cumsum([0, *counts])
    if in_world.any():
        with np.errstate(all="ignore"):
            turned = mirrors(np.array([each.matrix[:3] for each in objects])) & in_world
        if turned.any():
            of = scene.objects_of(np.arange(len(scene)))
            scene = dataclasses.replace(
                scene, turned=turned if scene.object_first is not None else turned[of]
            )
    if not any(each.materials for each in objects):
        return scene
    numbers: dict[Material, int] = {}
    begins: list[np.ndarray] = []
    ids: list[int] = []
    for number, (placed, begin, count) in enumerate(zip(objects, first, counts, strict=False)):
        if not count:
            continue
        slots = placed.mesh.slots if isinstance(placed.mesh, Mesh) else None
        slots = given_slots[number] if given_slots else slots
        slots = np.zeros(1, np.int64) if slots is None else np.asarray(slots, np.int64)
        runs = np.flatnonzero(np.diff(slots, prepend=-1))
        begins.append(begin + runs)
        for slot in slots[runs].tolist():
            # A slot that there is not is the last, as in Blender.
            made_of = (
                placed.materials[min(slot, len(placed.materials) - 1)] if placed.materials else MATT
            )
            ids.append(numbers.setdefault(made_of, len(numbers)))
    material_first = np.concatenate([*begins, first[-1:]])
    material_ids = np.array(ids, dtype=np.int32)
    scene = dataclasses.replace(scene, materials=tuple(numbers))
    if isinstance(scene.geometry, (Csg, Instanced)):
        return dataclasses.replace(scene, material_ids=material_ids, material_first=material_first)
    runs = np.searchsorted(material_first, scene.primitive_ids, side="right") - 1
    return dataclasses.replace(scene, material_ids=material_ids[runs])


def _kept(
    objects: Sequence[PlacedMesh], meshes: Sequence[Mesh], instances: str, progress: Progress
) -> _Kept | None:
    """Return instances, of the meshes of objects; None if they are better flattened.

    That is where a number is too large or none, for then triangles are dropped one by one, and
    where no ray could hit anything, for then it is said what is wrong with the triangles.
    """
    uses = Counter(map(id, meshes))
    matrices = np.array([placed.matrix[:3] for placed in objects])
    if not np.isfinite(matrices).all():
        return None
    _, is_singular = inverted(matrices)
    made = _Making()
    for owner, (placed, mesh) in enumerate(zip(objects, meshes, strict=True)):
        progress.report(owner, len(objects), "Taking meshes")
        place = matrices[owner]
        if not len(mesh.triangles):
            continue
        is_only = uses[id(mesh)] == 1 and instances == KEEP
        # Through a matrix that makes it flat no ray could be moved into a mesh.
        if is_only or (is_singular[owner] and place[:, :3].any()):
            world = _in_world(mesh, placed.matrix).astype(np.float64)
            if not _can_be_computed(world):
                return None
            if is_only or has_area(world):
                made.stands_there(world, owner, placed.descriptor)
                continue
        if not made.is_instance(mesh, place, owner, is_singular[owner], placed.descriptor):
            return None
    return made.kept(len(objects))


class _Making:
    """Instances in the making, in the order of the objects."""

    def __init__(self) -> None:
        self._meshes: list[np.ndarray] = []
        self._numbers: dict[int, int] = {}
        self._which: list[int] = []
        self._places: list[np.ndarray] = []
        self._owners: list[int] = []
        self._descriptors: list[InstanceSettings] = []
        self._in_world: list[int] = []
        self._is_seen = False
        self._waiting: list[np.ndarray] = []
        """Triangles of objects one after the other that stand in world space."""

    def stands_there(self, world: np.ndarray, owner: int, descriptor: InstanceSettings) -> None:
        """Add an object that is in one place only."""
        self._in_world.append(owner)
        if self._waiting and self._descriptors[-1] != descriptor:
            self._join()
        if not self._waiting:
            self._add(len(self._meshes), np.eye(3, 4), owner, descriptor)
            self._meshes.append(world)  # exchanged when all that follows is known
        self._waiting.append(world)

    def is_instance(
        self,
        mesh: Mesh,
        place: np.ndarray,
        owner: int,
        is_singular: np.bool_ | bool,
        descriptor: InstanceSettings,
    ) -> bool:
        """Add an object as an instance of its mesh; say whether that can be computed with."""
        self._join()
        if id(mesh) not in self._numbers:
            local = mesh.vertices[mesh.triangles].astype(np.float64)
            if not _can_be_computed(local):
                return False
            self._numbers[id(mesh)] = len(self._meshes)
            self._meshes.append(local)
        number = self._numbers[id(mesh)]
        self._is_seen = self._is_seen or (not is_singular and has_area(self._meshes[number]))
        self._add(number, place, owner, descriptor)
        return True

    def kept(self, n_objects: int) -> _Kept | None:
        """Return what has been added, if rays can hit it and it can be computed with."""
        self._join()
        if not self._is_seen:
            return None
        geometry = instanced(
            [all_triangles(mesh) for mesh in self._meshes], np.array(self._which),
            np.array(self._places), np.array([each.mask for each in self._descriptors]),
            instance_ids=np.array([each.id for each in self._descriptors]),
            hit_groups=np.array([each.hit_group for each in self._descriptors]),
            flags=np.array([each.flags for each in self._descriptors]),
        )  # fmt: skip
        boxes = geometry.boxes
        if not is_computable(boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)):
            return None
        in_world = np.zeros(n_objects, dtype=bool)
        in_world[self._in_world] = True
        return _Kept(geometry, np.array(self._owners, dtype=np.int32), in_world)

    def _add(
        self, number: int, place: np.ndarray, owner: int, descriptor: InstanceSettings
    ) -> None:
        self._which.append(number)
        self._places.append(place)
        self._owners.append(owner)
        self._descriptors.append(descriptor)

    def _join(self) -> None:
        """Make one mesh of those that stand in world space one after the other."""
        if self._waiting:
            self._meshes[-1] = np.concatenate(self._waiting)
            self._is_seen = self._is_seen or has_area(self._meshes[-1])
            self._waiting = []


def _can_be_computed(corners: np.ndarray) -> bool:
    """Say whether triangles can be computed with, all of them; those in one point are not hit."""
    lower, upper = extent(corners)
    is_point = np.array_equal(lower, upper) and bool((np.abs(lower) < LARGEST).all())
    return is_point or is_computable(lower, upper)
