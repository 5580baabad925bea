"""What objects say of themselves as instances: a property of each, ``object.accelscope_instance``.

An object that others are instances of may say it as well as the one that instances it, such as an
empty with a collection. What the latter says counts, if it says anything.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import bpy
from bpy.props import PointerProperty

from ...core.geometry.instance_settings import PLAIN, InstanceSettings
from .generated import group_type, properties_of

NAME = "accelscope_instance"

_registered: list[type] = []


def _evaluate_anew(group: Any, context: bpy.types.Context) -> None:
    # So that whoever watches the object looks at it.
    group.id_data.update_tag()


def register() -> None:
    """Give objects the property, if they have it not yet: the command line needs no more of us."""
    if _registered:
        return
    group = group_type("instance", properties_of(InstanceSettings, update=_evaluate_anew))
    bpy.utils.register_class(group)
    _registered.append(group)
    setattr(bpy.types.Object, NAME, PointerProperty(type=group))


def unregister() -> None:
    """Take it away; the values stay in the file."""
    if _registered:
        delattr(bpy.types.Object, NAME)
        bpy.utils.unregister_class(_registered.pop())


def descriptor_of(obj: bpy.types.Object, owner: bpy.types.Object) -> InstanceSettings:
    """Return what an object says of itself, or the one that instances it, if that says anything."""
    said = _said_by(owner)
    return said if said != PLAIN else _said_by(obj)


def _said_by(obj: bpy.types.Object) -> InstanceSettings:
    group = getattr(obj, NAME)
    return InstanceSettings(
        **{field.name: getattr(group, field.name) for field in dataclasses.fields(InstanceSettings)}
    )
