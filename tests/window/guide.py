"""What the tours through the extension have in common: where things are, and what to do there."""

from __future__ import annotations

import importlib
import json
import sys
from math import radians
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Vector
from session import Session, Steps

MODULE = "bl_ext.user_default.accelscope"
SIDEBAR = 340
"""Width of the sidebar in pixels: what a person would drag it to."""
HEADER = 0.112
"""Where the check box of a panel's header is, as a share of that width."""
REFIT = 0.25
"""Where Refit is, left of Compare over Timeline, as a share of that width."""

# Software GL draws a million triangles in seconds, and another process may have the processor.
session = Session(timeout=240.0)
figures: dict[str, Any] = {}
taken: dict[str, Path] = {}


def part(name: str) -> ModuleType:
    """Return a module of the installed extension."""
    return importlib.import_module(f"{MODULE}.{name}")


def results() -> Any:
    """Return the extension's session: what has been built and traced."""
    return part("addon.results.session").current


def settings() -> Any:
    """Return what the panel shows."""
    return bpy.context.scene.accelscope


def reset(group: Any, name: str) -> None:
    """Set a property to its default; Blender does not for those that only stand for another."""
    kept = f"{name}_kept"
    if kept in group.bl_rna.properties:  # nobody has chosen it any more
        group.property_unset(kept)
    else:
        setattr(group, name, group.bl_rna.properties[name].default)


def running() -> Any:
    """Return the job under way."""
    return part("addon.jobs").running()


def status() -> str:
    """Return the status line."""
    return results().status(bpy.context).text


def station(name: str) -> Path:
    """Take the next numbered screenshot."""
    taken[name] = session.screenshot(f"{len(taken) + 1:02}-{name}")
    return taken[name]


def viewport(picture: Path) -> np.ndarray:
    """Return the middle of the 3D viewport in a screenshot: no gizmo, no sidebar."""
    pixels = session.pixels(picture, session.region()).astype(int)
    height, width = pixels.shape[:2]
    return pixels[height // 6 : -height // 8, width // 10 : width - SIDEBAR - width // 10]


def coloured(picture: Path) -> int:
    """Count the pixels of the viewport that are strongly coloured: the overlay, hardly Blender."""
    pixels = viewport(picture)
    return int(np.count_nonzero(pixels.max(axis=2) - pixels.min(axis=2) > 60))


def changed(before: Path, after: Path) -> int:
    """Count the pixels of the viewport that differ between two screenshots."""
    return int(np.count_nonzero((viewport(before) != viewport(after)).any(axis=2)))


def note(name: str, value: Any) -> None:
    """Keep something that was measured."""
    figures[name] = value
    (session.output / "figures.json").write_text(json.dumps(figures, indent=1), encoding="utf-8")


def open_panel(check_box: str) -> Steps:
    """Open or close a panel, by a click behind the check box in its header."""
    x, y = yield from session.find(check_box, across=HEADER)
    session.click(x + 0.5 * SIDEBAR, y)
    yield 0.5


def over_viewport() -> None:
    """Put the pointer where keys go to the 3D viewport, beside whatever is in its middle."""
    region = session.region()
    session.move(region.x + 0.25 * region.width, region.y + 0.15 * region.height)


def sample(name: str, **values: int) -> None:
    """Replace everything in the scene by a sample scene, and frame it."""
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    bpy.ops.accelscope.add_sample_scene("EXEC_DEFAULT", True, sample=name, **values)
    frame()


def frame() -> None:
    """Look at the selected objects, from the front and a little from above, left of the sidebar."""
    view = session.area().spaces[0].region_3d
    view.view_rotation = Euler((radians(72), 0.0, radians(28))).to_quaternion()
    bpy.ops.view3d.view_selected()
    view.view_distance *= 1.15
    view.view_location += view.view_rotation @ Vector((0.14 * view.view_distance, 0.0, 0.0))
    # The outline of what is selected is as bright as the cells.
    bpy.ops.object.select_all(action="DESELECT")


def open_wide_tab() -> Steps:
    """Open the tab AccelScope, and drag the sidebar wide."""
    yield from session.open_sidebar("AccelScope")
    yield from session.widen_sidebar(SIDEBAR)
    # The settings are made after the first draw.
    yield lambda: part("addon.settings.properties").is_loaded()
    yield 1.0


def build() -> Steps:
    """Click on Build and wait for the result."""
    before = results().built
    yield from session.press("accelscope.build(")
    yield lambda: running() is None and results().built is not before


def trace() -> Steps:
    """Click on Trace and wait for the result."""
    before = results().traced
    yield from session.press("accelscope.trace(")
    yield lambda: running() is None and results().traced is not before


def compile_nothing_ahead() -> None:
    """Take no core from what is looked at; it would begin a little after the extension is on."""
    bpy.context.preferences.addons[MODULE].preferences.compile_ahead = False


def enable() -> None:
    """Turn the extension on again; Blender has forgotten its preferences."""
    bpy.ops.preferences.addon_enable(module=MODULE)
    compile_nothing_ahead()


def install() -> None:
    """Install the zip that the command line names into a Blender nobody has used before."""
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    folder = Path(__file__).parents[2] / "build" / "window" / "extension"
    path = arguments[0] if arguments else str(max(folder.glob("accelscope-*-linux_x64.zip")))
    bpy.ops.extensions.package_install_files(
        filepath=path, repo="user_default", enable_on_install=True
    )
    assert MODULE in bpy.context.preferences.addons, f"nothing was installed from {path}"
    compile_nothing_ahead()
    # Views change at once, so that a screenshot does not show the way there.
    bpy.context.preferences.view.smooth_view = 0
    # Blender catches the pointer while it drags, and takes where it is put for how far it moved.
    bpy.context.preferences.inputs.use_mouse_continuous = False
    # One pass instead of eight, each of which takes software GL most of a second.
    bpy.context.preferences.system.viewport_aa = "FXAA"
