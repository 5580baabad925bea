"""What is refused in Blender is said in one line, in the words of the panel."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import pytest
from accelscope.core.settings import key_of

SYNTAX = re.compile(r"(?<![\w/])[a-z]+_\w+|\w+=\w+|'\w+'|--\w+")
"""Keys, pairs of key and value, and options, as the command line takes them."""


def everything() -> list[tuple[str, Any]]:
    from accelscope.core.evaluation.rays.workloads import workloads
    from accelscope.core.structures import structures
    from accelscope.sample_scenes import samples

    return [*structures().items(), *workloads().items(), *samples().items()]


@pytest.fixture
def in_panel(bpy: Any) -> Any:
    from accelscope.addon.results.wording import in_panel

    return in_panel


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ("lower max_depth or choose storage=pointer", "lower Max Depth or choose Storage Pointer"),
        (
            "rays camera: 'from' and 'at' are the same point",
            "Camera: From and At are the same point",
        ),
        ("choose another 'up'", "choose another Up"),
        ("a kdtree over 5 triangles", "a kd-Tree over 5 triangles"),
        ("a tree of sbvh cuts triangles", "a tree of SBVH cuts triangles"),
        ("a tree of binned_sah", "a tree of Binned SAH"),
        ("Tracing macro_grid", "Tracing Grid with Macro-Cells"),
        ("structure bsp: 5\nlines", "BSP Tree: 5 lines"),
        # What is no name of ours stays as it is.
        ("there is no file /tmp/max_depth/sbvh.npz", "there is no file /tmp/max_depth/sbvh.npz"),
        ("a grid of 10x10 cells from a file", "a grid of 10x10 cells from a file"),
        ("the mesh of Cube.001 is bad", "the mesh of Cube.001 is bad"),
        ("", ""),
    ],
)
def test_wording(in_panel: Any, message: str, said: str) -> None:
    assert in_panel(message) == said


def test_every_setting_and_choice_has_another_word(in_panel: Any) -> None:
    count = 0
    for _, entry in everything():
        for field in dataclasses.fields(entry.Settings):
            key, label = key_of(field), field.metadata["label"]
            assert in_panel(f"choose '{key}'") == f"choose {label}"
            if "_" in key:
                assert in_panel(f"lower {key}, please") == f"lower {label}, please"
            for choice in field.metadata["choices"] or ():
                said = in_panel(f"choose {key}={choice}")
                assert said.startswith(f"choose {label} ")
                assert "=" not in said
                count += 1
    assert count > 60


REFUSED = [
    ("octree", {"max_depth": 21, "storage": "implicit"}, ""),
    ("grid", {"resolution": (10_000, 10_000, 10_000)}, ""),
    ("bvh", {"builder": "sbvh"}, "refit"),
]


@pytest.mark.parametrize(("name", "values", "verb"), REFUSED)
def test_refused_structures(
    bpy: Any, root: Any, current: Any, name: str, values: dict[str, Any], verb: str
) -> None:
    from accelscope.addon import jobs

    bpy.ops.mesh.primitive_monkey_add()
    root.structure = name
    for key, value in values.items():
        setattr(getattr(root.structures, name), key, value)
    if verb:
        bpy.ops.accelscope.build()
        bpy.context.object.location.x = 1.0
    with pytest.raises(RuntimeError) as caught:
        getattr(bpy.ops.accelscope, verb or "build")()
    text = str(caught.value).removeprefix("Error: ").strip()
    assert not SYNTAX.search(text), text
    assert "\n" not in text
    refusal = jobs.refusal()
    assert refusal == f"{'Not refitted' if verb else 'Not built'}: {text}"
    # It is said until something else is done.
    root.structure = "naive"
    bpy.ops.accelscope.build()
    assert jobs.refusal() == ""


def test_refused_rays(bpy: Any, root: Any) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.accelscope.build()
    root.workload = "file"
    root.workloads.file.path = ""
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.accelscope.trace()
    text = str(caught.value)
    assert "path" in text
    assert not SYNTAX.search(text), text
    root.workload = "camera"
    camera = root.workloads.camera
    camera.from_ = camera.at = (1.0, 2.0, 3.0)
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.accelscope.trace()
    assert not SYNTAX.search(str(caught.value)), str(caught.value)


def test_values_outside_their_limits(bpy: Any) -> None:
    from types import SimpleNamespace

    from accelscope.addon.settings import generated
    from accelscope.core.errors import InputError
    from accelscope.core.structures.bvh import BVH

    values = {field.name: field.default for field in dataclasses.fields(BVH.Settings)}
    group = SimpleNamespace(**values | {"max_leaf_size": 5000})
    with pytest.raises(InputError, match=r"^BVH: Max Leaf Size must be at least 1 and at most"):
        generated.read(group, BVH.Settings, BVH.label)


def test_settings_without_effect_say_where_they_have_one(bpy: Any, root: Any) -> None:
    count = 0
    for name, entry in everything():
        group = getattr(root.structures, name, None) or getattr(root.workloads, name, None)
        if group is None:
            continue
        labels = {f.name: f.metadata["label"] for f in dataclasses.fields(entry.Settings)}
        for field in dataclasses.fields(entry.Settings):
            description = group.bl_rna.properties[field.name].description
            only_for = field.metadata["only_for"] or {}
            assert ("; only for " in description) == bool(only_for)
            for other in only_for:
                assert labels[other] in description
                count += 1
            assert not SYNTAX.search(description.partition("; only for ")[2]), description
    assert count >= 6
