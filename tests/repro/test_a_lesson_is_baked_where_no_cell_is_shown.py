"""Bake to Meshes makes an object of a lesson's lines, also when settings show no cell beside it."""

from __future__ import annotations

from typing import Any

import pytest


def test_a_lesson_is_baked_alone(bpy: Any, root: Any) -> None:
    from accelscope.addon.results import lesson_view

    bpy.ops.mesh.primitive_cube_add()
    root.structure = "bvh"
    root.workload = "random_lines"
    root.workloads.random_lines.count = 100
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    root.display.leaves_only = True
    root.display.depth_max = 0  # the root is no leaf
    with pytest.raises(RuntimeError, match="widen the depth range"):
        bpy.ops.accelscope.bake()
    assert bpy.ops.accelscope.trace() == {"FINISHED"}
    assert bpy.ops.accelscope.step_ray() == {"FINISHED"}
    assert bpy.ops.accelscope.bake() == {"FINISHED"}
    (baked,) = bpy.data.collections["AccelScope"].objects
    assert baked.name == lesson_view.current.lesson.label
    assert len(baked.data.edges) == len(lesson_view.current.picture.segments)
