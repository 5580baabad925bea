"""Extraction: the evaluated objects of a Blender scene as meshes in places.

Blender is read in its main thread, which stands still meanwhile. All that can be done without it
(cutting polygons, placing triangles, looking at them) is done by :class:`RawScene` in any thread.

Everything that Blender evaluates to a mesh is taken: meshes with their modifiers, curves, surfaces,
text and metaballs, and every instance of them. Blender lists all of those, curves too, as mesh
objects in ``depsgraph.object_instances``. Instances of collections, of geometry nodes and of
particles, and linked duplicates without modifiers, share one mesh there, and so they do here. What
stands for solids is taken as those.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.evaluation.records.environment import set_blender_version
from ...core.geometry.csg.settings import CuttingSettings
from ...core.geometry.instance_settings import InstanceSettings
from ...core.progress import SILENT, Progress
from ...core.reading import refuse_if_no_file
from ...core.scene import Scene
from ...core.scene.material import WHITE, Material
from ...core.scene.placing import KEEP, Mesh, PlacedMesh, Solids, scene_of
from ..settings import instances as instances_of_objects
from ..settings import solids
from ..standard_streams import others_kept_silent
from ..stopping import held
from .booleans import has_booleans, operands_only, tree_of
from .fingerprint import hash_of
from .materials import names_of_slots
from .mesh_check import (
    corner_vertices,
    invalid_meshes_emptied,
    refuse_if_evaluated,
    refuse_invalid_mesh,
    refuse_invalid_meshes,
)
from .parts import Key, LocalMesh, Part, Standing
from .standing import items_of, solid_of
from .view import View

VISIBLE = "visible"
SELECTED = "selected"
SCOPES = {
    VISIBLE: ("Visible", "All objects that are visible in the view layer"),
    SELECTED: ("Selected", "Selected objects only, and what they instance"),
}

GEOMETRY_TYPES = {"MESH", "CURVE", "CURVES", "SURFACE", "FONT", "META", "POINTCLOUD", "VOLUME"}
"""Types of objects that can evaluate to meshes, by geometry nodes at least."""


class ListedMesh(NamedTuple):
    """What Blender lists of a mesh in scope; `obj` only until it lists the next one."""

    key: Key
    name: str
    obj: bpy.types.Object
    matrix: np.ndarray  # (4, 4) float64, to world space
    descriptor: InstanceSettings


# ----------------------------------------------------------------------------- reading Blender


def collect(
    depsgraph: bpy.types.Depsgraph, scope: str, remarks: list[str] | None = None
) -> list[Part]:
    """Return every mesh in scope, or what it stands for, in the order of Blender's depsgraph.

    Parameters
    ----------
    scope : {"visible", "selected"}
    remarks : list of str, optional
        What is appended to it are sentences on objects that are no trees of solids, and why.

    Raises
    ------
    InputError
        When there is none with faces, or one is invalid.
    """
    parts = []
    known: dict[int, LocalMesh | Standing] = {}
    for found in meshes_in_scope(depsgraph, scope):
        solid = standing_of(found.obj.original, depsgraph)
        if isinstance(solid, str):
            if remarks is not None and solid not in remarks:
                remarks.append(solid)
        elif solid is not None:
            names = solid.materials or names_of_slots(found.obj, found.obj.data)
            parts.append(Part(found.key, found.name, solid, found.matrix, names, found.descriptor))
            continue
        address = found.obj.data.as_pointer()
        if address not in known:
            mesh = _read_mesh(found.obj)
            known[address] = items_of(found.obj.original.data, mesh.digest) or mesh
        if known[address].digest:  # those without faces have none
            names = names_of_slots(found.obj, found.obj.data)
            parts.append(
                Part(found.key, found.name, known[address], found.matrix, names, found.descriptor)
            )
    if not parts:
        if scope == SELECTED:
            raise InputError(
                "no mesh with faces is selected; select one, or set the scope to Visible"
            )
        raise InputError("no mesh with faces is visible; add or unhide one")
    return parts


def meshes_in_scope(depsgraph: bpy.types.Depsgraph, scope: str) -> Iterator[ListedMesh]:
    """Yield every mesh in scope, evaluated, those without faces too."""
    view_layer = depsgraph.view_layer
    left_out = operands_only(obj for obj in view_layer.objects if obj)
    for instance in depsgraph.object_instances:
        obj = instance.object
        # Instances come and go during the iteration: nothing of them is kept but copies.
        if obj.type != "MESH" or not instance.show_self:
            continue
        if obj.original.session_uid in left_out:
            continue
        source = instance.parent if instance.is_instance else obj
        if scope == SELECTED and not source.original.select_get(view_layer=view_layer):
            continue
        original, owner = obj.original, source.original
        itself = original == owner
        key = (0 if itself else owner.session_uid, original.session_uid)
        name = original.name if itself else f"{owner.name}/{original.name}"
        matrix = np.array(instance.matrix_world, dtype=np.float64, order="C")
        descriptor = instances_of_objects.descriptor_of(original, owner)
        yield ListedMesh(key, name, obj, matrix, descriptor)


def standing_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Standing | str | None:
    """Return what an object, as it was made, stands for: a tree, a solid; None if for nothing.

    Of one with Boolean modifiers that is no tree, why it is none, in words.
    """
    return tree_of(obj, depsgraph) if has_booleans(obj) else solid_of(obj)


def _read_mesh(obj: bpy.types.Object) -> LocalMesh:
    """Read the faces of an evaluated object."""
    # In edit mode the evaluated data are still in the editor's form; to_mesh() converts them, and
    # otherwise shares them without a copy.
    mesh = obj.to_mesh()
    try:
        refuse_invalid_mesh(mesh, obj.original.name)
        positions = np.empty((len(mesh.vertices), 3), dtype=np.float32)
        mesh.vertices.foreach_get("co", positions.ravel())
        corners = corner_vertices(mesh)
        sizes = np.full(len(mesh.polygons), 3, dtype=np.int32)
        if len(corners) != 3 * len(sizes):  # no face of Blender's has fewer corners
            mesh.polygons.foreach_get("loop_total", sizes)
        return LocalMesh(positions, corners, sizes, hash_of(mesh), _slots_of(mesh))
    finally:
        obj.to_mesh_clear()


def _slots_of(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """Return the material slot of each face; None if all are of the first."""
    if len(mesh.materials) < 2 or "material_index" not in mesh.attributes:
        return None
    slots = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    return slots if slots.any() else None


def has_members(view_layer: bpy.types.ViewLayer, scope: str) -> bool:
    """Say whether any object in scope may have geometry; cheap enough for a poll."""
    return next(objects_in_scope(view_layer, scope), None) is not None


def may_have_geometry(obj: bpy.types.Object) -> bool:
    """Say whether an object may evaluate to meshes, or instance something that does."""
    return obj.type in GEOMETRY_TYPES or obj.instance_type != "NONE"


def objects_in_scope(view_layer: bpy.types.ViewLayer, scope: str) -> Iterator[bpy.types.Object]:
    """Yield the objects in scope that may have geometry."""
    for obj in view_layer.objects:
        if not may_have_geometry(obj) or not obj.visible_get(view_layer=view_layer):
            continue
        if scope == VISIBLE or obj.select_get(view_layer=view_layer):
            yield obj


# ---------------------------------------------------------------------------- making the scene


class RawScene(NamedTuple):
    """A scene as Blender has it; to be made one of ours, for which Blender is not needed.

    Attributes
    ----------
    parts : list of Part
    name, source : str
        See :class:`...core.scene.Scene`.
    view : View
    instances : {"keep", "objects", "flatten"}
        What becomes of them, see :mod:`...core.scene.placing`.
    remarks : tuple of str
        On objects that could not be read as what they are.
    cutting : CuttingSettings
        How trees of solids are bounded.
    """

    parts: list[Part]
    name: str
    source: str
    view: View
    instances: str
    remarks: tuple[str, ...] = ()
    cutting: CuttingSettings = CuttingSettings()

    @classmethod
    def at(cls, context: bpy.types.Context, scope: str, instances: str) -> RawScene:
        """Return the scene that is open in Blender now.

        Parameters
        ----------
        scope : {"visible", "selected"}
        instances : {"keep", "objects", "flatten"}

        Raises
        ------
        InputError
            When there is no mesh with faces, or one is invalid.
        """
        refuse_invalid_meshes(context.view_layer)
        remarks: list[str] = []
        parts = collect(context.evaluated_depsgraph_get(), scope, remarks)
        path = bpy.data.filepath
        name = Path(path).stem if path else context.scene.name
        source = path or "unsaved Blender file"
        return cls(parts, name, source, View.of(context), instances, tuple(remarks))

    def shape(self, progress: Progress = SILENT) -> Scene:
        """Return what rays can hit; every instance is an object of its own.

        Raises
        ------
        InputError
            When there is no triangle that a ray could hit, or too many for the memory.
        Cancelled
            From `progress`.
        """
        # Its kernels need Numba, which is not to be loaded before somebody measures.
        from ...core.geometry.triangulation import CUTTING, triangulate
        from ...core.kernels import announcing

        cut: dict[int, Mesh | Solids] = {}  # of meshes, which live as long as their parts
        objects = []
        for number, part in enumerate(self.parts):
            progress.report(number, len(self.parts), "Cutting polygons")
            mesh = part.mesh
            if isinstance(mesh, Standing):
                cut[id(mesh)] = Solids(mesh.items, mesh.slots)
            elif id(mesh) not in cut:
                # Not Blender's own triangles: those of files are cut in the same way as these.
                with announcing(progress, CUTTING):
                    triangles = triangulate(mesh.positions, mesh.corners, mesh.sizes)
                slots = None if mesh.slots is None else np.repeat(mesh.slots, mesh.sizes - 2)
                cut[id(mesh)] = Mesh(mesh.positions, triangles, slots)
            # What they are made of is put in their places by View.onto.
            materials = tuple(Material(name, WHITE) for name in part.materials)
            objects.append(
                PlacedMesh(part.name, cut[id(mesh)], part.matrix, materials, part.descriptor)
            )
        return scene_of(
            objects, self.instances, self.name, self.source,
            notes=self.remarks, advice="hide some objects", progress=progress,
        ).with_cutting(self.cutting)  # fmt: skip


def extract(context: bpy.types.Context, scope: str, instances: str = KEEP) -> Scene:
    """Return the scene that is open in Blender, for the command line.

    Parameters
    ----------
    scope : {"visible", "selected"}
    instances : {"keep", "objects", "flatten"}

    Raises
    ------
    InputError
        When there is no triangle that a ray could hit, or too many for the memory, or a mesh is
        invalid.
    """
    with held(), others_kept_silent():
        raw = RawScene.at(context, scope, instances)
    return raw.view.onto(raw.shape())


# ------------------------------------------------------------------------------ a file by its path


def load_blend(path: str | Path, instances: str = KEEP) -> Scene:
    """Open a .blend in this Blender and return its visible scene.

    Parameters
    ----------
    instances : {"keep", "objects", "flatten"}

    Raises
    ------
    InputError
        When the file is missing or unreadable, a mesh of it is invalid, or it has nothing that a
        ray could hit.
    """
    set_blender_version(bpy.app.version_string)
    solids.register()
    instances_of_objects.register()
    path = Path(path)
    refuse_if_no_file(path)
    try:
        # No scripts: a file to be measured is not trusted to run anything. That is in the notes.
        with held(), others_kept_silent(), invalid_meshes_emptied() as faults:
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
            refuse_if_evaluated(bpy.context.evaluated_depsgraph_get(), faults)
    except RuntimeError as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ")
        raise InputError(f"{path} cannot be read: {reason}") from None
    return extract(bpy.context, VISIBLE, instances)
