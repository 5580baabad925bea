"""Refit and the comparison over the timeline, in Blender."""

import json
import math

import numpy as np
import pytest


@pytest.fixture
def twist(bpy):
    """A grid that is twisted from frame 3 to frame 6."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12, size=4)
    modifier = bpy.context.object.modifiers.new("twist", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.deform_axis = "TWIST", "X"
    for frame, angle in ((3, 0.0), (6, 2 * math.pi)):
        modifier.angle = angle
        modifier.keyframe_insert("angle", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 3, 6
    bpy.context.scene.frame_set(4)
    return bpy


def test_frames_come_from_the_timeline_and_it_goes_back(twist):
    from accelscope.addon.from_blender import timeline
    from accelscope.core.progress import SILENT

    scene = twist.context.scene
    numbers = timeline.frame_range(scene)
    assert list(numbers) == [3, 4, 5, 6]
    frames = timeline.Frames(twist.context, "visible", numbers)
    found = dict(frames.iterate(SILENT))
    frames.restore()
    assert list(found) == [3, 4, 5, 6]
    assert np.ptp(found[3].triangles[..., 2]) == pytest.approx(0.0, abs=1e-5)
    assert np.ptp(found[6].triangles[..., 2]) > 1.0
    assert scene.frame_current == 4


def test_refit_follows_a_deformation(twist, root, current):
    with pytest.raises(RuntimeError, match="poll"):
        twist.ops.accelscope.refit()
    twist.context.scene.frame_set(3)
    twist.ops.accelscope.build()
    tree, before = current.built.structure, current.record["statistics"]["sah"]
    twist.context.scene.frame_set(6)
    assert twist.ops.accelscope.refit() == {"FINISHED"}
    assert current.status(twist.context).up_to_date
    assert np.array_equal(current.built.structure.arrays.first, tree.arrays.first)
    assert current.built.structure.validate() == []
    assert current.record["method"] == "refit"
    assert current.record["statistics"]["sah"] > 1.2 * before
    assert twist.ops.accelscope.trace() == {"FINISHED"}


def test_refit_says_when_the_triangles_are_others(twist, root, current):
    twist.ops.accelscope.build()
    twist.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="build anew"):
        twist.ops.accelscope.refit()
    assert current.built is not None


def test_comparison_over_the_timeline(twist, root, current, tmp_path):
    assert twist.ops.accelscope.compare_over_timeline() == {"FINISHED"}
    assert twist.context.scene.frame_current == 4
    assert current.status(twist.context).up_to_date
    assert [record["frame"] for record in current.timeline] == [3, 3, 4, 4, 5, 5, 6, 6]
    assert [moment.frame for moment in current.history] == [3, 4, 5, 6]
    path = tmp_path / "figures.json"
    twist.ops.accelscope.export(filepath=str(path), format="JSON")
    records = json.loads(path.read_text())["records"]
    assert [record.get("frame") for record in records] == [None, 3, 3, 4, 4, 5, 5, 6, 6]
    twist.ops.accelscope.build()
    assert current.timeline == []
    assert len(current.history) == 0


def test_comparison_needs_a_hierarchy(twist, root):
    root.structure = "grid"
    with pytest.raises(RuntimeError, match="poll"):
        twist.ops.accelscope.compare_over_timeline()


def test_frames_for_a_thread_are_served_one_by_one(twist):
    import threading

    from accelscope.addon.from_blender.timeline import Frames
    from accelscope.core.progress import SILENT

    frames = Frames(twist.context, "visible", range(3, 7))
    found = []
    thread = threading.Thread(target=lambda: found.extend(frames.iterate(SILENT)), daemon=True)
    thread.start()
    for _ in range(200):
        frames.serve()
        thread.join(0.01)
        if not thread.is_alive():
            break
    assert [number for number, _ in found] == [3, 4, 5, 6]
    frames.restore()
    assert twist.context.scene.frame_current == 4


def test_command_line(twist, tmp_path, capsys):
    from accelscope.addon.command.main import main

    path = tmp_path / "twist.blend"
    twist.ops.wm.save_as_mainfile(filepath=str(path))
    capsys.readouterr()
    assert main(["animate", str(path), "--frames", "3:6:3", "--json", "-", "--quiet"]) == 0
    from_path = json.loads(capsys.readouterr().out)["records"]
    assert [record["frame"] for record in from_path] == [3, 3, 6, 6]
    # As ``blender --command accelscope animate`` does with the file that is open.
    assert main(["animate", "--json", "-", "--quiet"], lambda: None) == 0
    from_open = json.loads(capsys.readouterr().out)["records"]
    assert [record["frame"] for record in from_open] == [3, 3, 4, 4, 5, 5, 6, 6]
    costs = [[r["statistics"]["sah"] for r in rs] for rs in (from_path[-2:], from_open[-2:])]
    assert costs[0] == costs[1]


def test_two_levels_over_the_timeline(bpy, root, current):
    """Objects move, one mesh is bent: the top level is built anew, the rest kept or refitted."""
    bpy.ops.mesh.primitive_monkey_add()
    first = bpy.context.object
    for number in range(3):
        twin = bpy.data.objects.new(f"Twin{number}", first.data)
        bpy.context.collection.objects.link(twin)
        twin.location.x = 3.0 + 3.0 * number
        twin.keyframe_insert("location", frame=1)
        twin.location.y = 4.0
        twin.keyframe_insert("location", frame=3)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, location=(0, 0, -3))
    bent = bpy.context.object.modifiers.new("bend", "SIMPLE_DEFORM")
    bent.deform_method = "BEND"
    for frame, angle in ((1, 0.0), (3, 1.5)):
        bent.angle = angle
        bent.keyframe_insert("angle", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
    root.structure = "two_level"
    assert bpy.ops.accelscope.compare_over_timeline() == {"FINISHED"}
    assert [record["frame"] for record in current.timeline] == [1, 1, 2, 2, 3, 3]
    for record in current.timeline:
        assert record["scene"]["instances"] == {"count": 5, "meshes": 2, "triangles": 968 + 128}
        assert record["statistics"]["sah_two_levels"] > 0.0
    # The same rays hit the same in what was refitted and in what was built anew.
    for refit, rebuild in zip(current.timeline[::2], current.timeline[1::2], strict=True):
        assert refit["trace"]["hits"] == rebuild["trace"]["hits"]
    assert current.history[-1].refit >= current.history[0].refit * 0.5
    root.instances = "objects"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    bpy.context.scene.frame_set(3)
    assert bpy.ops.accelscope.refit() == {"FINISHED"}
    assert current.status(bpy.context).up_to_date
    assert current.built.structure.validate() == []
