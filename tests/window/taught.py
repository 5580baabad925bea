"""What scripts that teach lessons have in common: what is shown, and where."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from guide import part, running, session

LIGHT = Path(bpy.utils.system_resource("SCRIPTS")) / "presets/interface_theme/Blender_Light.xml"


def view() -> Any:
    """Return what is shown of a lesson."""
    return part("addon.results.lesson_view").current


def film() -> Any:
    """Return the module of films."""
    return part("addon.results.film")


def shown(name: str) -> bool:
    """Say whether the picture of a lesson is drawn, and nothing is on its way."""
    lesson = view().lesson
    return running() is None and lesson is not None and lesson.name == name and not view().fault


def use_theme(light: bool) -> None:
    """Change Blender's theme; with the light one the viewport is white, as a page is."""
    shading = session.area().spaces[0].shading
    if light:
        bpy.ops.script.execute_preset(
            filepath=str(LIGHT), menu_idname="USERPREF_MT_interface_theme_presets"
        )
        shading.background_type, shading.background_color = "VIEWPORT", (1.0, 1.0, 1.0)
    else:
        bpy.ops.preferences.reset_default_theme()
        shading.background_type = "THEME"


def in_view() -> None:
    """Assert that all that is drawn is where nothing covers the viewport."""
    region, points = session.region(), view().points()
    region_3d = session.area().spaces[0].region_3d
    some = points[:: max(len(points) // 500, 1)]
    places = np.array([location_3d_to_region_2d(region, region_3d, point) for point in some])
    places += [region.x, region.y]
    low, high = places.min(axis=0), places.max(axis=0)
    toolbar, sidebar = session.region("TOOLS"), session.region("UI")
    top = min(session.region(name).y for name in ("HEADER", "TOOL_HEADER"))
    assert toolbar.x + toolbar.width < low[0], (low, high)
    assert high[0] < sidebar.x, (low, high)
    assert region.y < low[1], (low, high)
    assert high[1] < top, (low, high)
