"""How viewports are arranged, so that a lesson can leave them as it has found them.

How they were stands in a property of their screen: it lasts as long as the screen does, in a file
that was saved during a lesson, too.
"""

from __future__ import annotations

from typing import Any

import bpy

OVERLAYS = {
    "show_floor": False, "show_ortho_grid": False, "show_axis_x": False, "show_axis_y": False,
    "show_axis_z": False, "show_cursor": False, "show_object_origins": False, "show_text": False,
    "show_overlays": True,
}  # fmt: skip
"""What of Blender's own is drawn beside a lesson: nothing that has lines."""

SHADING = {"type": "SOLID", "show_xray": False}

VIEW = "view_perspective", "view_rotation", "view_location", "view_distance"

REMEMBERED = [
    (group, name)
    for group, names in (("overlay", OVERLAYS), ("shading", SHADING), ("region_3d", VIEW))
    for name in names
]
"""What of a viewport is as it was afterwards."""

BEFORE = "accelscope_viewports"
"""Property of a screen: how each of its viewports was, by its number among all areas."""


def arrange(area: bpy.types.Area) -> None:
    """Arrange a viewport for a lesson; how it was before the first is remembered."""
    screen, space = area.id_data, area.spaces.active
    number = str(list(screen.areas).index(area))
    before = _before(screen)
    if number not in before:
        screen[BEFORE] = before | {
            number: {name: _value(space, group, name) for group, name in REMEMBERED}
        }
    for group, values in (("overlay", OVERLAYS), ("shading", SHADING)):
        for name, value in values.items():
            setattr(getattr(space, group), name, value)


def rearrange(screen: bpy.types.Screen) -> None:
    """Arrange the viewports of a screen as they were before lessons."""
    for number, values in _before(screen).items():
        area = screen.areas[int(number)] if int(number) < len(screen.areas) else None
        if area is not None and area.type == "VIEW_3D":
            for group, name in REMEMBERED:
                setattr(getattr(area.spaces.active, group), name, values[name])
    screen.pop(BEFORE, None)


def _before(screen: bpy.types.Screen) -> dict[str, Any]:
    return screen[BEFORE].to_dict() if BEFORE in screen else {}


def _value(space: bpy.types.SpaceView3D, group: str, name: str) -> Any:
    """Return a value as a property can have it."""
    value = getattr(getattr(space, group), name)
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
