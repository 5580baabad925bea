"""What a Blender window shows: its areas and regions, and pictures of it."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import bpy
import numpy as np


class Screen:
    """The main window of Blender.

    Attributes
    ----------
    output : Path
        Where pictures are put.
    """

    def __init__(self) -> None:
        self.output = Path(os.environ["ACCELSCOPE_OUTPUT"])

    # Finding things.

    @property
    def window(self) -> bpy.types.Window:
        """The main window (a timer's context has none)."""
        return bpy.context.window_manager.windows[0]

    def area(self, area_type: str = "VIEW_3D") -> bpy.types.Area:
        """Find the largest area of a type.

        Parameters
        ----------
        area_type
            For example ``VIEW_3D``, ``OUTLINER``, ``PROPERTIES``.

        Returns
        -------
        bpy.types.Area
            The area. ValueError if there is none.
        """
        areas = [area for area in self.window.screen.areas if area.type == area_type]
        return max(areas, key=lambda area: area.width * area.height)

    def region(self, region_type: str = "WINDOW", area_type: str = "VIEW_3D") -> bpy.types.Region:
        """Find a region of an area: ``WINDOW``, ``UI`` (the sidebar), ``TOOLS``, ``HEADER`` ...

        Parameters
        ----------
        region_type, area_type
            Which region of which area.

        Returns
        -------
        bpy.types.Region
            The region. ValueError if there is none.
        """
        (region,) = (r for r in self.area(area_type).regions if r.type == region_type)
        return region

    def context(self) -> dict[str, object]:
        """Return what ``Context.temp_override`` needs to act in the 3D viewport.

        Returns
        -------
        dict
            Window, area and region, or only the window if it shows no 3D viewport. Steps run
            under this override already.
        """
        if all(area.type != "VIEW_3D" for area in self.window.screen.areas):
            return {"window": self.window}
        return {"window": self.window, "area": self.area(), "region": self.region()}

    # Looking.

    def screenshot(self, name: str) -> Path:
        """Save the screen as Blender shows it now.

        ``bpy.ops.screen.screenshot`` gives a black picture with software GL, so the X server is
        asked.

        Parameters
        ----------
        name
            Name of the picture, without suffix.

        Returns
        -------
        Path
            The PNG file in the output directory.
        """
        picture = self.output / f"{name}.png"
        self._redraw()
        with bpy.context.temp_override(**self.context()):
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
        subprocess.run(["import", "-window", "root", str(picture)], check=True, timeout=30)
        return picture

    def pixels(self, picture: Path, region: bpy.types.Region) -> np.ndarray:
        """Return the part of a screenshot that shows a region.

        Parameters
        ----------
        picture
            What `screenshot` returned.
        region
            The region.

        Returns
        -------
        (height, width, 3) uint8
            Red, green, blue; the first row is the upper one.
        """
        top = self.window.height - region.y - region.height
        crop = f"{region.width}x{region.height}+{region.x}+{top}"
        command = ["convert", str(picture), "-crop", crop, "-depth", "8", "rgb:-"]
        raw = subprocess.run(command, check=True, timeout=30, stdout=subprocess.PIPE).stdout
        return np.frombuffer(raw, np.uint8).reshape(region.height, region.width, 3)

    def _redraw(self) -> None:
        for area in self.window.screen.areas:
            area.tag_redraw()
