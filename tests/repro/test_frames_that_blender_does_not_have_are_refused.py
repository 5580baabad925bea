"""Blender shows its last frame in place of one beyond it; what is measured is not of that frame."""

import pytest

RAYS = ("--rays", "random_lines:count=20", "--quiet")


@pytest.fixture
def blend(bpy, tmp_path):
    bpy.ops.mesh.primitive_cube_add()
    path = tmp_path / "cube.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.mark.parametrize("number", [3_000_000, -3_000_000, 1 << 31, 10**20])
def test_the_first_frame(run, blend, number):
    outcome = run("animate", blend, "--frames", str(number), *RAYS)
    assert (outcome.code, outcome.out, outcome.err) == (
        2, "", f"accelscope: error: there is no frame {number} on Blender's timeline\n",
    )  # fmt: skip


def test_frames_before_the_end_are_compared(run, blend, bpy):
    last = bpy.types.Scene.bl_rna.properties["frame_end"].hard_max
    outcome = run("animate", blend, "--frames", f"{last}:{last + 3}:3", "--json", "-", *RAYS)
    assert outcome.code == 1
    assert outcome.err == (
        f"accelscope: error: frame {last + 3}: there is no frame {last + 3} on Blender's timeline\n"
    )
    assert ["error" in record for record in outcome.records] == [False, False, True, True]
