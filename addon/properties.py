"""Properties: everything the user can set, as Blender properties of the scene.

The settings dataclasses of structures, workloads and sample scenes are the only source of a
setting; their property groups are generated here, and read back into the dataclass by :func:`read`.

``scene.accelscope`` is made on first use. Knowing the settings means importing the structures, and
with them Numba: half a second that every start of Blender would wait for otherwise.
"""

from __future__ import annotations

import dataclasses
import zlib
from collections.abc import Mapping
from typing import Any, TypeVar

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

from ..core.settings import check
from . import extraction, overlay

T = TypeVar("T")

INT_LIMIT = 2**31 - 1
FLOAT_LIMIT = float(np.finfo(np.float32).max)

COLOURINGS = {
    "depth": ("Depth", "From the root to the deepest cell"),
    "count": ("Count", "By the number of primitives in the leaf"),
    "order": ("Build Step", "By the step of the building that made the cell, if that is known"),
}

_loaded: list[type] = []
"""Property groups that are registered; the root is the last."""


# ------------------------------------------------------------------------- generated from settings


ACRONYMS = ("sah", "fifo")
"""Choices that are written in capitals."""


def name_of(key: str) -> str:
    """Return what a choice is called in the panel."""
    return key.upper() if key in ACRONYMS else key.replace("_", " ").capitalize()


def property_of(field: dataclasses.Field) -> Any:
    """Return the Blender property of one field made by ``core.settings.setting``."""
    meta = field.metadata
    default: Any = field.default
    description = meta["description"]
    if meta["unit"]:
        description += f" (unit: {meta['unit']})"
    common = {"name": meta["label"], "description": description}
    if isinstance(default, bool):
        return BoolProperty(default=default, **common)
    if isinstance(default, str) and meta["choices"]:
        choices = {key: (name_of(key), text) for key, text in meta["choices"].items()}
        return enum_of(choices, default=default, **common)
    if isinstance(default, str):
        # Blender's file chooser for whatever is called a path.
        subtype = "FILE_PATH" if field.name == "path" else "NONE"
        options = {"PATH_SUPPORTS_BLEND_RELATIVE"} if subtype == "FILE_PATH" else set()
        return StringProperty(default=default, subtype=subtype, options=options, **common)
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


def properties_of(settings_type: type) -> dict[str, Any]:
    """Return the Blender properties of a settings dataclass by field name."""
    return {field.name: property_of(field) for field in dataclasses.fields(settings_type)}


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
        What is set, for the message (``"structure grid"``).

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    values = {
        field.name: _value_of(field, getattr(group, field.name))
        for field in dataclasses.fields(settings_type)  # type: ignore[arg-type]
    }
    return check(settings_type(**values), where)


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


def structure_and_settings(root: Any) -> tuple[type, Any]:
    """Return the chosen structure and its settings.

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    from ..core.structures import structure_named

    structure = structure_named(root.structure)
    group = getattr(root.structures, structure.name)
    return structure, read(group, structure.Settings, f"structure {structure.name}")


def workload_and_settings(root: Any) -> tuple[type, Any]:
    """Return the chosen workload and its settings.

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    from ..core.evaluation.workloads import workload_named

    workload = workload_named(root.workload)
    group = getattr(root.workloads, workload.name)
    return workload, read(group, workload.Settings, f"rays {workload.name}")


# ------------------------------------------------------------------------------ scene.accelscope


def _redraw(group: Any, context: bpy.types.Context) -> None:
    overlay.tag_redraw()


def _redraw_ray(root: Any, context: bpy.types.Context) -> None:
    from . import session

    session.current.draw_paths(event_shown(root))


def event_shown(root: Any) -> int | None:
    """Return the event up to which the recorded ray is shown; None shows the whole walk."""
    from . import session

    steps = session.current.steps
    return min(root.event, len(steps) - 1) if root.step_events and steps else None


def _display_properties() -> dict[str, Any]:
    """Return what decides how cells are drawn; the overlay reads it."""
    return {
        "show": BoolProperty(
            name="Show Cells", description="Draw the cells over the scene", default=True,
            update=_redraw,
        ),
        "depth_min": IntProperty(
            name="Depth Min", description="Least depth of the cells drawn; the root has depth 0",
            default=0, min=0, soft_max=32, max=1000, update=_redraw,
        ),
        "depth_max": IntProperty(
            name="Max", description="Largest depth of the cells drawn",
            default=100, min=0, soft_max=32, max=1000, update=_redraw,
        ),
        "leaves_only": BoolProperty(
            name="Leaves Only", description="Leave out inner nodes", default=False, update=_redraw,
        ),
        "hide_empty": BoolProperty(
            name="Hide Empty", description="Leave out the edges of leaves without primitives",
            default=True, update=_redraw,
        ),
        "tint_empty": BoolProperty(
            name="Tint Empty", description="Draw the faces of leaves without primitives, tinted",
            default=False, update=_redraw,
        ),
        "planes": BoolProperty(
            name="Planes",
            description="Draw the planes that cut inner nodes, each within its own cell",
            default=False, update=_redraw,
        ),
        "replay": BoolProperty(
            name="Replay", description="Show the building up to one of its steps",
            default=False, update=_redraw,
        ),
        "step": IntProperty(
            name="Build Step",
            description="Step of the building; the cells it made are white. Step 0 is the root",
            default=0, min=0, update=_redraw,
        ),
        "opacity": FloatProperty(
            name="Opacity", description="Opacity of edges; tints and planes follow it",
            default=0.6, min=0.0, max=1.0, subtype="FACTOR", update=_redraw,
        ),
        "line_width": FloatProperty(
            name="Line Width", description="Width of the cells' edges in pixels",
            default=1.0, min=0.5, max=10.0, update=_redraw,
        ),
        "colour_by": enum_of(
            COLOURINGS, name="Colour By", description="What the colour of a cell means",
            default="depth", update=_redraw,
        ),
    }  # fmt: skip


def is_loaded() -> bool:
    """Say whether ``scene.accelscope`` exists already; panels must not make it."""
    return bool(_loaded)


def load() -> None:
    """Make the property groups and put them on the scene.

    Blender refuses this (RuntimeError) while it draws a panel.
    """
    if _loaded:
        return
    from ..core.evaluation.workloads import workloads
    from ..core.structures import structures

    def make(name: str, properties: Mapping[str, Any]) -> type:
        group = group_type(name, properties)
        bpy.utils.register_class(group)
        _loaded.append(group)
        return group

    def make_all(kind: str, entries: Mapping[str, Any]) -> type:
        groups = {
            name: PointerProperty(type=make(f"{kind}_{name}", properties_of(entry.Settings)))
            for name, entry in entries.items()
        }
        return make(f"{kind}s", groups)

    def choice_of(entries: Mapping[str, Any], default: str, **options: Any) -> Any:
        choices = {name: (entry.label, entry.summary) for name, entry in entries.items()}
        return enum_of(choices, default=default, **options)

    root = {
        "scope": enum_of(
            extraction.SCOPES,
            name="Scope", description="Which objects are built over", default=extraction.VISIBLE,
        ),
        "structure": choice_of(
            structures(), "bvh", name="Structure", description="Acceleration structure to build"
        ),
        "structures": PointerProperty(type=make_all("structure", structures())),
        "workload": choice_of(
            workloads(), "camera", name="Rays", description="Set of rays to trace"
        ),
        "workloads": PointerProperty(type=make_all("workload", workloads())),
        "display": PointerProperty(type=make("display", _display_properties())),
        "ray_index": IntProperty(
            name="Ray", description="Number of the ray to step through; the first is 0",
            default=0, min=0,
        ),
        "step_events": BoolProperty(
            name="Event by Event", description="Show the recorded walk up to one of its events",
            default=False, update=_redraw_ray,
        ),
        "event": IntProperty(
            name="Event", description="Event of the recorded walk; the first is 0",
            default=0, min=0, update=_redraw_ray,
        ),
    }  # fmt: skip
    bpy.types.Scene.accelscope_settings = PointerProperty(type=make("root", root))


def load_soon() -> None:
    """Make the properties as soon as Blender has finished drawing."""
    if not bpy.app.timers.is_registered(_load_and_redraw):
        bpy.app.timers.register(_load_and_redraw, first_interval=0.01)


def _load_and_redraw() -> None:
    load()
    overlay.tag_redraw()


def _root_of(scene: bpy.types.Scene) -> Any:
    """Return the settings of a scene: what ``scene.accelscope`` is."""
    load()
    return scene.accelscope_settings


def register() -> None:
    """Give scenes their ``accelscope``; the groups behind it come on first use."""
    bpy.types.Scene.accelscope = property(_root_of)


def unregister() -> None:
    """Take it all away; the values stay in the file."""
    if bpy.app.timers.is_registered(_load_and_redraw):
        bpy.app.timers.unregister(_load_and_redraw)
    del bpy.types.Scene.accelscope
    if _loaded:
        del bpy.types.Scene.accelscope_settings
    while _loaded:
        bpy.utils.unregister_class(_loaded.pop())
