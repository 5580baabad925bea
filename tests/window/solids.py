"""Solids in a real Blender window: what objects stand for is chosen, built over and walked through.

And instances: what is in several places is built over and drawn.

.ci/blender_window.sh tests/window/solids.py build/window/solids [-- ZIP]
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

LEFT_OUT = "lessons", "display", "rays", "statistics", "output"
"""Modules of panels for which the window has no room."""

OBJECTS = {"sphere": "uv_sphere", "cylinder": "cylinder", "cone": "cone", "itself": "monkey"}


@session.step
def install_zip() -> None:
    """The zip installs; of its panels two are as much as the window has room for."""
    install()
    for module in LEFT_OUT:
        for cls in part(f"panels.{module}").CLASSES:
            bpy.utils.unregister_class(cls)
    for cls in part("panels.solid").CLASSES:
        bpy.utils.unregister_class(cls)
        cls.bl_options = set()  # open
        bpy.utils.register_class(cls)


@session.step
def primitives() -> Steps:
    """Blender's own primitives, of several sizes, and a mesh beside them."""
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    for number, primitive in enumerate(OBJECTS.values()):
        getattr(bpy.ops.mesh, f"primitive_{primitive}_add")(
            location=(2.6 * number, 0.3 * number, 0), rotation=(0.2, 0.3 * number, 0)
        )
    bpy.ops.object.select_all(action="SELECT")
    frame()
    yield from open_wide_tab()


@session.step
def choose_what_they_stand_for() -> Steps:
    """The panel shows what has an effect, and no more."""
    for obj, kind in zip(bpy.context.scene.objects, OBJECTS, strict=True):
        bpy.context.view_layer.objects.active = obj
        obj.accelscope_solid.kind = kind
        assert kind == "itself" or max(abs(n - 1.0) for n in obj.accelscope_solid.size) < 1e-5
    bpy.context.view_layer.objects.active = bpy.data.objects["Cone"]
    yield from session.find("accelscope_solid.apex")
    over_viewport()
    yield 1.0
    station("panel")


@session.step
def build_over_them() -> Steps:
    """Three solids and the triangles of the monkey's head."""
    settings().structures.bvh.max_leaf_size = 1
    yield from build()
    over_viewport()
    yield 1.0
    station("built")
    monkey = bpy.data.objects["Suzanne"].data
    scene = results().built.structure.scene
    assert len(scene) == 3 + sum(len(face.vertices) - 2 for face in monkey.polygons)
    yield lambda: status() == "Up to date"


@session.step
def change_one() -> Steps:
    """A change of what an object stands for is noticed, and undone."""
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects["Cone"].accelscope_solid.apex = 0.5
    bpy.ops.ed.undo_push(message="after")
    yield lambda: "Cone" in status()
    station("changed")
    bpy.ops.ed.undo()
    yield lambda: status() == "Up to date"


@session.step
def walk_through_a_sample() -> Steps:
    """A sample scene carries its items; a ray's walk is drawn with them."""
    sample("jacks", jacks_size=2)
    bpy.ops.accelscope.build()
    yield lambda: running() is None and status() == "Up to date"
    assert results().built.structure.scene.counted == "81 items"
    settings().workload = "random_lines"
    settings().workloads.random_lines.count = 200
    bpy.ops.accelscope.trace()
    yield lambda: running() is None and results().traced is not None
    settings().lessons.ray.ray = int((results().traced.hits.primitive >= 0).argmax())
    bpy.ops.accelscope.step_ray()
    lesson = part("addon.results.lesson_view").current
    yield lambda: running() is None and lesson.picture is not None
    figures = {row.label: row.text for row in lesson.picture.rows}
    assert figures["Hit"].startswith("item "), figures
    settings().lessons.ray.whole = True
    settings().teaching.hide_cells = False
    settings().display.leaves_only = True
    yield 1.0
    station("ray")


@session.step
def build_over_instances() -> Steps:
    """Linked duplicates stay one mesh: their boxes are dashed, its tree stands in one of them."""
    settings().display.leaves_only = False
    # A leaf of one instance would be as large as its box, and lie over the dashes.
    settings().structures.bvh.max_leaf_size = 4
    bpy.ops.accelscope.clear()
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    bpy.ops.mesh.primitive_monkey_add()
    for number in range(1, 6):
        twin = bpy.data.objects.new(f"Twin{number}", bpy.context.object.data)
        twin.location = (3.0 * (number % 3), 3.5 * (number // 3), 0.0)
        twin.rotation_euler = (0.3 * number, 0.5 * number, 0.9 * number)
        twin.scale.z = 0.6 + 0.1 * number
        bpy.context.collection.objects.link(twin)
    bpy.ops.object.select_all(action="SELECT")
    frame()
    yield from build()
    cells = results().cells
    assert cells.is_dashed.sum() == 6
    settings().display.depth_max = int(cells.depth[cells.is_dashed][0]) + 4
    over_viewport()
    yield 1.0
    station("instances")
    twin.location.x += 1.0
    yield lambda: status() == "Out of date: Twin5 has moved"
    twin.location.x -= 1.0
    yield lambda: status() == "Up to date"


@session.step
def put_panels_back() -> None:
    """Blender takes away what is there when it quits."""
    for module in LEFT_OUT:
        for cls in part(f"panels.{module}").CLASSES:
            bpy.utils.register_class(cls)


session.run()
