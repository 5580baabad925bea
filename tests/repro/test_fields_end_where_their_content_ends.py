"""Event, level, depth, step and ray never stand beyond what there is; sliders span all of it."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.bpy


@pytest.fixture
def traced(bpy, root):
    bpy.ops.mesh.primitive_monkey_add()
    root.structure = "kdtree"
    bpy.ops.accelscope.build()
    root.workload = "random_lines"
    root.workloads.random_lines.count = 50
    bpy.ops.accelscope.trace()
    bpy.ops.accelscope.step_ray()
    return root


def ranges(root, current):
    """Return group, name and last value of every such field."""
    from accelscope.addon.results import lesson_view

    extent = current.drawable.extent
    return [
        (root.lessons.ray, "event", len(lesson_view.current.play.walk.steps) - 1),
        (root.display, "depth_min", extent.deepest),
        (root.display, "depth_max", extent.deepest),
    ]


def test_no_field_goes_beyond_its_end(traced, current):
    for group, name, last in ranges(traced, current):
        assert last > 0, name
        setattr(group, name, 500_000)
        assert getattr(group, name) == last
        assert getattr(group, f"{name}_share") == 100.0
        setattr(group, name, last - 1)
        assert getattr(group, name) == last - 1
        setattr(group, name, 0)
        assert getattr(group, f"{name}_share") == 0.0


def test_sliders_go_through_everything(traced, current):
    for group, name, last in ranges(traced, current):
        seen = set()
        for share in range(1001):
            setattr(group, f"{name}_share", 0.1 * share)
            seen.add(getattr(group, name))
        assert min(seen) == 0
        assert max(seen) == last
        if last <= 500:
            assert seen == set(range(last + 1)), name


def test_the_number_of_the_ray(traced):
    knobs = traced.lessons.ray  # which plays the lesson anew
    knobs.ray = 500_000
    assert (knobs.ray, knobs.ray_share) == (49, 100.0)
    knobs.ray_share = 0.0
    assert knobs.ray == 0


def test_knobs_of_lessons(bpy, root):
    from accelscope.addon.results import lesson_view

    bpy.ops.mesh.primitive_monkey_add()
    root.teaching.lesson = "levels"
    bpy.ops.accelscope.use_my_mesh()
    knobs, last = root.lessons.levels, lesson_view.current.play.ends["level"]
    knobs.level = 500
    assert knobs.level == last
    assert lesson_view.current.settings.level == last
    knobs.level_share = 0.0
    assert lesson_view.current.settings.level == 0
    lesson_view.current.clear()


def test_less_content_pulls_values_in_and_more_lets_them_out(bpy, traced, root, current):
    display = root.display
    display.depth_max = 500
    whole = display.depth_max
    root.structures.kdtree.max_depth = 3
    bpy.ops.accelscope.build()
    assert display.depth_max == current.drawable.extent.deepest == 3
    root.structures.kdtree.property_unset("max_depth")
    bpy.ops.accelscope.build()
    assert display.depth_max == whole
    # The largest depth means all of them, also of a deeper tree; a smaller one is kept.
    display.depth_max = whole - 1
    root.structures.kdtree.max_leaf_size = 1
    bpy.ops.accelscope.build()
    assert display.depth_max == whole - 1


def test_without_content_nothing_is_cut(bpy, root):
    root.lessons.ray.event = 40
    assert root.lessons.ray.event == 40
    assert root.display.depth_max == 5
    assert root.lessons.ray.event_share == 0.0
