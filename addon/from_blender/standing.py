"""What objects of Blender's stand for: solids in place of the meshes they are drawn with.

An object stands for one solid by a property of its own (:mod:`..settings.solids`). A mesh that our
samples are drawn with stands for thousands: it carries their descriptions, and the hash of itself
as it was then. Whoever edits such a mesh wants what is seen, so from then on it is its triangles.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ...core.geometry.solids.description import Box, Cone, Item, Placed, Sphere
from ...core.geometry.solids.writing import from_json, to_json
from ..settings.solids import BOX, CONE, CYLINDER, ITSELF, SPHERE, settings_of
from .fingerprint import DIGEST_SIZE, hash_of
from .parts import Standing

ITEMS, DRAWN = "accelscope_items", "accelscope_drawn"
"""Custom properties of a mesh: descriptions of its items, and the hash of how it was drawn."""


def solid_of(obj: bpy.types.Object) -> Standing | None:
    """Return the solid that an object, as the user sees it, stands for; None for its mesh."""
    group: Any = settings_of(obj)
    if group.kind == ITSELF:
        return None
    matrix = np.zeros((3, 4))
    matrix[:, :3] = np.diag(group.size)
    matrix[:, 3] = group.centre
    unit: dict[str, Sphere | Box | Cone] = {
        SPHERE: Sphere((0.0, 0.0, 0.0), 1.0),
        BOX: Box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)),
        CYLINDER: Cone((0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 1.0, 1.0, group.is_capped),
        CONE: Cone((0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 1.0, group.apex, group.is_capped),
    }
    items = (Placed(unit[group.kind], matrix),)
    digest = hashlib.blake2b(to_json(items).encode(), digest_size=DIGEST_SIZE).digest()
    return Standing(items, digest)


def items_of(data: bpy.types.ID | None, digest: bytes) -> Standing | None:
    """Return the items that a mesh carries; None if it carries none, or looks otherwise by now.

    Parameters
    ----------
    data : bpy.types.ID
        As the user made it.
    digest : bytes
        Hash of what it has been evaluated to.
    """
    if data is None or data.get(DRAWN) != digest.hex():
        return None
    return Standing(tuple(from_json(data[ITEMS])), digest)


def carry(mesh: bpy.types.Mesh, items: Sequence[Item]) -> None:
    """Let a mesh stand for items that it draws."""
    mesh[ITEMS] = to_json(items)
    mesh[DRAWN] = hash_of(mesh).hex()
