"""Rays go where Blender's own projection of the scene's camera says."""

import itertools

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import CameraSettings, CameraWorkload
from accelscope.core.scene import Camera
from accelscope.core.scene.camera_rays import camera_rays
from accelscope.core.structures.naive import Naive

SIZES = ((8, 8), (12, 6), (5, 9))
PIXELS = ((1.0, 1.0), (2.0, 1.0), (1.0, 1.5))
SHIFTS = ((0.0, 0.0), (0.3, -0.2))


def test_the_picture_of_the_file_is_hit_by_every_ray(bpy, cases, evaluate):
    # Its rectangle is exactly what the camera shows, beside the view direction.
    (record,) = evaluate(
        cases / "camera_shift.blend", "--structure", "bvh", "--rays", "camera:width=20,height=20"
    )
    assert record["trace"]["hits"] == 400
    camera = record["rays"]["camera"]
    assert (camera["source"], camera["name"]) == ("scene", "c")
    assert (camera["kind"], camera["shift"]) == ("perspective", [0.5, 0.0])


@pytest.fixture
def extraction(bpy):
    from accelscope.addon.from_blender import extraction

    bpy.ops.mesh.primitive_cube_add()
    return extraction


def place(bpy, obj, scale=(1, 1, 1)):
    from mathutils import Matrix, Quaternion

    turned = Quaternion((0.5, 0.4, -0.3, 0.7)).normalized()
    obj.matrix_world = Matrix.LocRotScale((1, 2, 3), turned, scale)
    bpy.context.scene.camera = obj


def add_camera(bpy, **values):
    data = bpy.data.cameras.new("Lens")
    for name, value in values.items():
        setattr(data, name, value)
    camera = bpy.data.objects.new("Own", data)
    bpy.context.scene.collection.objects.link(camera)
    return camera


def assert_rays_pass_the_middles_of_pixels(bpy, extraction, width, height):
    """Project two points of every ray with Blender's matrices."""
    scene = extraction.extract(bpy.context, extraction.VISIBLE)
    rays = CameraWorkload.make(scene, CameraSettings(width=width, height=height))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = bpy.context.scene.camera.evaluated_get(depsgraph)
    render = bpy.context.scene.render
    projection = np.array(
        camera.calc_matrix_camera(
            depsgraph, x=width, y=height,
            scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y,
        ),
        dtype=float,
    )  # fmt: skip
    view = np.linalg.inv(np.array(camera.matrix_world.normalized(), dtype=float))
    x = 2.0 * (np.arange(width) + 0.5) / width - 1.0
    y = 1.0 - 2.0 * (np.arange(height) + 0.5) / height
    expected = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    for t in (1.0, 7.0):
        points = np.c_[rays.origins + t * rays.directions, np.ones(len(rays))]
        seen = points @ (projection @ view).T
        # Blender's matrices are single precision.
        np.testing.assert_allclose(seen[:, :2] / seen[:, 3:], expected, atol=2e-6)
        np.testing.assert_allclose(points[:, :3] @ -view[2, :3], t - view[2, 3] * -1, atol=1e-5)


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_shift_fit_aspect_resolution_and_pixels(bpy, extraction, kind, fit):
    camera = add_camera(
        bpy, type=kind, sensor_fit=fit, lens=35.0, sensor_width=36.0, sensor_height=20.0,
        ortho_scale=5.0,
    )  # fmt: skip
    place(bpy, camera)
    render = bpy.context.scene.render
    for shift, size, pixel in itertools.product(SHIFTS, SIZES, PIXELS):
        camera.data.shift_x, camera.data.shift_y = shift
        render.pixel_aspect_x, render.pixel_aspect_y = pixel
        assert_rays_pass_the_middles_of_pixels(bpy, extraction, *size)


@pytest.mark.parametrize("scale", [(2, 3, 0.5), (-1, 1, 1), (1, -2, 1), (1, 1, -1), (-1, -2, -3)])
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_scales_of_the_object_at_most_mirror(bpy, extraction, kind, scale):
    place(bpy, add_camera(bpy, type=kind), scale)
    assert_rays_pass_the_middles_of_pixels(bpy, extraction, 7, 5)


def test_a_parents_scale_shears(bpy, extraction):
    camera = add_camera(bpy)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    camera.parent, camera.rotation_euler, parent.scale = parent, (0.2, 0.3, 0.7), (1, 3, 2)
    bpy.context.scene.camera = camera
    scene = extraction.extract(bpy.context, extraction.VISIBLE)
    assert abs(scene.camera.right @ scene.camera.up) > 0.1
    assert_rays_pass_the_middles_of_pixels(bpy, extraction, 7, 5)


@pytest.mark.parametrize("kind", ["EMPTY", "POINT", "SPOT", "MESH"])
def test_any_object_can_be_the_camera(bpy, extraction, kind):
    if kind == "EMPTY":
        obj = bpy.data.objects.new("Own", None)
        bpy.context.scene.collection.objects.link(obj)
    elif kind == "MESH":
        obj = bpy.context.object
    else:
        obj = bpy.data.objects.new("Own", bpy.data.lights.new("Lamp", kind))
        bpy.context.scene.collection.objects.link(obj)
        if kind == "SPOT":
            obj.data.spot_size = 0.6
    place(bpy, obj)
    for size in SIZES:
        assert_rays_pass_the_middles_of_pixels(bpy, extraction, *size)


def test_far_from_the_origin_the_direction_stays(bpy, extraction):
    camera = add_camera(bpy)
    camera.location = (1e8, -1e8, 1e8)
    camera.rotation_euler = (0.3, 0.2, 0.1)
    bpy.context.scene.camera = camera
    far = extraction.extract(bpy.context, extraction.VISIBLE).camera
    camera.location = (0, 0, 0)
    near = extraction.extract(bpy.context, extraction.VISIBLE).camera
    directions = (camera_rays(each, 3, 3).directions for each in (far, near))
    np.testing.assert_allclose(*directions, atol=1e-12)


# Without Blender: closed forms of the core's own cameras.

EYE, AHEAD, UP = np.array([1.0, 2.0, 3.0]), np.array([1.0, 12.0, 3.0]), np.array([0.0, 0.0, 1.0])


def test_a_shift_of_a_half_begins_at_the_view_direction():
    camera = Camera(EYE, AHEAD, UP, 90.0, shift=(0.5, 0.0))
    rays = camera_rays(camera, 3, 3, corner=True)
    slopes = rays.directions.reshape(3, 3, 3)
    np.testing.assert_allclose(slopes[1], [(0, 1, 0), (1, 1, 0), (2, 1, 0)], atol=1e-15)


def test_an_orthographic_camera_has_parallel_rays_over_its_scale():
    camera = Camera(EYE, AHEAD, UP, 0.0, kind="orthographic", scale=8.0, fit="height")
    rays = camera_rays(camera, 5, 3, corner=True)
    assert (rays.directions == (0.0, 1.0, 0.0)).all()
    across, above = np.meshgrid(np.linspace(-20 / 3, 20 / 3, 5), (4.0, 0.0, -4.0))
    expected = EYE + np.stack([across, np.zeros_like(across), above], axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(rays.origins, expected, atol=1e-14)


def test_every_structure_traces_orthographic_rays_alike(make_scene_with):
    from accelscope.core.structures import general_structures

    scene = make_scene_with(Camera(EYE, np.zeros(3), UP, 0.0, kind="orthographic", scale=3.0))
    rays = CameraWorkload.make(scene, CameraSettings(width=40, height=30))
    expected, _ = Naive.build(scene, Naive.Settings()).trace(rays)
    assert 200 < (expected.primitive >= 0).sum() < 1200
    for structure in general_structures().values():
        hits, _ = structure.build(scene, structure.Settings()).trace(rays)
        np.testing.assert_array_equal(hits.t, expected.t, err_msg=structure.name)
        np.testing.assert_array_equal(hits.primitive, expected.primitive, err_msg=structure.name)


@pytest.fixture
def make_scene_with():
    """Make Suzanne seen by a camera."""
    import dataclasses

    from accelscope.sample_scenes import make_sample

    def make(camera):
        return dataclasses.replace(make_sample("suzanne:subdivisions=0"), camera=camera)

    return make
