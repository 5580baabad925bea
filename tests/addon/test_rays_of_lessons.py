"""A ray chosen in Blender: by a click, by two handles, as a pixel of a heat map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


@pytest.fixture
def taught(bpy: Any) -> Any:
    """Teach a lesson by its name, and return what is shown."""
    from accelscope.addon.results import lesson_view

    def teach(name: str, **knobs: Any) -> Any:
        teaching = bpy.context.scene.accelscope.teaching
        teaching.lesson = name
        for key, value in knobs.items():
            setattr(getattr(bpy.context.scene.accelscope.lessons, name), key, value)
        bpy.ops.mesh.primitive_monkey_add()
        assert bpy.ops.accelscope.teach(subject="MESH") == {"FINISHED"}
        return lesson_view.current

    yield teach
    lesson_view.current.clear()


def test_the_ray_that_is_picked_is_stepped(bpy: Any, taught: Any) -> None:
    view = taught("ray")
    own = view.subject.rays
    assert own is None
    origin, direction = np.array([0.1, -5.0, 0.2]), np.array([0.0, 1.0, 0.0])
    view.choose_ray(bpy.context.scene, origin, direction)
    assert view.lesson.name == "ray"
    assert view.fault == ""
    assert len(view.subject.rays) == 1
    np.testing.assert_array_equal(view.play.walk.rays.origins[view.play.walk.ray], origin)
    hits, _ = view.subject.structures[0].trace(view.subject.rays)
    assert view.play.walk.t_hit == hits.t[0] < np.inf
    assert view.play.ends["ray"] == 0


def test_two_handles_aim_the_ray(bpy: Any, taught: Any) -> None:
    view = taught("ray")
    teaching = bpy.context.scene.accelscope.teaching
    teaching.aim = True
    scene = view.subject.scene
    way = np.subtract(teaching.ray_to, teaching.ray_from)
    assert way[0] > scene.upper[0] - scene.lower[0]
    teaching.ray_from, teaching.ray_to = (0.0, -3.0, 0.0), (0.0, -1.0, 0.0)
    rays = view.subject.rays
    np.testing.assert_allclose(rays.origins[0], (0.0, -3.0, 0.0))
    np.testing.assert_allclose(rays.directions[0], (0.0, 2.0, 0.0))
    # Both in one place are no ray: what is shown stays.
    teaching.ray_from = teaching.ray_to
    assert view.fault == ""
    np.testing.assert_array_equal(view.subject.rays.origins, rays.origins)


def test_a_pixel_is_chosen_and_its_ray_stepped(bpy: Any, taught: Any) -> None:
    view = taught("heat_map", width=40)
    scene = bpy.context.scene
    assert view.has_pixels()
    view.choose_pixel(scene, 0.5, 0.4)
    group = scene.accelscope.lessons.heat_map
    height = view.picture.images[0].pixels.shape[0]
    assert (group.column, group.row) == (20, int(0.4 * height))
    # Below the map is its scale.
    view.choose_pixel(scene, 0.99, 0.999)
    assert (group.column, group.row) == (39, 29)
    view.choose_pixel(scene, 0.5, 0.5)
    ray = view.ray()
    counted = view.picture.images[0].values[group.row, group.column]
    assert bpy.ops.accelscope.step_this_ray() == {"FINISHED"}
    assert view.lesson.name == "ray"
    assert scene.accelscope.teaching.lesson == "ray"
    walk = view.play.walk
    np.testing.assert_array_equal(walk.rays.directions[walk.ray], ray.directions[0])
    assert walk.steps.tally()["N_TS"] == counted


def test_lessons_without_a_ray_have_none_to_pick(bpy: Any, taught: Any) -> None:
    view = taught("levels")
    assert not view.has_pixels()
    assert view.ray() is None
    assert not bpy.ops.accelscope.pick_ray.poll()
    with pytest.raises(RuntimeError):
        bpy.ops.accelscope.step_this_ray()


@pytest.mark.parametrize("perspective", ["PERSP", "ORTHO"])
def test_the_heat_map_is_seen_from_the_viewport(bpy: Any, taught: Any, perspective: str) -> None:
    """Its rays are those of the view; tour_lessons.py asks Blender itself, in a window."""
    from accelscope.addon.drawing.viewport import largest, window_of
    from accelscope.core.scene.camera_rays import camera_rays
    from mathutils import Quaternion, Vector

    view = taught("heat_map", width=16)
    area = largest(bpy.context.window)
    region, space = window_of(area), area.spaces.active
    seen = space.region_3d
    seen.view_perspective = perspective
    seen.view_rotation = Quaternion((0.7, 0.5, 0.2, -0.4)).normalized()
    seen.view_location, seen.view_distance = (1.0, 2.0, 3.0), 8.0
    with bpy.context.temp_override(area=area, region=region):
        assert bpy.ops.accelscope.use_this_view() == {"FINISHED"}
    assert view.fault == ""
    assert len(view.play.rays) == 16 * 12
    # Three by three: the middles of the rows are at the sixths of the height.
    rays = camera_rays(view.subject.scene.camera, 3, 3)
    upper = 36.0 / space.lens * region.height / max(region.width, region.height)
    eye = seen.view_location + seen.view_rotation @ Vector((0.0, 0.0, 8.0))
    for number, share in ((4, 0.0), (1, 2 / 3), (7, -2 / 3)):
        # A point in the plane that the view turns about.
        point = np.array(
            seen.view_location + seen.view_rotation @ Vector((0, 8.0 * share * upper, 0))
        )
        way = rays.directions[number] / np.linalg.norm(rays.directions[number])
        between = point - rays.origins[number]
        np.testing.assert_allclose(np.cross(between / np.linalg.norm(between), way), 0.0, atol=1e-5)
        if perspective == "PERSP":
            np.testing.assert_allclose(rays.origins[number], eye, rtol=1e-5)
        else:
            np.testing.assert_allclose(np.cross(way, rays.directions[4]), 0.0, atol=1e-6)
