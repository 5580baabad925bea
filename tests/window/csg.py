"""CSG trees in a real Blender window: Boolean modifiers are built over, moved, and taught.

.ci/blender_window.sh tests/window/csg.py build/window/csg [-- ZIP]
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    build,
    frame,
    install,
    open_wide_tab,
    over_viewport,
    part,
    results,
    running,
    sample,
    session,
    settings,
    station,
    status,
)
from session import Steps
from taught import shown

LEFT_OUT = "lessons", "display", "rays", "output"
"""Modules of panels for which the window has no room."""


@session.step
def install_zip() -> None:
    """The zip installs; of its panels two are as much as the window has room for."""
    install()
    for module in LEFT_OUT:
        for cls in part(f"panels.{module}").CLASSES:
            bpy.utils.unregister_class(cls)


@session.step
def modifiers() -> Steps:
    """A cube, a ball that it shares with, and a bar that is taken away; the bar is a solid."""
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.35)
    ball = bpy.context.object
    ball.accelscope_solid.kind = "sphere"
    bpy.ops.mesh.primitive_cylinder_add(radius=0.5, depth=6)
    bar = bpy.context.object
    bar.name = "Bar"
    bar.accelscope_solid.kind = "cylinder"
    for operation, operand in (("INTERSECT", ball), ("DIFFERENCE", bar)):
        modifier = cube.modifiers.new(operation.title(), "BOOLEAN")
        modifier.operation, modifier.solver, modifier.object = operation, "EXACT", operand
        operand.display_type = "WIRE"
    bpy.ops.object.select_all(action="SELECT")
    frame()
    yield from open_wide_tab()


@session.step
def build_over_them() -> Steps:
    """One tree of three leaves; its panel has the bounds."""
    yield from build()
    over_viewport()
    yield 1.0
    station("built")
    scene = results().built.structure.scene
    assert scene.counted == "1 trees", scene.counted
    assert scene.geometry.n_primitives == 14, scene.geometry.n_primitives
    assert scene.notes == (), scene.notes
    yield lambda: status() == "Up to date"


@session.step
def move_an_operand() -> Steps:
    """The bar moves: the cube's tree is out of date."""
    bar = bpy.data.objects["Bar"]
    bar.location.x += 0.5
    yield lambda: status() == "Out of date: the geometry of Cube has changed"
    over_viewport()
    yield 1.0
    station("moved")
    bar.location.x -= 0.5
    yield lambda: status() == "Up to date"
    settings().csg_bounds = "upward"
    yield lambda: status() == "Out of date: the bounds of CSG trees were changed"
    settings().csg_bounds = "cut"
    yield lambda: status() == "Up to date"


@session.step
def a_sample() -> Steps:
    """A sample is objects with modifiers, and is built over as its tree."""
    sample("csg_rook")
    over_viewport()
    yield 1.0
    station("sample")
    bpy.ops.accelscope.build()
    yield lambda: running() is None and status() == "Up to date"
    scene = results().built.structure.scene
    assert scene.geometry.n_primitives == 26, scene.geometry.n_primitives
    settings().workload = "random_lines"
    settings().workloads.random_lines.count = 2000
    bpy.ops.accelscope.trace()
    yield lambda: running() is None and results().traced is not None
    over_viewport()
    yield 1.0
    station("traced")


@session.step
def lessons() -> Steps:
    """The lessons on cutting, on their own samples."""
    for name in ("csg_cutting", "csg_intervals", "csg_tests"):
        settings().teaching.lesson = name
        yield 0.5
        if bpy.context.window.scene.name == "Scene":
            bpy.ops.accelscope.teach("INVOKE_DEFAULT", subject="SAMPLE")
        yield lambda name=name: shown(name)
        over_viewport()
        yield 1.0
        station(name)
    bpy.ops.accelscope.end_lesson()


@session.step
def put_panels_back() -> None:
    """Blender takes away what is there when it quits."""
    for module in LEFT_OUT:
        for cls in part(f"panels.{module}").CLASSES:
            bpy.utils.register_class(cls)


session.run()
