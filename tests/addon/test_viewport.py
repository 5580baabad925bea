"""The view shows given points, whatever else is in the scene."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


@pytest.mark.parametrize("perspective", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("turned", [(1.0, 0.0, 0.0, 0.0), (0.7, 0.5, 0.2, -0.4)])
def test_the_view_shows_the_points(bpy: Any, perspective: str, turned: tuple[float, ...]) -> None:
    from accelscope.addon.drawing.viewport import look_at, slopes_of
    from mathutils import Quaternion, Vector

    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    space = area.spaces.active
    view = space.region_3d
    view.view_perspective = perspective
    view.view_rotation = Quaternion(turned).normalized()
    points = np.random.default_rng(1).normal(size=(30, 3)) * [9, 2, 1] + [40, -7, 3]
    look_at(area, points)
    eye = view.view_location + view.view_rotation @ Vector((0, 0, view.view_distance))
    relative = [view.view_rotation.inverted() @ (Vector(point) - eye) for point in points]
    slopes = slopes_of(area, space.lens)
    shares = []
    for place in relative:
        assert place.z < 0
        unit = -place.z if perspective == "PERSP" else view.view_distance
        for value, (low, high) in zip((place.x, place.y), slopes, strict=False):
            shares.append(value / unit / (high if value > 0 else low))
    assert max(map(abs, shares)) <= 1.0 + 1e-4
    assert max(shares) == pytest.approx(1.0, abs=1e-3)
    assert min(shares) == pytest.approx(-1.0, abs=1e-3)


@pytest.mark.parametrize("perspective", ["PERSP", "ORTHO"])
def test_of_several_rooms_that_is_taken_where_points_are_largest(
    bpy: Any, perspective: str
) -> None:
    from accelscope.addon.drawing.viewport import look_at, room_in

    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    view = area.spaces.active.region_3d
    view.view_perspective = perspective
    view.view_rotation = (1.0, 0.0, 0.0, 0.0)
    whole = room_in(area)
    middle = 0.5 * (whole.left + whole.right), 0.5 * (whole.bottom + whole.top)
    right, below = whole._replace(left=middle[0]), whole._replace(top=middle[1])
    distances = {}
    for size in ((10.0, 1.0), (1.0, 10.0)):
        points = np.array(np.meshgrid([0, size[0]], [0, size[1]], [0, 1])).reshape(3, -1).T
        for rooms in ([right], [below], [right, below], [below, right], [whole], []):
            look_at(area, points, rooms)
            distances[size, tuple(rooms)] = view.view_distance
        one, other = distances[size, (right,)], distances[size, (below,)]
        assert (other < one) == (size[0] > size[1])
        assert distances[size, (right, below)] == distances[size, (below, right)] == min(one, other)
        assert distances[size, (whole,)] == distances[size, ()] <= min(one, other)
