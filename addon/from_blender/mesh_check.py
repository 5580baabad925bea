"""Meshes that are no meshes: Blender opens them, and ends where it follows their indices.

Files of broken exporters and scripts have faces with vertices that do not exist. Modifiers and
Blender's own triangulation read beyond the end of an array there. So a file that we open is looked
at before Blender evaluates it, and what came of evaluation before it is triangulated.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...core.errors import InputError

FEWEST_CORNERS = 3


def refuse_invalid_meshes(view_layer: bpy.types.ViewLayer) -> None:
    """Look at the meshes of all visible objects and of what they instance, as they were made.

    Raises
    ------
    InputError
        Naming the first object whose mesh is invalid.
    """
    checked: set[int] = set()
    # One that has just been removed is None until Blender has evaluated the scene.
    waiting = [obj for obj in view_layer.objects if obj and obj.visible_get(view_layer=view_layer)]
    seen = {obj.session_uid for obj in waiting}
    while waiting:
        obj = waiting.pop()
        if obj.type == "MESH" and not obj.data.is_editmode and obj.data.session_uid not in checked:
            checked.add(obj.data.session_uid)
            refuse_invalid_mesh(obj.data, obj.name)
        if obj.instance_type == "COLLECTION" and obj.instance_collection:
            for each in obj.instance_collection.all_objects:
                if each.session_uid not in seen:
                    seen.add(each.session_uid)
                    waiting.append(each)


def refuse_invalid_mesh(mesh: bpy.types.Mesh, name: str) -> None:
    """Raise InputError if a face of the mesh names a vertex or corner that is not there.

    Parameters
    ----------
    name : str
        Of the object, for the message.
    """
    fault = fault_of(mesh)
    if fault:
        raise _refusal(mesh, name, fault)


def _refusal(mesh: bpy.types.Mesh, name: str, fault: str) -> InputError:
    # In this order: entering edit mode with such a mesh ends Blender, too.
    return InputError(
        f"the mesh of {name} is invalid: {fault}; repair it in Blender: "
        f"bpy.data.meshes[{mesh.name!r}].validate() in the Python Console, then Mesh > Clean Up",
        name,
    )


@contextlib.contextmanager
def invalid_meshes_emptied() -> Iterator[dict[int, str]]:
    """Empty the invalid meshes of a file that is opened meanwhile, before they are evaluated.

    Yields
    ------
    dict of int to str
        What was wrong with them, by session id. :func:`refuse_if_evaluated` takes it.
    """
    faults: dict[int, str] = {}

    @persistent
    def look(*_: object) -> None:
        for mesh in bpy.data.meshes:
            if fault := fault_of(mesh):
                faults[mesh.session_uid] = fault
                mesh.clear_geometry()

    bpy.app.handlers.load_post.append(look)
    try:
        yield faults
    finally:
        bpy.app.handlers.load_post.remove(look)


def refuse_if_evaluated(depsgraph: bpy.types.Depsgraph, faults: dict[int, str]) -> None:
    """Raise InputError if a mesh with one of these faults has a part in what is visible."""
    for each in depsgraph.ids if faults else ():
        mesh = each.original
        if isinstance(mesh, bpy.types.Mesh) and mesh.session_uid in faults:
            users = (obj.name for obj in bpy.data.objects if obj.data == mesh)
            raise _refusal(mesh, next(users, mesh.name), faults[mesh.session_uid])


def fault_of(mesh: bpy.types.Mesh) -> str:
    """Say what is wrong with the arrays of a mesh, which is not in edit mode; empty if nothing."""
    vertices, faces = len(mesh.vertices), len(mesh.polygons)
    corners = corner_vertices(mesh)
    if len(corners) and not (corners.min() >= 0 and corners.max() < vertices):
        bad = corners[(corners < 0) | (corners >= vertices)][0]
        return f"a face names vertex {bad} of {vertices}"
    starts = np.empty(faces, dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    # Faces lie one behind the other: each ends where the next one begins.
    bounds = np.append(starts, len(corners)).astype(np.int64)
    if faces and (bounds[0] != 0 or (np.diff(bounds) < FEWEST_CORNERS).any()):
        return f"a face has fewer than {FEWEST_CORNERS} corners, or none of its own"
    return ""


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return the vertex of every corner of every face, (n,) int32."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    attribute = mesh.attributes.get(".corner_vert")
    if attribute is not None:  # a copy of the array, a hundred times faster than asking each corner
        attribute.data.foreach_get("value", corners)
    else:
        mesh.loops.foreach_get("vertex_index", corners)
    return corners
