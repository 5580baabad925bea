"""No other camera is taken in silence for one that no rays are made of."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.pages.picture_cameras import picture_camera
from accelscope.core.evaluation.rays.workloads import (
    CameraSettings,
    CameraWorkload,
    RandomLinesSettings,
    RandomLinesWorkload,
)


@pytest.fixture
def scene_with(bpy):
    """Return the scene that Blender has, with its camera of some kind."""
    from accelscope.addon.from_blender import extraction

    bpy.ops.mesh.primitive_cube_add()

    def make(scale=(1, 1, 1), parent_scale=None, **values):
        data = bpy.data.cameras.new("Lens")
        for name, value in values.items():
            setattr(data, name, value)
        camera = bpy.data.objects.new("Own", data)
        camera.scale = scale
        if parent_scale:
            parent = bpy.data.objects.new("Parent", None)
            bpy.context.scene.collection.objects.link(parent)
            camera.parent, parent.scale = parent, parent_scale
            camera.rotation_euler = (0.3, 0.4, 0.5)
        bpy.context.scene.collection.objects.link(camera)
        bpy.context.scene.camera = camera
        return extraction.extract(bpy.context, extraction.VISIBLE)

    return make


BAD = [
    ({"type": "PANO"}, "panoramic"),
    ({"scale": (0, 0, 0)}, "scale of zero"),
    ({"scale": (1, 0, 1)}, "scale of zero"),
    ({"parent_scale": (1, 1, 1e-9)}, "flat"),
]


@pytest.mark.parametrize(("values", "reason"), BAD)
def test_it_is_named_with_the_reason_and_a_way_out(scene_with, values, reason):
    scene = scene_with(**values)
    with pytest.raises(InputError) as caught:
        CameraWorkload.make(scene, CameraSettings())
    text = str(caught.value)
    assert text.startswith("no rays can be made of the scene's camera 'Own', which is ")
    assert reason in text
    assert "make it perspective or orthographic" in text
    # Everything else goes on, and so do rays of a camera of one's own.
    assert len(RandomLinesWorkload.make(scene, RandomLinesSettings(count=5))) == 5
    own = CameraSettings(from_=(0.0, -5.0, 0.0), at=(0.0, 0.0, 0.0), width=2, height=2)
    assert len(CameraWorkload.make(scene, own)) == 4
    assert picture_camera(scene).has_rays


def test_the_kind_of_panorama_is_named(bpy, scene_with):
    if "panorama_type" not in bpy.types.Camera.bl_rna.properties:
        pytest.skip("in Blender 4.5 this is a property of Cycles, which the module has not")
    for item in bpy.types.Camera.bl_rna.properties["panorama_type"].enum_items:
        kind = item.identifier
        scene = scene_with(type="PANO", panorama_type=kind)
        words = kind.replace("_", " ").lower()
        with pytest.raises(InputError, match=rf"which is panoramic \({words}\)"):
            CameraWorkload.make(scene, CameraSettings())


def test_on_the_command_line(bpy, scene_with, refused, tmp_path):
    scene_with(type="PANO")
    path = tmp_path / "panorama.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    line = refused("evaluate", path, "--structure", "bvh", "--rays", "camera")
    assert "'Own', which is panoramic" in line


def test_trace_in_blender_reports_it(bpy, scene_with, root):
    scene_with(type="PANO")
    bpy.ops.accelscope.build()
    root.workload = "camera"
    with pytest.raises(RuntimeError, match="'Own', which is panoramic"):
        bpy.ops.accelscope.trace()


def test_a_camera_of_a_missing_library(bpy, scene_with, tmp_path, refused):
    scene_with()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, taken):
        taken.objects = ["Own"]
    bpy.context.scene.collection.objects.link(taken.objects[0])
    bpy.context.scene.camera = taken.objects[0]
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    (tmp_path / "library.blend").unlink()
    line = refused("evaluate", path, "--structure", "bvh", "--rays", "camera", "--quiet")
    assert "'Own', which is missing" in line


def test_an_angle_of_view_for_an_orthographic_camera_is_refused(scene_with):
    scene = scene_with(type="ORTHO")
    with pytest.raises(InputError, match="'Own' is orthographic and has no angle of view"):
        CameraWorkload.make(scene, CameraSettings(fov=30.0))
    rays = CameraWorkload.make(scene, CameraSettings(width=4, height=4))
    assert np.unique(rays.directions, axis=0).shape == (1, 3)
