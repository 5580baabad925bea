"""Blender properties generated from the settings dataclasses, and read back into them.

The dataclasses of structures, workloads and sample scenes are the only source of a setting.
"""

from __future__ import annotations

import dataclasses
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)

from ...core.settings import check

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T", bound="DataclassInstance")

INT_LIMIT = 2**31 - 1
FLOAT_LIMIT = float(np.finfo(np.float32).max)

NAMES = {"bsp": "BSP Tree", "bvh": "BVH", "grid": "Uniform Grid", "kdtree": "kd-Tree",
         "macro_grid": "Grid with Macro-Cells"}  # fmt: skip
"""What structures are called that are not called by their words."""

SMALL = "and", "of", "on", "or"
"""Words that titles do not capitalise."""

ACRONYMS = "aabb", "fifo", "hlbvh", "lbvh", "obb", "phr", "ploc", "sah", "sbvh", "str"
"""Words of choices that are written in capitals."""


def name_of(key: str) -> str:
    """Return what a choice is called in the panel: ``"binned_sah"`` is ``"Binned SAH"``.

    Symbols such as ``"N_TS"`` stay as they are.
    """
    if not key.islower() and not key[:1].isdigit():
        return key
    return NAMES.get(key) or " ".join(map(_word, key.split("_")))


def _word(word: str) -> str:
    """Return a word of a choice as titles write it."""
    if word.startswith("kdop"):
        return f"{word.removeprefix('kdop')}-DOP"
    if word in ACRONYMS:
        return word.upper()
    if word == "rtree":
        return "R-tree"
    return word if word in SMALL else word.capitalize()


def label_of(field: dataclasses.Field) -> str:
    """Return what a setting is called in the panel."""
    return field.metadata["label"]


def condition_of(field: dataclasses.Field, settings_type: type) -> str:
    """Return where a setting has an effect: ``"only for Builder LBVH, PLOC"``; "" if everywhere."""
    labels = {each.name: label_of(each) for each in dataclasses.fields(settings_type)}
    parts = []
    for name, condition in (field.metadata["only_for"] or {}).items():
        # Either choices, or a word such as "given".
        words = [condition] if isinstance(condition, str) else map(name_of, condition)
        parts.append(f"{labels[name]} {', '.join(words)}")
    return f"only for {' and '.join(parts)}" if parts else ""


def property_of(field: dataclasses.Field, condition: str = "", **options: Any) -> Any:
    """Return the Blender property of one field made by ``core.settings.setting``.

    Parameters
    ----------
    condition : str
        See :func:`condition_of`. Where a setting has no effect the panel does not show it; for
        scripts its description says so.
    **options
        What else Blender is to know, such as ``update``.
    """
    meta = field.metadata
    default: Any = field.default
    description = meta["description"]
    if meta["unit"]:
        description += f" (unit: {meta['unit']})"
    if condition:
        description += f"; {condition}"
    common = {"name": meta["label"], "description": description, **options}
    if isinstance(default, bool):
        return BoolProperty(default=default, **common)
    if isinstance(default, str) and meta["choices"]:
        choices = {key: (name_of(key), text) for key, text in meta["choices"].items()}
        return enum_of(choices, default=default, **common)
    if isinstance(default, str):
        # Blender's file chooser for whatever is called a path.
        subtype = "FILE_PATH" if field.name == "path" else "NONE"
        flags = {"PATH_SUPPORTS_BLEND_RELATIVE"} if subtype == "FILE_PATH" else set()
        return StringProperty(default=default, subtype=subtype, options=flags, **common)
    number = default[0] if isinstance(default, tuple) else default
    limit = INT_LIMIT if isinstance(number, int) else FLOAT_LIMIT
    low = -limit if meta["minimum"] is None else max(meta["minimum"], -limit)
    high = limit if meta["maximum"] is None else min(meta["maximum"], limit)
    if isinstance(default, tuple):
        vector = IntVectorProperty if isinstance(number, int) else FloatVectorProperty
        numbers = {"min": type(number)(low), "max": type(number)(high)}
        return vector(default=default, size=3, subtype="XYZ", **numbers, **common)
    if isinstance(default, int):
        return IntProperty(default=default, min=int(low), max=int(high), **common)
    return FloatProperty(default=default, min=low, max=high, precision=3, **common)


def properties_of(settings_type: type, **options: Any) -> dict[str, Any]:
    """Return the Blender properties of a settings dataclass by field name."""
    return {
        field.name: property_of(field, condition_of(field, settings_type), **options)
        for field in dataclasses.fields(settings_type)
    }


def enum_of(choices: Mapping[str, tuple[str, str]], **options: Any) -> Any:
    """Return an EnumProperty of identifier -> (label, description).

    A .blend stores the number of an item. It is derived from the identifier, so that a file still
    means the same after an item has been added. It fits into 24 bits, since Blender's buttons
    handle it as a single-precision number.
    """
    items = [
        (identifier, label, description, zlib.crc32(identifier.encode()) & 0xFFFFFF)
        for identifier, (label, description) in choices.items()
    ]
    assert len({number for *_, number in items}) == len(items), "two identifiers share a number"
    return EnumProperty(items=items, **options)


def group_type(name: str, properties: Mapping[str, Any]) -> type:
    """Return a property group class, not registered yet."""
    return type(
        f"ACCELSCOPE_PG_{name}", (bpy.types.PropertyGroup,), {"__annotations__": dict(properties)}
    )


# ---------------------------------------------------------------------------------- reading back


def read(group: Any, settings_type: type[T], where: str) -> T:
    """Return the dataclass that a property group holds.

    Parameters
    ----------
    group : bpy.types.PropertyGroup
        Or an operator whose properties :func:`properties_of` made.
    where : str
        What is set, as the panel calls it, for the message (``"Uniform Grid"``).

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    values = {
        field.name: _value_of(field, getattr(group, field.name))
        for field in dataclasses.fields(settings_type)
    }
    return check(settings_type(**values), where, label_of)


def _value_of(field: dataclasses.Field, value: Any) -> Any:
    """Return a property's value as the type of its field."""
    default: Any = field.default
    if isinstance(default, tuple):
        if isinstance(default[0], int):
            return tuple(value)
        return tuple(_as_typed(component) for component in value)
    if isinstance(default, float):
        return _as_typed(value)
    if isinstance(default, str) and field.name == "path" and value:
        return bpy.path.abspath(value)  # '//' is the folder of the .blend
    return value


def _as_typed(value: float) -> float:
    """Return the number the user typed.

    Blender keeps single precision, so that 1.2 comes back as 1.2000000476837158. The shortest
    decimal that rounds to the same single is what was typed, and what the command line would get.
    """
    return float(str(np.float32(value)))
