# SPDX-License-Identifier: GPL-3.0-or-later
"""In a small viewport images left no room for lines: a lesson ended as a defect (division by 0)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.bpy


def test_a_lesson_of_wide_images_is_taught(bpy: Any) -> None:
    """Without a window, viewports are small."""
    bpy.context.scene.accelscope.teaching.lesson = "less_rays_samples"
    assert bpy.ops.accelscope.teach() == {"FINISHED"}
    assert bpy.ops.accelscope.end_lesson() == {"FINISHED"}


@pytest.mark.parametrize("perspective", ["PERSP", "ORTHO"])
def test_rooms_without_width_are_left_out(bpy: Any, perspective: str) -> None:
    from accelscope.addon.drawing.viewport import look_at, room_in

    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    view = area.spaces.active.region_3d
    view.view_perspective = perspective
    points, whole = np.random.default_rng(1).normal(size=(30, 3)), room_in(area)
    look_at(area, points, [whole])
    distance = view.view_distance
    for right in (whole.left, whole.left - 50.0, whole.left + 3.0):
        none = whole._replace(right=right)
        look_at(area, points, [none])
        assert view.view_distance == distance
        look_at(area, points, [none, whole])
        assert view.view_distance == distance
