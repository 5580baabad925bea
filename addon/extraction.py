"""Extraction: the evaluated objects of a Blender scene as triangles in world space.

Everything that Blender evaluates to a mesh is taken: meshes with their modifiers, curves, surfaces,
text and metaballs, and every instance of them. Blender lists all of those, curves too, as mesh
objects in ``depsgraph.object_instances``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from ..core.errors import InputError
from ..core.evaluation.environment import set_blender_version
from ..core.memory import refuse_if_too_large
from ..core.scene import Scene
from .cameras import camera_of
from .fingerprint import hash_of
from .lights import lights_of
from .mesh_check import (
    invalid_meshes_emptied,
    refuse_if_evaluated,
    refuse_invalid_mesh,
    refuse_invalid_meshes,
)
from .remarks import remarks_of
from .standard_streams import standard_output_kept_clean

VISIBLE = "visible"
SELECTED = "selected"
SCOPES = {
    VISIBLE: ("Visible", "All objects that are visible in the view layer"),
    SELECTED: ("Selected", "Selected objects only, and what they instance"),
}

GEOMETRY_TYPES = {"MESH", "CURVE", "CURVES", "SURFACE", "FONT", "META", "POINTCLOUD", "VOLUME"}
"""Types of objects that can evaluate to meshes, by geometry nodes at least."""

BYTES_PER_TRIANGLE = 300  # at the peak of extracting

Key = tuple[int, int]
"""Identity of what a part comes from: session ids of the instancing object (0 if there is none)
and of the object itself. They survive renaming and undo."""


class LocalMesh(NamedTuple):
    """The triangles of one evaluated mesh in its own space.

    Attributes
    ----------
    positions : (n_vertices, 3) float32
    corners : (n, 3) int32
        Vertex indices of the triangles.
    digest : bytes
        See :func:`.fingerprint.hash_of`.
    """

    positions: np.ndarray
    corners: np.ndarray
    digest: bytes


@dataclass(frozen=True)
class Part:
    """One mesh in the scene: an object, or one instance of it."""

    key: Key
    name: str
    mesh: LocalMesh
    matrix: np.ndarray  # (4, 4) float64, to world space


class Found(NamedTuple):
    """What Blender lists of a mesh in scope; `obj` only until it lists the next one."""

    key: Key
    name: str
    obj: bpy.types.Object
    matrix: np.ndarray  # (4, 4) float64, to world space


# ----------------------------------------------------------------------------- reading Blender


def collect(depsgraph: bpy.types.Depsgraph, scope: str) -> list[Part]:
    """Return every mesh in scope, evaluated, in the order of Blender's depsgraph.

    Parameters
    ----------
    scope : {"visible", "selected"}

    Raises
    ------
    InputError
        When there is none with faces, or one is invalid.
    """
    parts = []
    known: dict[int, LocalMesh] = {}
    for found in meshes_in_scope(depsgraph, scope):
        address = found.obj.data.as_pointer()
        if address not in known:
            known[address] = _read_mesh(found.obj)
        if len(known[address].corners):
            parts.append(Part(found.key, found.name, known[address], found.matrix))
    if not parts:
        if scope == SELECTED:
            raise InputError(
                "no mesh with faces is selected; select one, or set the scope to Visible"
            )
        raise InputError("no mesh with faces is visible; add or unhide one")
    return parts


def meshes_in_scope(depsgraph: bpy.types.Depsgraph, scope: str) -> Iterator[Found]:
    """Yield every mesh in scope, evaluated, those without faces too."""
    view_layer = depsgraph.view_layer
    for instance in depsgraph.object_instances:
        obj = instance.object
        # Instances come and go during the iteration: nothing of them is kept but copies.
        if obj.type != "MESH" or not instance.show_self:
            continue
        source = instance.parent if instance.is_instance else obj
        if scope == SELECTED and not source.original.select_get(view_layer=view_layer):
            continue
        original, owner = obj.original, source.original
        itself = original == owner
        key = (0 if itself else owner.session_uid, original.session_uid)
        name = original.name if itself else f"{owner.name}/{original.name}"
        matrix = np.array(instance.matrix_world, dtype=np.float64, order="C")
        yield Found(key, name, obj, matrix)


def _read_mesh(obj: bpy.types.Object) -> LocalMesh:
    """Read the triangles of an evaluated object."""
    # Its kernels need Numba, which is not to be loaded before somebody measures.
    from ..core.geometry.triangulation import triangulate

    # In edit mode the evaluated data are still in the editor's form; to_mesh() converts them, and
    # otherwise shares them without a copy.
    mesh = obj.to_mesh()
    try:
        refuse_invalid_mesh(mesh, obj.original.name)
        positions = np.empty((len(mesh.vertices), 3), dtype=np.float32)
        mesh.vertices.foreach_get("co", positions.ravel())
        # Not Blender's own triangles: those of files are cut in the same way as these.
        outline = np.empty(len(mesh.loops), dtype=np.int32)
        if len(outline):
            mesh.attributes[".corner_vert"].data.foreach_get("value", outline)
        sizes = np.full(len(mesh.polygons), 3, dtype=np.int32)
        if len(outline) != 3 * len(sizes):  # no face of Blender's has fewer corners
            mesh.polygons.foreach_get("loop_total", sizes)
        return LocalMesh(positions, triangulate(positions, outline, sizes), hash_of(mesh))
    finally:
        obj.to_mesh_clear()


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


def extract(context: bpy.types.Context, scope: str) -> Scene:
    """Return the scene that is open in Blender.

    Parameters
    ----------
    scope : {"visible", "selected"}

    Raises
    ------
    InputError
        When there is no triangle that a ray could hit, or too many for the memory, or a mesh is
        invalid.
    """
    refuse_invalid_meshes(context.view_layer)
    return scene_of(context, collect(context.evaluated_depsgraph_get(), scope))


def scene_of(context: bpy.types.Context, parts: list[Part]) -> Scene:
    """Return parts as one scene: instances are expanded, each an object of its own.

    Raises
    ------
    InputError
        When there is no triangle that a ray could hit, or too many for the memory.
    """
    counts = [len(part.mesh.corners) for part in parts]
    total = sum(counts)
    refuse_if_too_large(
        total * BYTES_PER_TRIANGLE, f"a scene of {total} triangles", "hide some objects"
    )
    triangles = np.empty((total, 3, 3))
    first = 0
    for part, count in zip(parts, counts, strict=True):
        # Infinite coordinates turn into NaN here; such triangles are dropped in any case.
        with np.errstate(invalid="ignore", over="ignore"):
            world = part.mesh.positions @ part.matrix[:3, :3].T + part.matrix[:3, 3]
        triangles[first : first + count] = world[part.mesh.corners]
        first += count
    path = bpy.data.filepath
    scene = Scene.from_triangles(
        triangles,
        Path(path).stem if path else context.scene.name,
        path or "unsaved Blender file",
        object_ids=np.repeat(np.arange(len(parts), dtype=np.int32), counts),
        object_names=tuple(part.name for part in parts),
    )
    return with_view(scene, context)


def with_view(scene: Scene, context: bpy.types.Context) -> Scene:
    """Return a scene with the camera and lights as they are now, and what is to be said of them."""
    seen = dataclasses.replace(scene, camera=camera_of(context), lights=lights_of(context))
    return dataclasses.replace(seen, notes=remarks_of(context, seen))


# ------------------------------------------------------------------------------ a file by its path


def load_blend(path: str | Path) -> Scene:
    """Open a .blend in this Blender and return its visible scene.

    Raises
    ------
    InputError
        When the file is missing or unreadable, a mesh of it is invalid, or it has nothing that a
        ray could hit.
    """
    set_blender_version(bpy.app.version_string)
    path = Path(path).expanduser()
    if not path.is_file():
        raise InputError(f"there is no file {path}")
    try:
        # No scripts: a file to be measured is not trusted to run anything.
        with standard_output_kept_clean(), invalid_meshes_emptied() as faults:
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ")
        raise InputError(f"{path} cannot be read: {reason}") from None
    refuse_if_evaluated(bpy.context.evaluated_depsgraph_get(), faults)
    return extract(bpy.context, VISIBLE)
