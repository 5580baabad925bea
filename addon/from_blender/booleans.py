"""Trees of solids (CSG) from Boolean modifiers.

An object with Boolean modifiers, and with no others, is a tree: its own shape, then an operation
for each modifier. Its shape is the solid that it stands for, or its mesh if that is closed. So it
is with operands, which may have Boolean modifiers themselves; what other modifiers make of an
operand is taken as a closed mesh. Of a collection each object is an operand.

What cannot be read so is its evaluated mesh, as it is without us, and a sentence says why.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from ...core.geometry.csg.description import (
    ClosedMesh,
    Difference,
    Intersection,
    Node,
    Union,
    moved_node,
)
from ..settings.solids import ITSELF, settings_of
from .fingerprint import DIGEST_SIZE, hash_of
from .materials import names_of_slots
from .parts import Standing

OPERATIONS = {"UNION": Union, "INTERSECT": Intersection, "DIFFERENCE": Difference}

ONLY_DRAWN = "WIRE", "BOUNDS"
"""How objects are displayed that are there as operands alone."""


class CannotBeReadError(Exception):
    """Why an object is no tree, in words that follow its name."""


@dataclass
class Reading:
    """What was read of one object.

    Attributes
    ----------
    depsgraph : bpy.types.Depsgraph
    materials : list of str
        Of each leaf, "" for none.
    digest : hashlib.blake2b
    above : list of str
        Names of the objects that are being read, from the one that has been asked for.
    """

    depsgraph: bpy.types.Depsgraph
    materials: list[str] = field(default_factory=list)
    digest: Any = field(default_factory=lambda: hashlib.blake2b(digest_size=DIGEST_SIZE))
    above: list[str] = field(default_factory=list)

    def node_of(self, obj: bpy.types.Object) -> Node:
        """Return the tree of an object, as it was made, in its own space.

        Raises
        ------
        CannotBeReadError
        """
        if obj.name_full in self.above:
            raise CannotBeReadError(f"{obj.name} is taken away from itself")
        self.above.append(obj.name_full)
        others = [each for each in modifiers_of(obj) if each.type != "BOOLEAN"]
        booleans = [each for each in modifiers_of(obj) if each.type == "BOOLEAN"]
        if others and len(self.above) == 1:
            name = others[0].name
            raise CannotBeReadError(
                f"the modifier {name} stands beside its Boolean ones, so that its evaluated mesh "
                "is taken"
            )
        node: Any = self._shape_of(obj, is_evaluated=bool(others))
        for modifier in () if others else booleans:
            operands = [
                moved_node(self.node_of(operand), self._way(obj, operand))
                for operand in operands_of(modifier)
            ]
            self.digest.update(f"{modifier.operation} {len(operands)} ".encode())
            if operands:
                node = OPERATIONS[modifier.operation]([node, *operands])
        self.above.pop()
        return node

    def _way(self, obj: bpy.types.Object, operand: bpy.types.Object) -> np.ndarray:
        """Return the matrix from an operand's space to that of the object it belongs to."""
        here, there = (
            np.array(each.evaluated_get(self.depsgraph).matrix_world, dtype=np.float64)
            for each in (obj, operand)
        )
        try:
            way = np.linalg.solve(here, there)
        except np.linalg.LinAlgError:
            raise CannotBeReadError(
                "its scale is zero, so that its evaluated mesh is taken"
            ) from None
        self.digest.update((way + 0.0).tobytes())
        return way

    def _shape_of(self, obj: bpy.types.Object, *, is_evaluated: bool) -> Node:
        """Return the leaf that an object is without its Boolean modifiers."""
        # As the user made it, an object has its materials; its mesh may be one that others share.
        names = names_of_slots(obj, obj.data) if obj.data else ()
        # What has no material of its own is of that of the object it belongs to.
        above = self.materials[0] if self.materials else ""
        self.materials.append(next((name for name in names if name), above))
        if settings_of(obj).kind != ITSELF and not is_evaluated:
            from .standing import solid_of

            standing = solid_of(obj)
            assert standing is not None
            self.digest.update(standing.digest)
            if not settings_of(obj).is_capped and settings_of(obj).kind in ("cylinder", "cone"):
                raise CannotBeReadError(
                    f"{obj.name} stands for an open {settings_of(obj).kind}; close its ends"
                )
            return standing.items[0]
        return self._mesh_of(obj, is_evaluated=is_evaluated)

    def _mesh_of(self, obj: bpy.types.Object, *, is_evaluated: bool) -> ClosedMesh:
        """Return the mesh of an object: as other modifiers make it, or as it was made."""
        source = obj.evaluated_get(self.depsgraph) if is_evaluated else obj
        if obj.type != "MESH":
            source = obj.evaluated_get(self.depsgraph)
        mesh = source.to_mesh()
        try:
            if mesh is None or not len(mesh.polygons):
                raise CannotBeReadError(f"{obj.name} has no faces")
            edges = np.empty(len(mesh.loops), np.int32)
            mesh.loops.foreach_get("edge_index", edges)
            n_open = int((np.bincount(edges) % 2 == 1).sum())
            if n_open:
                raise CannotBeReadError(
                    f"the mesh of {obj.name} is open: {n_open} of its {len(mesh.edges)} edges "
                    f"{'has' if n_open == 1 else 'have'} an odd number of faces, so that the "
                    "evaluated mesh is taken"
                )
            self.digest.update(hash_of(mesh))
            mesh.calc_loop_triangles()
            positions = np.empty((len(mesh.vertices), 3), np.float32)
            mesh.vertices.foreach_get("co", positions.ravel())
            triangles = np.empty((len(mesh.loop_triangles), 3), np.int32)
            mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
            return ClosedMesh(positions.astype(np.float64), triangles)
        finally:
            source.to_mesh_clear()


def modifiers_of(obj: bpy.types.Object) -> list[bpy.types.Modifier]:
    """Return the modifiers of an object that are on."""
    return [each for each in obj.modifiers if each.show_viewport]


def operands_of(modifier: bpy.types.BooleanModifier) -> list[bpy.types.Object]:
    """Return the objects of a Boolean modifier."""
    if modifier.operand_type == "OBJECT":
        return [] if modifier.object is None else [modifier.object]
    if modifier.collection is None:
        return []
    return [each for each in modifier.collection.all_objects if each.type == "MESH"]


def has_booleans(obj: bpy.types.Object) -> bool:
    """Say whether an object, as it was made, has Boolean modifiers that do something."""
    return obj.type == "MESH" and any(
        each.type == "BOOLEAN" and operands_of(each) for each in modifiers_of(obj)
    )


def tree_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Standing | str:
    """Return the tree of an object that has Boolean modifiers; or why it cannot be read, in words.

    Parameters
    ----------
    obj : bpy.types.Object
        As it was made.
    """
    reading = Reading(depsgraph)
    try:
        node = reading.node_of(obj)
    except CannotBeReadError as error:
        return f"{obj.name}: {error}"
    numbers = {name: number for number, name in enumerate(dict.fromkeys(reading.materials))}
    slots = tuple(numbers[name] for name in reading.materials)
    return Standing((node,), reading.digest.digest(), tuple(numbers), slots)


def operands_only(
    objects: Iterator[bpy.types.Object],
) -> set[int]:
    """Return the session ids of operands that are displayed as wires or bounds only.

    They are there for what is taken away, and are no objects of their own.
    """
    found: set[int] = set()
    waiting = [each for each in objects if has_booleans(each)]
    seen = {each.session_uid for each in waiting}
    while waiting:
        for modifier in modifiers_of(waiting.pop()):
            for operand in operands_of(modifier) if modifier.type == "BOOLEAN" else ():
                if operand.display_type in ONLY_DRAWN:
                    found.add(operand.session_uid)
                if operand.session_uid not in seen:
                    seen.add(operand.session_uid)
                    waiting.append(operand)
    return found
