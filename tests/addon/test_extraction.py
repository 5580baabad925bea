"""Extraction gives the triangles that Blender shows, in world space."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.scene.camera_rays import window_of

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


@pytest.fixture
def extraction(bpy: Any) -> Any:
    from accelscope.addon.from_blender import extraction

    return extraction


def visible(bpy: Any, extraction: Any, instances: str = "keep") -> Any:
    return extraction.extract(bpy.context, extraction.VISIBLE, instances)


def mesh_object(bpy: Any, name: str, vertices: Any, faces: Any) -> Any:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def corners_of(triangles: np.ndarray) -> np.ndarray:
    return np.unique(np.round(triangles.reshape(-1, 3), 5), axis=0)


def test_triangles_stand_where_the_transform_puts_them(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add(location=(1, 2, 3), rotation=(0, 0, np.pi / 2), scale=(1, 2, 3))
    scene = visible(bpy, extraction)
    assert len(scene) == 12
    # The quarter turn brings the y axis, scaled by 2, to the x axis.
    np.testing.assert_array_equal(
        corners_of(scene.triangles), corners_of(CUBE * (2, 1, 3) + (1, 2, 3))
    )
    assert scene.triangles.dtype == np.float64
    assert scene.triangles.flags.c_contiguous


def test_parents_are_followed(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    bpy.ops.object.empty_add(location=(10, 0, 0))
    cube.parent = bpy.context.object
    np.testing.assert_allclose(visible(bpy, extraction).lower, (9, -1, -1))


def test_modifiers_are_applied(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    array = bpy.context.object.modifiers.new("Array", "ARRAY")
    array.count = 3
    scene = visible(bpy, extraction, "flatten")
    assert len(scene) == 36
    np.testing.assert_allclose(scene.upper, (5, 1, 1))


def test_triangles_are_grouped_by_object(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.mesh.primitive_plane_add(location=(0, 0, 5))
    scene = visible(bpy, extraction)
    assert dict(zip(scene.object_names, np.bincount(scene.object_ids), strict=True)) == {
        "Cube": 12,
        "Plane": 2,
    }
    plane = scene.triangles[scene.object_ids == scene.object_names.index("Plane")]
    assert (plane[:, :, 2] == 5).all()


def test_order_is_that_of_the_loop_triangles(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_ico_sphere_add()
    mesh = bpy.context.object.data
    expected = [[mesh.vertices[v].co for v in t.vertices] for t in mesh.loop_triangles]
    np.testing.assert_array_equal(visible(bpy, extraction).triangles, np.array(expected))


@pytest.mark.parametrize("way", ["eye", "viewport", "collection"])
def test_hidden_objects_are_left_out(bpy: Any, extraction: Any, way: str) -> None:
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    if way == "eye":
        cube.hide_set(True)
    elif way == "viewport":
        cube.hide_viewport = True
    else:
        hidden = bpy.data.collections.new("Hidden")
        bpy.context.scene.collection.children.link(hidden)
        hidden.objects.link(cube)
        bpy.context.scene.collection.objects.unlink(cube)
        bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True
    assert visible(bpy, extraction).object_names == ("Plane",)


def test_selected_scope_takes_the_selected_only(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.mesh.primitive_cube_add()  # adding selects it, and it alone
    scene = extraction.extract(bpy.context, extraction.SELECTED)
    assert scene.object_names == ("Cube",)


def test_collection_instances_are_expanded(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    source = bpy.data.collections.new("Source")
    source.objects.link(cube)
    bpy.context.scene.collection.objects.unlink(cube)
    for x in (0.0, 10.0, 20.0):
        empty = bpy.data.objects.new(f"Instance{x:g}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", source
        empty.location.x = x
        bpy.context.scene.collection.objects.link(empty)
    scene = visible(bpy, extraction, "flatten")
    assert len(scene) == 36
    assert sorted(scene.object_names) == ["Instance0/Cube", "Instance10/Cube", "Instance20/Cube"]
    np.testing.assert_allclose(scene.upper, (21, 1, 1))

    bpy.data.objects["Instance10"].select_set(True)
    scene = extraction.extract(bpy.context, extraction.SELECTED)
    np.testing.assert_allclose((scene.lower, scene.upper), ((9, -1, -1), (11, 1, 1)))


def test_linked_duplicates_and_mirrored_scale(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    twin = bpy.data.objects.new("Twin", bpy.context.object.data)
    twin.scale.x, twin.location.x = -1, 5
    bpy.context.collection.objects.link(twin)
    scene = visible(bpy, extraction, "flatten")
    halves = [scene.triangles[scene.object_ids == number] for number in (0, 1)]
    own, mirrored = halves if scene.object_names[0] == "Suzanne" else halves[::-1]
    np.testing.assert_allclose(mirrored, own * (-1, 1, 1) + (5, 0, 0), atol=1e-6)


@pytest.mark.parametrize("kind", ["text", "surface", "curve", "metaball"])
def test_what_evaluates_to_a_mesh_is_taken_once(bpy: Any, extraction: Any, kind: str) -> None:
    if kind == "text":
        bpy.ops.object.text_add()
    elif kind == "surface":
        bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    elif kind == "curve":
        bpy.ops.curve.primitive_bezier_circle_add()
        bpy.context.object.data.bevel_depth = 0.1
    else:
        bpy.ops.object.metaball_add()
    obj = bpy.context.object
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    count = len(evaluated.to_mesh().loop_triangles)
    evaluated.to_mesh_clear()
    assert count > 0
    scene = visible(bpy, extraction)
    assert len(scene) == count
    assert scene.object_names == (obj.name,)
    assert len(extraction.extract(bpy.context, extraction.SELECTED)) == count


def test_edit_mode_shows_what_is_being_edited(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    assert len(visible(bpy, extraction)) == 48
    bpy.ops.object.mode_set(mode="OBJECT")


def test_nothing_there_is_said_clearly(bpy: Any, extraction: Any) -> None:
    with pytest.raises(InputError, match="no mesh with faces is visible"):
        visible(bpy, extraction)
    mesh_object(bpy, "Empty", [], [])
    mesh_object(bpy, "Edges", [(0, 0, 0), (1, 0, 0)], [])
    with pytest.raises(InputError, match="no mesh with faces is visible"):
        visible(bpy, extraction)
    mesh_object(bpy, "Face", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    assert visible(bpy, extraction).object_names == ("Face",)
    with pytest.raises(InputError, match="no mesh with faces is selected"):
        extraction.extract(bpy.context, extraction.SELECTED)


def test_triangles_that_are_not_finite_are_dropped_and_counted(bpy: Any, extraction: Any) -> None:
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (float("nan"), 0, 1), (0, float("inf"), 1)]
    mesh_object(bpy, "Broken", vertices, [(0, 1, 3), (0, 1, 2), (0, 1, 4)])
    scene = visible(bpy, extraction)
    assert (len(scene), scene.dropped) == (1, 2)
    assert scene.primitive_ids.tolist() == [1]


def test_only_degenerate_triangles_are_refused(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add(scale=(0, 0, 0))
    with pytest.raises(InputError, match="zero area"):
        visible(bpy, extraction)


# ------------------------------------------------------------------------------ camera and lights


def add_camera(bpy: Any, **values: Any) -> Any:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.camera_add(location=(1, 2, 3), rotation=(np.pi / 2, 0, 0))
    camera = bpy.context.object
    for name, value in values.items():
        setattr(camera.data, name, value)
    bpy.context.scene.camera = camera
    return camera


def test_camera_looks_where_blenders_does(bpy: Any, extraction: Any) -> None:
    add_camera(bpy).scale = (2, 2, 2)
    camera = visible(bpy, extraction).camera
    np.testing.assert_allclose(camera.position, (1, 2, 3))
    np.testing.assert_allclose(camera.target, (1, 3, 3), atol=1e-6)
    np.testing.assert_allclose(camera.up, (0, 0, 1), atol=1e-6)


@pytest.mark.parametrize("size", [(1920, 1080), (1080, 1920), (500, 500)])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
def test_field_of_view_is_that_of_the_larger_side(
    bpy: Any, extraction: Any, fit: str, size: tuple[int, int]
) -> None:
    camera = add_camera(bpy, sensor_fit=fit, lens=35.0, sensor_width=36.0, sensor_height=20.0)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = size
    # Blender's own corners of the picture, one unit before the camera.
    frame = np.array(camera.data.view_frame(scene=bpy.context.scene))
    half = np.abs(frame[:, :2] / frame[:, 2:]).max()
    window = window_of(visible(bpy, extraction).camera, *size)
    np.testing.assert_allclose(max(window[2:]), half, rtol=1e-5)


def test_no_camera_is_none(bpy: Any, extraction: Any) -> None:
    camera = add_camera(bpy)
    assert visible(bpy, extraction).camera is not None
    bpy.data.objects.remove(camera)
    assert visible(bpy, extraction).camera is None


# ----------------------------------------------------------------------------------------- files


def test_load_blend(bpy: Any, extraction: Any, tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_cube_add()
    path = tmp_path / "cube.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = extraction.load_blend(path)
    assert (len(scene), scene.name, scene.source) == (12, "cube", str(path))


def test_load_blend_says_what_is_wrong(bpy: Any, extraction: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no file"):
        extraction.load_blend(tmp_path / "missing.blend")
    broken = tmp_path / "broken.blend"
    broken.write_bytes(b"no blend at all")
    with pytest.raises(InputError, match="cannot be read"):
        extraction.load_blend(broken)


# ----------------------------------------------------------------------------------- fingerprints


def test_fingerprint_tells_what_changed(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    bpy.ops.mesh.primitive_plane_add()

    def fingerprint() -> dict[str, Any]:
        from accelscope.addon.from_blender import fingerprint

        depsgraph = bpy.context.evaluated_depsgraph_get()
        parts = extraction.collect(depsgraph, extraction.VISIBLE)
        return {each.name: each for each in fingerprint.fingerprint(parts).values()}

    before = fingerprint()
    assert fingerprint() == before
    cube.location.x = 1
    moved = fingerprint()
    assert moved["Plane"] == before["Plane"]
    assert moved["Cube"] != before["Cube"]
    cube.location.x = 0
    assert fingerprint() == before
    cube.modifiers.new("Bevel", "BEVEL")
    assert fingerprint()["Cube"] != before["Cube"]
