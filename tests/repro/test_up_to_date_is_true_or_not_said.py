"""The status compares what would be built over now with what was: in both directions."""

from __future__ import annotations

from typing import Any

import pytest

UP_TO_DATE = "Up to date"


@pytest.fixture
def cube(bpy: Any) -> Any:
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


@pytest.fixture
def status(bpy: Any) -> Any:
    """What a script is told, without an update before."""
    from accelscope.addon.results import session

    return lambda: session.current.status(bpy.context).text


def build(bpy: Any) -> None:
    assert bpy.ops.accelscope.build() == {"FINISHED"}


# ------------------------------------------------------------------- what is there is elsewhere


def test_keyframes_move_an_object(bpy: Any, cube: Any, status: Any) -> None:
    cube.keyframe_insert("location", frame=1)
    cube.location.x = 3.0
    cube.keyframe_insert("location", frame=10)
    bpy.context.scene.frame_set(1)
    build(bpy)
    bpy.context.scene.frame_set(10)
    assert status() == "Out of date: Cube has moved"
    bpy.context.scene.frame_set(1)
    assert status() == UP_TO_DATE


def test_a_modifier_follows_the_frame(bpy: Any, cube: Any, status: Any) -> None:
    cube.modifiers.new("Wave", "WAVE")
    build(bpy)
    bpy.context.scene.frame_set(20)
    assert status() == "Out of date: the geometry of Cube has changed"
    bpy.context.scene.frame_set(1)
    assert status() == UP_TO_DATE


def test_a_driver_turns_an_object(bpy: Any, cube: Any, status: Any) -> None:
    cube.driver_add("rotation_euler", 2).driver.expression = "frame / 10"
    build(bpy)
    bpy.context.scene.frame_set(2)
    assert status() == "Out of date: Cube was turned or scaled"


def test_a_parent_carries_an_object(bpy: Any, cube: Any, status: Any) -> None:
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    cube.parent = parent
    build(bpy)
    parent.location.z = 2.0
    assert status() == "Out of date: Cube has moved"
    parent.location.z = 0.0
    assert status() == UP_TO_DATE


def test_an_instanced_object_is_edited(bpy: Any, cube: Any, status: Any) -> None:
    collection = bpy.data.collections.new("Parts")
    collection.objects.link(cube)
    bpy.context.collection.objects.unlink(cube)
    empty = bpy.data.objects.new("Instancer", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    bpy.context.collection.objects.link(empty)
    build(bpy)
    cube.data.vertices[0].co.x = 5.0
    cube.data.update()
    assert status() == "Out of date: the geometry of Instancer/Cube has changed"
    cube.data.vertices[0].co.x = -1.0
    cube.data.update()
    assert status() == UP_TO_DATE
    empty.instance_type = "NONE"
    assert status() == "Out of date: Instancer/Cube is no longer there"


def test_a_modifier_and_back(bpy: Any, cube: Any, status: Any) -> None:
    array = cube.modifiers.new("Array", "ARRAY")
    build(bpy)
    array.count = 5
    assert status() == "Out of date: the geometry of Cube has changed"
    array.count = 2
    assert status() == UP_TO_DATE


def test_vertices_instance_an_object(bpy: Any, cube: Any, status: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.instance_type = "VERTS"
    plane.show_instancer_for_viewport = False
    cube.parent = plane
    build(bpy)
    assert status() == UP_TO_DATE
    corners = [tuple(vertex.co) for vertex in plane.data.vertices]
    plane.data.clear_geometry()
    plane.data.from_pydata(corners[:3], [], [(0, 1, 2)])
    assert status() == "Out of date: there are fewer of Plane/Cube"
    plane.data.clear_geometry()
    plane.data.from_pydata([*corners, (5, 5, 5)], [], [(0, 1, 3, 2)])
    assert status() == "Out of date: there are more of Plane/Cube"
    plane.data.vertices[4].co.z = 6.0
    plane.data.clear_geometry()
    plane.data.from_pydata(corners, [], [(0, 1, 3, 2)])
    assert status() == UP_TO_DATE


def test_what_was_edited_while_it_was_hidden(bpy: Any, cube: Any, status: Any) -> None:
    build(bpy)
    cube.hide_set(True)
    assert status() == "Out of date: Cube is hidden"
    cube.data.vertices[0].co.x = 5.0
    cube.data.update()
    cube.hide_set(False)
    assert status() == "Out of date: the geometry of Cube has changed"


def test_another_object_is_added_hidden_and_shown(bpy: Any, cube: Any, status: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.hide_set(True)
    build(bpy)
    plane.hide_set(False)
    assert status() == "Out of date: Plane is visible now"
    plane.hide_set(True)
    assert status() == UP_TO_DATE
    bpy.ops.mesh.primitive_cone_add()
    assert status() == "Out of date: Cone was added"


def test_faces_taken_away(bpy: Any, cube: Any, status: Any) -> None:
    build(bpy)
    cube.data.clear_geometry()
    assert status() == "Out of date: Cube has no faces any more"


def test_another_view_layer_without_the_object(bpy: Any, cube: Any, status: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    build(bpy)
    layer = bpy.context.scene.view_layers.new("Other")
    layer.layer_collection.exclude = False
    bpy.context.window.view_layer = layer
    assert status() == UP_TO_DATE
    cube.hide_set(True, view_layer=layer)
    assert status() == "Out of date: Cube is hidden"
    bpy.context.window.view_layer = bpy.context.scene.view_layers[0]
    assert status() == UP_TO_DATE


# ------------------------------------------------------------------- what is there is the same


def test_edit_mode_changes_nothing(bpy: Any, cube: Any, status: Any) -> None:
    cube.modifiers.new("Bevel", "BEVEL")
    build(bpy)
    bpy.ops.object.mode_set(mode="EDIT")
    assert status() == UP_TO_DATE
    bpy.ops.object.mode_set(mode="OBJECT")
    assert status() == UP_TO_DATE


def test_an_edit_in_edit_mode(bpy: Any, cube: Any, status: Any) -> None:
    import bmesh

    build(bpy)
    bpy.ops.object.mode_set(mode="EDIT")
    mesh = bmesh.from_edit_mesh(cube.data)
    mesh.verts.ensure_lookup_table()
    mesh.verts[0].co.x -= 1.0
    bmesh.update_edit_mesh(cube.data)
    assert status() == "Out of date: the geometry of Cube has changed"
    mesh.verts[0].co.x += 1.0
    bmesh.update_edit_mesh(cube.data)
    assert status() == UP_TO_DATE
    bpy.ops.object.mode_set(mode="OBJECT")
    assert status() == UP_TO_DATE


def test_what_no_ray_meets(bpy: Any, cube: Any, status: Any) -> None:
    build(bpy)
    cube.data.materials.append(bpy.data.materials.new("Red"))
    assert status() == UP_TO_DATE
    bpy.ops.object.shade_smooth()
    assert status() == UP_TO_DATE
    cube.select_set(False)
    assert status() == UP_TO_DATE
    cube.hide_set(True)
    cube.hide_set(False)
    assert status() == UP_TO_DATE
    cube.hide_viewport = True
    assert status() == "Out of date: Cube is hidden"
    cube.hide_viewport = False
    assert status() == UP_TO_DATE
    cube.rotation_euler.x = 6.0
    bpy.context.view_layer.update()
    cube.rotation_euler.x = 0.0
    assert status() == UP_TO_DATE
    bpy.ops.object.light_add(type="SUN")
    bpy.context.object.location.x = 7.0
    assert status() == UP_TO_DATE
    bpy.context.scene.frame_set(30)
    assert status() == UP_TO_DATE


def test_what_we_bake(bpy: Any, cube: Any, status: Any) -> None:
    build(bpy)
    assert bpy.ops.accelscope.bake() == {"FINISHED"}
    assert status() == UP_TO_DATE


def test_moved_and_moved_back(bpy: Any, cube: Any, status: Any) -> None:
    build(bpy)
    cube.location.x = 1.0
    assert status() == "Out of date: Cube has moved"
    cube.location.x = -0.0
    assert status() == UP_TO_DATE


def test_selection_counts_where_it_decides(bpy: Any, cube: Any, root: Any, status: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    root.scope = "selected"
    build(bpy)
    assert status() == UP_TO_DATE
    cube.select_set(True)
    assert status() == "Out of date: Cube is selected now"
    cube.select_set(False)
    assert status() == UP_TO_DATE
    bpy.data.objects["Plane"].select_set(False)
    assert status() == "Out of date: Plane is no longer selected"


# ----------------------------------------------------------------------------------- in a window


def test_the_panel_says_neither_before_it_is_known(bpy: Any, cube: Any) -> None:
    from accelscope.addon.results import session

    def told() -> Any:
        return session.current.status(bpy.context, at_once=False)

    build(bpy)
    assert told() == (True, UP_TO_DATE)
    cube.location.x = 1.0
    bpy.context.view_layer.update()
    assert told() == (False, "Comparing with the scene...")
    assert session.current.status(bpy.context).text == "Out of date: Cube has moved"
    assert told() == (False, "Out of date: Cube has moved")


def test_a_large_mesh_is_compared_a_little_at_a_time(bpy: Any) -> None:
    import time

    from accelscope.addon.results import session

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=400, y_subdivisions=400)
    grid = bpy.context.object
    bpy.context.scene.accelscope.structure = "naive"
    build(bpy)
    look = session.current.snapshot.look
    grid.data.vertices[-1].co.z = 1.0
    grid.data.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    times = []
    while not look.compare(depsgraph, until=0.0):  # no time at all: a slice each
        times.append(time.process_time())
    assert len(times) >= 3
    assert look.change_in(bpy.context.view_layer) == "the geometry of Grid has changed"
    # An edit in between begins anew, and both are found.
    grid.data.vertices[-1].co.z = 0.0
    grid.data.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert not look.compare(depsgraph, until=0.0)
    grid.data.vertices[0].co.z = 1.0
    grid.data.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    while not look.compare(depsgraph, until=0.0):
        pass
    assert look.change_in(bpy.context.view_layer) == "the geometry of Grid has changed"
    grid.data.vertices[0].co.z = 0.0
    grid.data.update()
    assert session.current.status(bpy.context).text == UP_TO_DATE


def test_many_objects_do_not_keep_it_from_getting_on(bpy: Any, cube: Any) -> None:
    from accelscope.addon.results import session

    for number in range(50):
        other = bpy.data.objects.new(f"Other {number}", cube.data)
        other.location.x = 3.0 * number
        bpy.context.collection.objects.link(other)
    build(bpy)
    look = session.current.snapshot.look
    look.note_everything()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    steps = 1
    while not look.compare(depsgraph, until=0.0):
        steps += 1
        assert steps < 1000
    assert look.change_in(bpy.context.view_layer) == ""
