"""The panel has its own words for settings, but none for names, values and lines of Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

OURS = ["seed", "max_depth", "sbvh", "binned_sah", "up", "bvh", "macro_grid", "kdop14", "rays bvh:"]
"""Names that a user may give to an object, and that the core has other words for."""


@pytest.fixture
def in_panel(bpy: Any) -> Any:
    from accelscope.addon.results.wording import in_panel

    return in_panel


@pytest.mark.parametrize(
    "text",
    [
        "bpy.data.meshes['seed'].validate()",
        'bpy.data.objects["max_depth"]',
        "there is no file '/tmp/my sbvh.npz' here",
        'the object "max_depth" is empty',
        '"a seed=3 of mine" stays',
        "'max_depth of sbvh'",
    ],
)
def test_what_is_quoted(in_panel: Any, text: str) -> None:
    assert in_panel(text) == text


def test_keys_of_settings_have_labels_beside_what_is_quoted(in_panel: Any) -> None:
    assert in_panel("the scene's 'up' of \"max_depth\": lower max_depth, not 'from'") == (
        'the scene\'s Up of "max_depth": lower Max Depth, not From'
    )


@pytest.mark.parametrize("name", [*OURS, "a[b(", "max_depth sbvh", "it's sbvh"])
def test_names_that_a_message_brings(in_panel: Any, name: str) -> None:
    message = f"the mesh of {name} is bad; lower max_depth"
    assert in_panel(message, name) == f"the mesh of {name} is bad; lower Max Depth".replace(
        "Max Depth", "max_depth" if name == "max_depth" else "Max Depth"
    )


@pytest.mark.parametrize("name", OURS[:6])
def test_an_invalid_mesh(bpy: Any, name: str) -> None:
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(3)
    mesh.loops.add(3)
    mesh.loops.foreach_set("vertex_index", np.array([0, 1, 7], dtype=np.int32))
    mesh.polygons.add(1)
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.accelscope.build()
    assert f"the mesh of {name} is invalid" in str(caught.value)
    assert f"bpy.data.meshes[{name!r}].validate()" in str(caught.value)


@pytest.mark.parametrize("name", ["up", "from", "seed"])
def test_a_camera(bpy: Any, root: Any, name: str) -> None:
    bpy.ops.mesh.primitive_cube_add()
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.data.type = "PANO"
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.ops.accelscope.build()
    with pytest.raises(RuntimeError, match=f"the scene's camera '{name}', which"):
        bpy.ops.accelscope.trace()


def test_a_file(bpy: Any, root: Any, tmp_path: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.accelscope.build()
    root.workload = "file"
    root.workloads.file.path = str(tmp_path / "my sbvh of max_depth.npz")
    with pytest.raises(RuntimeError, match=r"my sbvh of max_depth\.npz"):
        bpy.ops.accelscope.trace()


def test_a_frame_of_the_timeline(in_panel: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The number in front does not make its names ours."""
    from accelscope.addon.results.wording import refusal_in_panel
    from accelscope.core.errors import InputError
    from accelscope.core.evaluation.records import animation

    def refuse(*_: Any) -> None:
        raise InputError("the mesh of max_depth is bad", "max_depth")

    monkeypatch.setattr(animation.Comparison, "add", refuse)
    with pytest.raises(InputError) as caught:
        animation.animate([(3, None)], None, None, None, None)
    assert refusal_in_panel(caught.value) == "frame 3: the mesh of max_depth is bad"
