"""Programs of the pipeline in Blender: the picture as an image, calls as figures, texts as code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from accelscope.core.pipeline.loading import source_of


@pytest.fixture
def built(bpy: Any, root: Any, current: Any) -> Any:
    """A monkey before a camera, lit by a point, and a BVH over it."""
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.camera_add(location=(0.0, -6.0, 0.5), rotation=(1.5, 0.0, 0.0))
    bpy.context.scene.camera = bpy.context.object
    bpy.ops.object.light_add(type="POINT", location=(2.0, -4.0, 3.0))
    root.workloads.camera.width, root.workloads.camera.height = 24, 16
    bpy.ops.accelscope.build()
    return current


def pixels_of(image: Any) -> np.ndarray:
    pixels = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)


@pytest.mark.parametrize("name", ["lecture", "shadows"])
def test_the_picture_is_an_image_and_calls_are_figures(
    bpy: Any, built: Any, root: Any, name: str
) -> None:
    root.pipeline.program = name
    assert bpy.ops.accelscope.run_program() == {"FINISHED"}
    launch = built.launched["launch"]
    assert launch["calls"]["ray_generation"] == 24 * 16
    assert launch["calls"]["closest_hit"] > 20
    (image,) = [each for each in bpy.data.images if each.name == name]
    assert tuple(image.size) == (24, 16)
    lit = pixels_of(image)[..., :3].sum(axis=2) > 0.0
    assert lit.sum() == launch["calls"]["closest_hit"]


def test_a_text_is_run_when_it_is_named_and_not_before(bpy: Any, built: Any, root: Any) -> None:
    text = bpy.data.texts.new("mine.py")
    source = source_of("lecture").replace("from __future__ import annotations\n", "")
    text.write("from __future__ import annotations\nimport bpy\nbpy.context.scene['ran'] = 1\n")
    text.write(source)
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.run_program()
    assert "ran" not in bpy.context.scene
    assert bpy.ops.accelscope.run_program(text="mine.py") == {"FINISHED"}
    assert bpy.context.scene["ran"] == 1
    assert built.launched["program"]["name"] == "mine.py"


def test_a_bad_text_is_one_message(bpy: Any, built: Any) -> None:
    text = bpy.data.texts.new("bad.py")
    text.write("PROGRAM = 1\n")
    with pytest.raises(RuntimeError, match=r"bad.py has no PROGRAM"):
        bpy.ops.accelscope.run_program(text="bad.py")
    with pytest.raises(RuntimeError, match="there is no text"):
        bpy.ops.accelscope.run_program(text="nothing.py")
    assert built.launched is None


def test_a_copy_of_a_program_is_a_program(bpy: Any, built: Any, root: Any) -> None:
    root.pipeline.program = "mirror"
    bpy.ops.accelscope.copy_program()
    assert bpy.data.texts["mirror.py"].as_string() == source_of("mirror")
    assert bpy.ops.accelscope.run_program(text="mirror.py") == {"FINISHED"}
    assert built.launched["launch"]["by_class"]["reflected"]["trace_ray"] > 0


def test_masks_of_objects_decide_what_a_program_sees(bpy: Any, root: Any, current: Any) -> None:
    for place, mask in (((-2.0, 0.0, 0.0), 1), ((2.0, 0.0, 0.0), 4)):
        bpy.ops.mesh.primitive_cube_add(location=place)
        bpy.context.object.accelscope_instance.mask = mask
    bpy.ops.object.camera_add(location=(0.0, -12.0, 0.0), rotation=(np.pi / 2.0, 0.0, 0.0))
    bpy.context.scene.camera = bpy.context.object
    root.workloads.camera.width, root.workloads.camera.height = 32, 16
    root.instances, root.pipeline.program = "objects", "masks"
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.run_program()
    pixels = pixels_of(bpy.data.images["masks"])
    left, right = pixels[:, :16], pixels[:, 16:]
    assert left[..., 0].max() > 0.9 > 0.1 > left[..., 2].max()
    assert right[..., 2].max() > 0.9 > 0.1 > right[..., 0].max()
    assert pixels[..., 1].max() < 0.1
