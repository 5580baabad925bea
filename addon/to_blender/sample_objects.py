"""Sample objects: a core Scene as objects in Blender, with its camera and lights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...core.geometry.csg.trees import Csg
from ...core.geometry.instances import Instanced
from ...core.geometry.solids.mixed import Mixed
from ...core.scene import POINT, Camera, Scene
from ..from_blender import extraction
from ..from_blender.standing import carry
from .sample_materials import blender_material
from .sample_meshes import mesh_of
from .sample_trees import add_parts


def add_scene(
    owner: bpy.types.Scene,
    scene: Scene,
    label: str,
    items: Sequence[Any] | None = None,
    view_layer: bpy.types.ViewLayer | None = None,
    *,
    has_materials: bool = True,
) -> bpy.types.Collection:
    """Add a scene's objects to one of Blender's, in a collection of their own, and select them.

    Solids become meshes of triangles, to be seen; they carry the items that are built over.

    Parameters
    ----------
    label : str
        Name of the collection.
    items : sequence of Item or Part, optional
        Descriptions of the scene's items, if it has solids; of its parts, if it has trees.
    view_layer : bpy.types.ViewLayer, optional
        Where they are selected; by default the first of `owner`.
    has_materials : bool
        Whether objects are given their materials.
    """
    # Imports Numba, which Blender's start does not wait for.
    from ...core.geometry.solids.tessellation import tessellated

    collection = bpy.data.collections.new(label)
    owner.collection.children.link(collection)
    layer = view_layer or owner.view_layers[0]
    for obj in layer.objects.selected:
        obj.select_set(False, view_layer=layer)
    if isinstance(scene.geometry, Csg):
        for obj in add_parts(collection, layer, items or (), has_materials=has_materials):
            obj.select_set(True, view_layer=layer)
            layer.objects.active = obj
        _add_camera_and_lights(owner, collection, scene, label)
        return collection
    materials = [blender_material(each) for each in scene.materials if has_materials]
    if isinstance(scene.geometry, Instanced):
        for obj in _instances(scene, materials):
            collection.objects.link(obj)
            obj.select_set(True, view_layer=layer)
            layer.objects.active = obj
        _add_camera_and_lights(owner, collection, scene, label)
        return collection
    if isinstance(scene.geometry, Mixed):
        triangles, owners = tessellated(scene.geometry)
        object_ids = scene.object_ids[owners]
    else:
        triangles, object_ids = scene.triangles, scene.object_ids
    # An object of a sample is of one material.
    of_objects = np.zeros(len(scene.object_names), dtype=np.int64)
    of_objects[scene.object_ids] = scene.materials_of(np.arange(len(scene)))
    for number, name in enumerate(scene.object_names):
        mesh = mesh_of(triangles[object_ids == number], name)
        if items is not None:
            own = np.flatnonzero(scene.object_ids == number)
            carry(mesh, [items[place] for place in own.tolist()])
        if materials:
            mesh.materials.append(materials[of_objects[number]])
        obj = bpy.data.objects.new(name, mesh)
        collection.objects.link(obj)
        obj.select_set(True, view_layer=layer)
        layer.objects.active = obj
    _add_camera_and_lights(owner, collection, scene, label)
    return collection


def _instances(scene: Scene, materials: Sequence[bpy.types.Material]) -> Iterator[bpy.types.Object]:
    """Yield an object for each instance; those of one mesh share it, and so its materials.

    An instance that holds several objects, which stand in world space, is one.
    """
    geometry = scene.geometry
    names = [f"{scene.name} mesh {number}" for number in range(len(geometry.meshes))]
    meshes = [
        mesh_of(mesh.corners, name) for mesh, name in zip(geometry.meshes, names, strict=True)
    ]
    dressed: set[int] = set()
    for number, which in enumerate(geometry.which.tolist()):
        mesh, first = meshes[which], int(geometry.first[number])
        obj = bpy.data.objects.new(scene.object_of(first)[0], mesh)
        obj.matrix_world = Matrix([*geometry.matrices[number].tolist(), [0.0, 0.0, 0.0, 1.0]])
        primitives = np.arange(first, int(geometry.first[number + 1]))
        made_of = scene.materials_of(primitives)
        if materials and which not in dressed:
            dressed.add(which)
            own, slots = np.unique(made_of, return_inverse=True)
            for each in own:
                mesh.materials.append(materials[each])
            mesh.polygons.foreach_set("material_index", slots.astype(np.int32))
        elif len(mesh.materials) == 1 and mesh.materials[0] != materials[made_of[0]]:
            # Another one than the mesh has: the object's own.
            obj.material_slots[0].link = "OBJECT"
            obj.material_slots[0].material = materials[made_of[0]]
        yield obj


def _add_camera_and_lights(
    owner: bpy.types.Scene, collection: bpy.types.Collection, scene: Scene, label: str
) -> None:
    """Add a scene's camera, and its point lights."""
    if scene.camera:
        owner.camera = _add_camera(collection, scene.camera, scene.diagonal, label)
    for position in (light.position for light in scene.lights if light.kind == POINT):
        light = bpy.data.objects.new(f"{label} Light", bpy.data.lights.new(label, "POINT"))
        # Watts that light a surface at the scene's distance about as the default lamp does.
        light.data.energy = 30.0 * max(scene.diagonal, float(np.linalg.norm(position))) ** 2
        light.location = position
        collection.objects.link(light)


def hide_others(context: bpy.types.Context) -> list[str]:
    """Hide all objects that a build would take; return their names."""
    others = list(extraction.objects_in_scope(context.view_layer, extraction.VISIBLE))
    for obj in others:
        obj.hide_set(True, view_layer=context.view_layer)
    return [obj.name for obj in others]


def _add_camera(
    collection: bpy.types.Collection, camera: Camera, diagonal: float, label: str
) -> bpy.types.Object:
    """Add a camera object that sees what a pinhole camera sees."""
    data = bpy.data.cameras.new(label)
    data.angle = np.radians(camera.fov)
    data.clip_end = max(data.clip_end, 100.0 * diagonal)
    back = camera.position - camera.target
    back = back / np.linalg.norm(back)
    right = np.cross(camera.up, back)
    right /= np.linalg.norm(right)
    obj = bpy.data.objects.new(f"{label} Camera", data)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(back, right), back
    matrix[:3, 3] = camera.position
    obj.matrix_world = Matrix(matrix.tolist())
    collection.objects.link(obj)
    return obj
