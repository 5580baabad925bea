"""``accelscope efficiency``: outputs, and refusals in one line."""

import csv
import json


def test_outputs(run, obj, tmp_path):
    mesh = obj()
    out = run("efficiency", mesh, "--volume", "aabb", "sphere", "aabb", "--lines", 500,
              "--json", tmp_path / "e.json", "--csv", tmp_path / "e.csv",
              "--pictures", tmp_path / "page")  # fmt: skip
    assert out.code == 0
    assert all("compiling the test of" in line for line in out.err.splitlines())
    assert len(out.out.splitlines()) == 2 + 2
    records = json.loads((tmp_path / "e.json").read_text())["records"]
    assert [record["volume"] for record in records] == ["aabb", "sphere"]
    assert records[0]["settings"]["lines"] == 500
    rows = list(csv.DictReader((tmp_path / "e.csv").open()))
    assert float(rows[0]["B_ns"]) == records[0]["B_ns"] > 0.0
    page = (tmp_path / "page" / "index.html").read_text()
    assert page.count("<figure>") == 2 * 4
    assert (tmp_path / "page" / "sphere-y.png").stat().st_size > 0


def test_directions(run, obj):
    out = run("efficiency", obj(), "--volume", "aabb", "--direction", "1x0x0", "1x1x1",
              "--lines", 500, "--json", "-", "--quiet")  # fmt: skip
    assert (out.code, out.err) == (0, "")
    assert list(out.records[0]["projected"]) == ["1x0x0", "1x1x1"]


def test_refusals(refused, obj, tmp_path):
    mesh = obj()
    assert "aabb, sphere" in refused("efficiency", mesh, "--volume", "cube")
    assert "no length" in refused("efficiency", mesh, "--direction", "0x0x0")
    assert "three numbers" in refused("efficiency", mesh, "--direction", "up")
    assert "lines must be at least 100" in refused("efficiency", mesh, "--lines", 1)
    assert "spread takes a number" in refused("efficiency", mesh, "--spread", "wide")
    assert "name at least one SCENE" in refused("efficiency")
    assert "overwrite" in refused("efficiency", mesh, "--csv", mesh)
    assert "no file" in refused("efficiency", tmp_path / "none.obj")
