"""CSG samples as objects: one for each solid, held together by Boolean modifiers.

The first operand is the object that is seen; the others are hidden, and drawn as wires where they
are shown. Each stands for its solid, so that what is built over is the tree of the sample, and not
the meshes that draw it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ...core.geometry.csg.description import (
    OPERATIONS,
    ClosedMesh,
    HalfSpace,
    Intersection,
    Node,
    Union,
)
from ...core.geometry.solids.description import Box, Cone, Item, Placed, Sphere
from ...sample_scenes.csg import Part, materials_of
from ..settings.solids import BOX, CONE, CYLINDER, SPHERE, settings_of
from .sample_materials import blender_material

UNIT_SPHERE, UNIT_BOX = Sphere((0, 0, 0), 1.0), Box((-1, -1, -1), (1, 1, 1))


class Solid:
    """A solid as an object stands for it: a unit solid through a matrix.

    Attributes
    ----------
    kind : str
        Of :mod:`..settings.solids`.
    unit : Item
    matrix : (4, 4) float64
    apex : float
    """

    def __init__(self, node: Node) -> None:
        outer = np.eye(4)
        if isinstance(node, Placed):
            outer[:3] = np.asarray(node.matrix, dtype=np.float64)
            node = node.solid
        inner, self.apex = np.eye(4), 0.0
        self.unit: Item = UNIT_SPHERE
        if isinstance(node, Sphere):
            self.kind = SPHERE
            inner[:3, :3] *= node.radius
            inner[:3, 3] = node.centre
        elif isinstance(node, Box):
            self.kind, self.unit = BOX, UNIT_BOX
            lower, upper = np.asarray(node.lower, float), np.asarray(node.upper, float)
            inner[:3, :3] = np.diag(0.5 * (upper - lower))
            inner[:3, 3] = 0.5 * (upper + lower)
        else:
            assert isinstance(node, Cone)
            low, high, wide, narrow = node.base, node.apex, node.base_radius, node.apex_radius
            if narrow > wide:
                low, high, wide, narrow = high, low, narrow, wide
            self.apex = narrow / wide
            self.kind = CYLINDER if self.apex == 1.0 else CONE
            self.unit = Cone((0, 0, -1), (0, 0, 1), 1.0, self.apex)
            axis = np.asarray(high, float) - np.asarray(low, float)
            height = float(np.linalg.norm(axis))
            z = axis / height
            x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
            x /= np.linalg.norm(x)
            inner[:3, 0], inner[:3, 1] = wide * x, wide * np.cross(z, x)
            inner[:3, 2] = 0.5 * axis
            inner[:3, 3] = 0.5 * (np.asarray(low, float) + np.asarray(high, float))
        self.matrix = outer @ inner


class Builder:
    """Makes the objects of parts.

    Parameters
    ----------
    collection : bpy.types.Collection
        Where they are put.
    layer : bpy.types.ViewLayer
    has_materials : bool
    """

    def __init__(
        self, collection: bpy.types.Collection, layer: bpy.types.ViewLayer, has_materials: bool
    ) -> None:
        self._collection, self._layer, self._has_materials = collection, layer, has_materials
        self._materials: dict[str, bpy.types.Material] = {}

    def add(self, part: Part) -> bpy.types.Object:
        """Add a part; return the object that stands for it."""
        self._leaf_materials: Iterator = iter(materials_of(part))
        return self._object_of(part.node, part.name, self._collection)

    def _object_of(
        self, node: Node, name: str, collection: bpy.types.Collection
    ) -> bpy.types.Object:
        if not isinstance(node, OPERATIONS):
            return self._leaf(node, name, collection)
        first, *others = node.operands
        obj = self._object_of(first, name, collection)
        operation = type(node)
        if operation is not Intersection:  # what is taken away, or added, together
            others = [leaf for each in others for leaf in flat(each)]
        modifier = obj.modifiers.new(operation.__name__, "BOOLEAN")
        modifier.operation = {"Union": "UNION", "Intersection": "INTERSECT"}.get(
            operation.__name__, "DIFFERENCE"
        )
        modifier.solver = "EXACT"
        into = bpy.data.collections.new(f"{name} {operation.__name__}")
        self._collection.children.link(into)
        for other in others:
            operand = self._object_of(other, f"{name} operand", into)
            operand.display_type = "WIRE"
            operand.hide_render = True
            operand.hide_set(True, view_layer=self._layer)
        if len(others) == 1:
            modifier.object = into.objects[0]
        else:
            modifier.operand_type, modifier.collection = "COLLECTION", into
        return obj

    def _leaf(self, node: Node, name: str, collection: bpy.types.Collection) -> bpy.types.Object:
        assert not isinstance(node, (*OPERATIONS, ClosedMesh, HalfSpace))
        # Imports Numba, which Blender's start does not wait for.
        from ...core.geometry.solids.making import mixed_of
        from ...core.geometry.solids.tessellation import tessellated
        from .sample_meshes import mesh_of

        solid = Solid(node)
        mesh = mesh_of(tessellated(mixed_of([solid.unit]))[0], name)
        obj = bpy.data.objects.new(name, mesh)
        collection.objects.link(obj)
        obj.matrix_world = Matrix(solid.matrix.tolist())
        group = settings_of(obj)
        group.kind = solid.kind
        group.size, group.centre, group.apex = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), solid.apex
        material = next(self._leaf_materials)
        if self._has_materials:
            if material.name not in self._materials:
                self._materials[material.name] = blender_material(material)
            mesh.materials.append(self._materials[material.name])
        return obj


def flat(node: Node) -> list[Node]:
    """Return the operands of unions within unions, which are those of one."""
    if not isinstance(node, Union):
        return [node]
    return [leaf for operand in node.operands for leaf in flat(operand)]


def add_parts(
    collection: bpy.types.Collection,
    layer: bpy.types.ViewLayer,
    parts: Sequence[Part],
    *,
    has_materials: bool,
) -> list[bpy.types.Object]:
    """Add the objects of parts to a collection; return those that stand for them."""
    builder = Builder(collection, layer, has_materials)
    return [builder.add(part) for part in parts]
