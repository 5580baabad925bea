"""Rays do not end where Blender's camera clips: that is said if it makes a difference."""

import pytest


@pytest.fixture
def notes(bpy):
    """Return the notes of a cube, 9 to 11 units before a camera with these clip distances."""
    from accelscope.addon.from_blender import extraction

    bpy.ops.mesh.primitive_cube_add(location=(0, 0, -10))
    camera = bpy.data.objects.new("Own", bpy.data.cameras.new("Lens"))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera

    def of(start, end):
        camera.data.clip_start, camera.data.clip_end = start, end
        return extraction.extract(bpy.context, extraction.VISIBLE).notes

    return of


def test_only_where_something_is_clipped(notes):
    assert notes(0.1, 1000.0) == ()
    assert notes(8.9, 11.1) == ()
    said = "the camera Own clips what is nearer than {:g} or farther than {:g}; its rays do not"
    assert notes(0.1, 10.5) == (said.format(0.1, 10.5),)
    assert notes(9.5, 100.0) == (said.format(9.5, 100.0),)
