"""The smallest window test: Blender opens, takes real events and draws what they did."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from session import Session, Steps

session = Session()


@session.step
def open_sidebar() -> Steps:
    """The sidebar of the 3D viewport opens at a tab."""
    yield from session.open_sidebar("Item")


@session.step
def add_monkey() -> None:
    """An operator acts in the viewport."""
    bpy.ops.mesh.primitive_monkey_add(location=(0.0, 0.0, 2.0))
    assert bpy.context.object.name == "Suzanne"


@session.step
def click_and_key() -> Steps:
    """A click selects the cube, and a key hides it."""
    region = session.region()
    bpy.ops.view3d.view_axis(type="FRONT")
    yield 1.0
    session.click(region.x + region.width / 2, region.y + region.height / 2)
    yield lambda: bpy.context.view_layer.objects.active.name == "Cube"
    session.key("h")
    yield lambda: bpy.data.objects["Cube"].hide_get()


@session.step
def take_screenshot() -> Steps:
    """The screen shows it."""
    yield
    assert session.screenshot("smoke").stat().st_size > 10_000


session.run()
