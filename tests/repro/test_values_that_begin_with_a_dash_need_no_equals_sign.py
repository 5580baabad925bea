"""``--direction -1x0x0`` and ``--frames -1:1`` are values, not options."""

import pytest


def test_directions(run, obj):
    out = run("efficiency", obj(), "--volume", "aabb", "--lines", "500", "--json", "-", "--quiet",
              "--direction", "-1x0x0", "1x-1x0", "-.5x0x1", "--direction", "-1e-3x0x0")  # fmt: skip
    assert (out.code, out.err) == (0, "")
    assert list(out.records[0]["projected"]) == ["-1x0x0", "1x-1x0", "-.5x0x1", "-1e-3x0x0"]


@pytest.mark.bpy
def test_frames(run, tmp_path):
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    path = tmp_path / "cube.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    out = run("animate", path, "--frames", "-1:1", "--rays", "random_lines:count=10", "--json", "-",
              "--quiet")  # fmt: skip
    assert out.code == 0, out.err
    assert [record["frame"] for record in out.records] == [-1, -1, 0, 0, 1, 1]


def test_numbers_that_are_refused_are_named(refused, obj):
    assert "--threads must be 0 to 1024, not -1" in refused("evaluate", obj(), "--threads", "-1")
    assert "lines must be at least 100 and at most 1e+07, not -5" in refused(
        "efficiency", obj(), "--lines", "-5"
    )


def test_other_values_that_begin_with_a_dash(run, tmp_path, monkeypatch, obj):
    monkeypatch.chdir(tmp_path)
    obj(name="-1.obj")
    out = run("evaluate", "-1.obj", "--rays", "camera:width=2,height=2", "--json", "-5", "--quiet")
    assert (out.code, out.err) == (0, "")
    assert (tmp_path / "-5").read_text().startswith("{")
