"""What objects stand for: a property of every object, ``object.accelscope_solid``.

An object of Blender's is drawn as its mesh, and may stand for a ball or a cylinder, which rays then
meet as what it is and not as the triangles that it is drawn with.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.props import PointerProperty

from ...core.settings import setting
from .generated import condition_of, group_type, property_of

NAME = "accelscope_solid"

ITSELF, SPHERE, BOX, CYLINDER, CONE = "itself", "sphere", "box", "cylinder", "cone"

ROUND_AXES = {SPHERE: [0, 1, 2], CYLINDER: [0, 1], CONE: [0, 1]}
"""Axes along which a solid has one width, unless it is made oval on purpose."""

NEARLY = 0.15
"""Share by which the box of a mesh may be off that is meant to be round and in the middle: a circle
of five sides lies a tenth beside the middle of its box."""


@dataclass(frozen=True)
class SolidSettings:
    """What an object stands for, in its own space; its transform moves, turns and scales it."""

    kind: str = setting(
        ITSELF, "Stands For", "What rays meet in place of this object's mesh",
        choices={
            ITSELF: "The triangles of its mesh",
            SPHERE: "A sphere; an ellipsoid where it is scaled unevenly",
            BOX: "A box",
            CYLINDER: "A cylinder along the object's z axis",
            CONE: "A cone along the object's z axis, truncated or not",
        },
    )  # fmt: skip
    size: tuple[float, float, float] = setting(
        (1.0, 1.0, 1.0), "Half Size",
        "Half the width along each of the object's axes. Choosing what the object stands for takes "
        "that of its mesh", minimum=0.0, only_for={"kind": (SPHERE, BOX, CYLINDER, CONE)},
    )  # fmt: skip
    centre: tuple[float, float, float] = setting(
        (0.0, 0.0, 0.0), "Centre", "Middle of the solid in the object's own space",
        only_for={"kind": (SPHERE, BOX, CYLINDER, CONE)},
    )  # fmt: skip
    apex: float = setting(
        0.0, "Apex Radius", "Radius of the upper end, as a share of that of the lower end",
        minimum=0.0, maximum=1.0, only_for={"kind": (CONE,)},
    )  # fmt: skip
    is_capped: bool = setting(
        True, "End Caps", "Whether the ends are closed by discs",
        only_for={"kind": (CYLINDER, CONE)},
    )  # fmt: skip


def _evaluate_anew(group: Any, context: bpy.types.Context) -> None:
    # So that whoever watches the object looks at it.
    group.id_data.update_tag()


def _fit_to_mesh(group: Any, context: bpy.types.Context) -> None:
    """Take the size of the object's mesh, since that is what the user sees."""
    size, centre = fitted(np.array(group.id_data.bound_box), group.kind)
    if group.kind != ITSELF and size.any():
        group.size, group.centre = size, centre
    _evaluate_anew(group, context)


def fitted(corners: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return half size and centre, (3,) each, of a solid in place of what has a box.

    Parameters
    ----------
    corners : (8, 3) float
    """
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    size, centre = 0.5 * (upper - lower), 0.5 * (upper + lower)
    axes = ROUND_AXES.get(kind, [])
    widest = size[axes].max(initial=0.0)
    if axes and size[axes].min() >= (1.0 - NEARLY) * widest:
        size[axes] = widest
    centre[np.abs(centre) < NEARLY * size] = 0.0
    return size, centre


_registered: list[type] = []


def register() -> None:
    """Give objects the property, if they have it not yet: the command line needs no more of us."""
    if _registered:
        return
    updates = {"kind": _fit_to_mesh}
    group = group_type(
        "solid",
        {
            field.name: property_of(
                field,
                condition_of(field, SolidSettings),
                update=updates.get(field.name, _evaluate_anew),
            )
            for field in dataclasses.fields(SolidSettings)
        },
    )
    bpy.utils.register_class(group)
    _registered.append(group)
    setattr(bpy.types.Object, NAME, PointerProperty(type=group))


def unregister() -> None:
    """Take it away; the values stay in the file."""
    if _registered:
        delattr(bpy.types.Object, NAME)
        bpy.utils.unregister_class(_registered.pop())


def settings_of(obj: bpy.types.Object) -> Any:
    """Return the property group of an object."""
    return getattr(obj, NAME)
