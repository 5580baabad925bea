"""Add Sample Scene in a factory Blender: the default cube is hidden, not built over."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def cube(bpy):
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def test_other_objects_are_hidden(bpy, cube, current):
    bpy.ops.accelscope.add_sample_scene(sample="sah_example")
    assert cube.hide_get()
    bpy.ops.accelscope.build()
    assert len(current.built.structure.scene) == 76


def test_a_second_sample_takes_the_place_of_the_first(bpy, cube, current):
    bpy.ops.accelscope.add_sample_scene(sample="suzanne")
    bpy.ops.accelscope.add_sample_scene(sample="sah_example")
    bpy.ops.accelscope.build()
    assert len(current.built.structure.scene) == 76


def test_they_may_stay(bpy, cube, current):
    bpy.ops.accelscope.add_sample_scene(sample="sah_example", only=False)
    assert not cube.hide_get()
    bpy.ops.accelscope.build()
    assert len(current.built.structure.scene) == 76 + 12


def test_undo_brings_them_back(bpy, cube):
    name = cube.name
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.accelscope.add_sample_scene(sample="tetra")
    bpy.ops.ed.undo_push(message="after")
    assert bpy.data.objects[name].hide_get()
    bpy.ops.ed.undo()
    assert not bpy.data.objects[name].hide_get()


def test_lights_and_cameras_are_not_hidden(bpy, cube):
    bpy.ops.object.light_add(type="POINT")
    lamp = bpy.context.object
    bpy.ops.accelscope.add_sample_scene(sample="tetra")
    assert not lamp.hide_get()


def test_it_is_in_view(bpy, cube):
    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    view = area.spaces.active.region_3d
    view.view_location, view.view_distance = (900.0, 0.0, 0.0), 1.0
    with bpy.context.temp_override(area=area):
        bpy.ops.accelscope.add_sample_scene(sample="suzanne")
    assert view.view_location.length < 3.0
    assert 1.0 < view.view_distance < 50.0
