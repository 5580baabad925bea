# SPDX-License-Identifier: GPL-3.0-or-later
"""After a lesson on a sample of CSG trees, the operands of its modifiers stayed in the file.

They lie in collections within that of the sample, which was all that was marked as a lesson's.
"""

from __future__ import annotations

from typing import Any

import pytest
from accelscope.core.lessons import lessons

pytestmark = pytest.mark.bpy

KINDS = (
    "scenes", "objects", "meshes", "collections", "cameras", "lights", "texts", "images",
    "node_groups", "particles", "curves", "materials", "worlds",
)  # fmt: skip


def everything(bpy: Any) -> list[str]:
    return [f"{kind} {each.name}" for kind in KINDS for each in getattr(bpy.data, kind)]


SAMPLES = {each.sample.partition(":")[0]: name for name, each in lessons().items()}
"""One lesson for each sample that any of them is about."""


FEW = {"csg_classic", "overlapping"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if sample in FEW else pytest.mark.exhaustive)
        for sample, name in SAMPLES.items()
    ],
)
def test_nothing_of_a_lessons_scene_stays(bpy: Any, name: str) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    before = everything(bpy)
    bpy.context.scene.accelscope.teaching.lesson = name
    assert bpy.ops.accelscope.teach() == {"FINISHED"}
    assert len(everything(bpy)) > len(before) + 2
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}
    assert everything(bpy) == before
