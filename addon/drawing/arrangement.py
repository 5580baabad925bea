"""How viewports are arranged, so that a lesson can leave them as it has found them."""

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


class Arrangement:
    """A viewport as it was.

    Parameters
    ----------
    area : bpy.types.Area
        Of type ``VIEW_3D``.
    """

    def __init__(self, area: bpy.types.Area) -> None:
        space = area.spaces.active
        self._screen = area.id_data.name
        self._number = list(area.id_data.areas).index(area)
        self._values = [
            (group, name, _copy(getattr(getattr(space, group), name)))
            for group, names in (("overlay", OVERLAYS), ("shading", SHADING), ("region_3d", VIEW))
            for name in names
        ]

    def area(self) -> bpy.types.Area | None:
        """Return the viewport; None if it is not there any more."""
        screen = bpy.data.screens.get(self._screen)
        if screen is None or self._number >= len(screen.areas):
            return None
        area = screen.areas[self._number]
        return area if area.type == "VIEW_3D" else None

    def restore(self) -> None:
        """Arrange it as it was."""
        area = self.area()
        if area is not None:
            for group, name, value in self._values:
                setattr(getattr(area.spaces.active, group), name, value)


def arrange(area: bpy.types.Area) -> None:
    """Arrange a viewport for a lesson."""
    space = area.spaces.active
    for group, values in (("overlay", OVERLAYS), ("shading", SHADING)):
        for name, value in values.items():
            setattr(getattr(space, group), name, value)


def _copy(value: Any) -> Any:
    """Return a value that does not follow Blender's."""
    return value.copy() if hasattr(value, "copy") else value
