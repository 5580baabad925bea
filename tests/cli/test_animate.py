"""``accelscope animate``: mesh files as frames, outputs, and refusals in one line."""

import csv
import json

import numpy as np
import pytest


@pytest.fixture
def steps(obj, five):
    """Three frames of five triangles that drift apart."""
    shift = np.arange(5.0)[:, None, None] * np.array([1.0, 3.0, -2.0])
    return [obj(five + n * shift[:, :, [n % 3] * 3], f"step{n}.obj") for n in range(3)]


def test_outputs(run, steps, tmp_path):
    out = run("animate", *steps, "--json", tmp_path / "a.json", "--csv", tmp_path / "a.csv",
              "--pictures", tmp_path / "page", "--rays", "random_lines:count=100")  # fmt: skip
    # Whoever is the first to refit is told that it is compiled.
    assert out.code == 0
    assert not [line for line in out.err.splitlines() if "compiling" not in line]
    assert len(out.out.splitlines()) == 2 + 3
    records = json.loads((tmp_path / "a.json").read_text())["records"]
    assert [record["frame"] for record in records] == [0, 0, 1, 1, 2, 2]
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    assert [row["method"] for row in rows] == ["refit", "rebuild"] * 3
    assert [float(row["statistics.sah"]) for row in rows] == [
        record["statistics"]["sah"] for record in records
    ]
    assert (tmp_path / "page" / "cost.svg").read_text().startswith("<svg")
    assert (tmp_path / "page" / "index.html").exists()


def test_json_on_standard_output(run, steps):
    out = run("animate", *steps, "--json", "-", "--quiet", "--structure", "bvh:max_leaf_size=1")
    assert (out.code, out.err) == (0, "")
    assert out.records[0]["structure"]["settings"]["max_leaf_size"] == 1


def test_two_levels_follow_their_objects(run, steps):
    out = run("animate", *steps, "--json", "-", "--quiet", "--structure", "two_level",
              "--rays", "random_lines:count=100")  # fmt: skip
    assert (out.code, out.err) == (0, "")
    for refit, rebuild in zip(out.records[::2], out.records[1::2], strict=True):
        assert refit["scene"]["instances"]["count"] == 1
        assert refit["trace"]["hits"] == rebuild["trace"]["hits"]


def test_a_frame_with_other_triangles_fails_alone(run, steps, obj, five, tmp_path):
    fewer = obj(five[:3], "fewer.obj")
    out = run("animate", steps[0], fewer, steps[2], "--csv", tmp_path / "a.csv", "--pictures",
              tmp_path / "page", "--json", tmp_path / "a.json")  # fmt: skip
    assert out.code == 1
    (line,) = out.err.splitlines()
    assert line.startswith("accelscope: error: frame 1: the tree was built over 5 triangles")
    records = json.loads((tmp_path / "a.json").read_text())["records"]
    assert ["error" in record for record in records] == [False, False, True, True, False, False]
    assert records[2]["frame"] == 1
    assert records[2]["scene"]["triangles"] == 3
    assert out.out.splitlines()[3].split()[:2] == ["1", "failed:"]
    assert (tmp_path / "page" / "cost.svg").read_text().count("<circle") == 4


def test_refusals(refused, steps, obj, tmp_path):
    rng = np.random.default_rng(1)
    shared = obj(rng.random((300, 1, 3)) + 0.5 * rng.random((300, 3, 3)), "shared.obj")
    assert "only bvh" in refused("animate", *steps, "--structure", "grid")
    assert "only bvh" in refused("animate", *steps, "--structure", "all")
    assert "one each" in refused("animate", *steps, "--frames", "1:3")
    assert "one per frame" in refused("animate")
    assert "no file" in refused("animate", tmp_path / "none.blend")
    assert "pieces" in refused(
        "animate", shared, shared, "--quiet", "--structure", "bvh:builder=sbvh"
    )
    assert "overwrite" in refused("animate", steps[0], "--csv", steps[0])
    for text in ("x", "1:2:3:4", "", "1.5:3"):
        assert "A:B" in refused("animate", steps[0], "--frames", text or " ")
    for text in ("3:1", "1:3:0", "1:3:-1"):
        assert "no frame" in refused("animate", steps[0], "--frames", text)
    assert "ask for fewer" in refused("animate", steps[0], "--frames", "0:1000000")
