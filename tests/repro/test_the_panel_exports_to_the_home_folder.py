"""``~/x.json`` lies in the home folder, as in Blender's window for files; // is the .blend's."""

import json
from pathlib import Path

import pytest


@pytest.fixture
def built(bpy, monkeypatch, tmp_path):
    for name in ("home", "work"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("USERPROFILE", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "work")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "cube.blend"))
    bpy.ops.accelscope.build()
    return bpy


@pytest.mark.parametrize(
    ("given", "place"),
    [
        ("~/x.json", "home/x.json"),
        ("~/new/x", "home/new/x.json"),
        ("//x.json", "x.json"),
        ("//~/x.json", "~/x.json"),
        ("x~.json", "work/x~.json"),
    ],
)
def test_export(built, tmp_path, given, place):
    before = set(tmp_path.rglob("*.json"))
    assert built.ops.accelscope.export(filepath=given, format="JSON") == {"FINISHED"}
    assert set(tmp_path.rglob("*.json")) - before == {tmp_path / Path(place)}
    (record,) = json.loads((tmp_path / place).read_text())["records"]
    assert record["scene"]["triangles"] == 12
