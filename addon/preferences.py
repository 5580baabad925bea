"""Preferences of the add-on: what belongs to this computer, not to a file."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty

from . import compile_ahead

BASE_PACKAGE = __package__.rpartition(".")[0]


def _compile_or_stop(preferences: bpy.types.AddonPreferences, context: bpy.types.Context) -> None:
    if preferences.compile_ahead:
        compile_ahead.start_soon()
    else:
        compile_ahead.stop()


class ACCELSCOPE_Preferences(bpy.types.AddonPreferences):
    bl_idname = BASE_PACKAGE

    compile_ahead: BoolProperty(  # type: ignore[valid-type]
        name="Compile Ahead",
        description="After installation, compile in a process of low priority what would be "
        "waited for at its first use",
        default=True, update=_compile_or_stop,
    )  # fmt: skip

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the preferences."""
        self.layout.prop(self, "compile_ahead")
