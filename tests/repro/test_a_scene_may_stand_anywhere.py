"""A SCENE after ``--rays`` is a scene, and a SCENE alone is enough."""

import itertools

import pytest

TETRA = "sample:tetra:size=1"
RAYS = ("--rays", "camera:width=2,height=2")


def test_a_scene_alone(evaluate):
    (record,) = evaluate(TETRA)
    assert record["structure"]["name"] == "bvh"
    assert record["rays"]["name"] == "random_lines"


@pytest.mark.parametrize(
    "order", list(itertools.permutations(["scene", "rays", "structure", "threads"]))
)
def test_every_order_of_arguments(evaluate, obj, order):
    words = {
        "scene": [obj()],
        "rays": [*RAYS, "random_lines:count=3"],
        "structure": ["--structure", "bvh", "naive"],
        "threads": ["--threads", "1"],
    }
    records = evaluate(*[word for name in order for word in words[name]])
    assert [r["scene"]["name"] for r in records] == ["mesh"] * 4
    assert [r["structure"]["name"] for r in records] == ["bvh", "bvh", "naive", "naive"]
    assert [r["rays"]["count"] for r in records] == [4, 3] * 2


def test_scenes_come_in_the_order_in_which_they_are_named(evaluate, obj):
    path = obj(name="first.obj")
    records = evaluate(
        "--structure", "bvh", path, "--threads", "1", "sample:soup:count=5", *RAYS, TETRA
    )
    assert [record["scene"]["name"] for record in records] == ["first", "soup", "tetra"]


def test_scenes_of_other_commands(run, obj):
    for words in (["--volume", "aabb"], ["--direction", "1x0x0"]):
        out = run("efficiency", "--lines", "500", "--quiet", "--json", "-", *words, obj())
        assert (out.code, out.err) == (0, "")
    assert "takes one SCENE, not 2" in run("efficiency", obj(), "--volume", TETRA, "aabb").err


def test_what_is_neither_is_named(refused, obj, tmp_path, monkeypatch):
    assert "there is no structure 'bhv'" in refused("evaluate", TETRA, "--structure", "bhv")
    assert "there are no rays 'cam'" in refused("evaluate", TETRA, "--rays", "cam")
    assert "--rays names no rays, only a scene" in refused("evaluate", "--rays", obj())
    assert "--no-such" in refused("evaluate", TETRA, "--no-such", "x")
    monkeypatch.chdir(tmp_path)
    obj(name="bvh:a.obj")
    line = refused("evaluate", TETRA, "--structure", "bvh:a.obj")
    assert "write ./bvh:a.obj" in line


def test_a_file_called_like_a_structure_does_not_stand_in_its_way(evaluate, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bvh").write_text("notes")
    (record,) = evaluate(TETRA, "--structure", "bvh")
    assert record["structure"]["name"] == "bvh"
