"""What is refused in a batch is a line and a failed record; everything else is measured."""

import csv
import json

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.structures import general_structures, structure_named

TETRA = "sample:tetra:size=1"
RAYS = ("--rays", "camera:width=4,height=3", "random_lines:count=5")


def test_a_structure_that_is_refused(run, tmp_path):
    outcome = run(
        "evaluate", TETRA, "--structure", "bvh", "grid:resolution=99999", "naive", *RAYS,
        "--json", tmp_path / "a.json", "--csv", tmp_path / "a.csv", "--pictures", tmp_path / "p",
    )  # fmt: skip
    assert outcome.code == 1
    # Where the kernels are new, lines above say that they are compiled.
    (line,) = (line for line in outcome.err.splitlines() if "error" in line)
    assert line.startswith("accelscope: error: tetra, grid: 999 970 000 299 999 cells of the grid")

    records = json.loads((tmp_path / "a.json").read_text())["records"]
    combinations = [(s, r) for s in ("bvh", "grid", "naive") for r in ("camera", "random_lines")]
    assert [(r["structure"]["name"], r["rays"]["name"]) for r in records] == combinations
    for record in records:
        if record["structure"]["name"] == "grid":
            assert set(record) == {"scene", "structure", "rays", "environment", "error"}
            assert record["scene"] == records[0]["scene"]
            assert record["structure"]["settings"]["resolution"] == [99999] * 3
            assert record["rays"]["settings"]
            assert line.endswith(record["error"])
        else:
            assert "error" not in record
            assert record["trace"]["N_IT"] >= 0

    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    assert [bool(row["error"]) for row in rows] == ["error" in record for record in records]
    assert [row["statistics.N_V"] == "" for row in rows] == ["error" in r for r in records]

    table = outcome.out.splitlines()
    assert len(table) == 2 + 6
    assert [" failed: " in row for row in table[2:]] == ["error" in r for r in records]
    page = (tmp_path / "p" / "index.html").read_text()
    assert page.count('class="failed"') == 1
    assert page.count("<section>") == 3


@pytest.mark.parametrize("error", [InputError("too much of it"), MemoryError()])
@pytest.mark.parametrize("when", ["build", "trace", "statistics"])
def test_all_structures_but_one(run, monkeypatch, error, when):
    octree = structure_named("octree")
    calls = []

    def refuse(*arguments, **options):
        # The first calls are those of the warm-up over a tiny scene.
        if when == "statistics" or len(calls) > 0:
            raise error
        calls.append(1)
        return original(*arguments, **options)

    original = getattr(octree, when)
    monkeypatch.setattr(octree, when, refuse)
    outcome = run("evaluate", TETRA, "--structure", "all", *RAYS[:2], "--json", "-", "--quiet")
    assert outcome.code == 1
    (line,) = outcome.err.splitlines()
    assert str(error) in line
    assert "octree" in line
    failed = [r["structure"]["name"] for r in outcome.records if "error" in r]
    assert failed == ["octree"]
    assert [r["structure"]["name"] for r in outcome.records] == list(general_structures())


def test_scenes_that_cannot_be_read(run, obj, tmp_path):
    broken = tmp_path / "broken.ply"
    broken.write_text("no mesh")
    missing, unknown = tmp_path / "missing.obj", tmp_path / "picture.jpeg"
    outcome = run(
        "evaluate", broken, TETRA, missing, unknown, obj(), *RAYS, "--json", "-", "--quiet"
    )
    assert outcome.code == 1
    assert len(outcome.err.splitlines()) == 3
    for path, line in zip((broken, missing, unknown), outcome.err.splitlines(), strict=True):
        assert line.startswith(f"accelscope: error: {path}: ")
    assert [r["scene"]["name"] for r in outcome.records] == [
        name for name in ("broken", "tetra", "missing", "picture", "mesh") for _ in range(2)
    ]
    assert ["error" in r for r in outcome.records] == [True, True, False, False, True, True, True,
                                                       True, False, False]  # fmt: skip
    assert outcome.records[0]["scene"] == {"name": "broken", "source": str(broken)}


def test_rays_that_a_scene_cannot_have(run, obj):
    outcome = run(
        "evaluate", obj(), "sample:tetra", "--structure", "bvh", "naive", "--rays",
        "camera:width=4,height=3,shadows=true", "random_lines:count=5", "--json", "-", "--quiet",
    )  # fmt: skip
    assert outcome.code == 1
    (line,) = outcome.err.splitlines()
    assert "rays camera: mesh has no" in line
    assert ["error" in r for r in outcome.records] == [True, False, True, False] + [False] * 4


def test_figures_that_are_no_numbers(run, monkeypatch):
    grid = structure_named("grid")
    statistics = grid.statistics

    def endless(self, progress):
        found = statistics(self, progress)
        object.__setattr__(found, "sah", float("inf"))
        return found

    monkeypatch.setattr(grid, "statistics", endless)
    outcome = run(
        "evaluate", TETRA, "--structure", "grid", "bvh", *RAYS[:2], "--json", "-", "--quiet"
    )
    assert outcome.code == 1
    assert "statistics.sah is inf" in outcome.err
    assert ["error" in r for r in outcome.records] == [True, False]


def test_nothing_measured_is_2_and_writes_nothing(run, tmp_path):
    old = tmp_path / "old.json"
    old.write_text("yesterday's results")
    outcome = run(
        "evaluate", TETRA, "/nowhere.obj", "--structure", "grid:resolution=99999",
        "--rays", "camera", "--json", old, "--csv", tmp_path / "new.csv",
    )  # fmt: skip
    assert (outcome.code, outcome.out) == (2, "")
    assert len(outcome.err.splitlines()) == 2
    assert old.read_text() == "yesterday's results"
    assert list(tmp_path.iterdir()) == [old]


@pytest.mark.parametrize(
    "wrong",
    [
        ("--structure", "bvh", "bvh:bins=1"),
        ("--rays", "random_lines", "camera:focus=3"),
        ("--rays", "random_lines", "random_lines:count=1000000000000"),
        ("--rays", "random_lines", "camera:from=1x1x1,at=1x1x1"),
        ("--rays", "random_lines", "file:path=/nowhere.npz"),
        ("sample:nothing",),
        ("sample:tetra:size=99",),
        ("--threads", "-1"),
        ("--csv", "/proc/nowhere/a.csv"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_computed(refused, monkeypatch, wrong):
    from accelscope.core.evaluation.records import experiment

    monkeypatch.setattr(experiment, "build", None)
    refused("evaluate", TETRA, "sample:soup:count=5", *wrong)


def test_a_kind_of_volume_that_is_refused(run, obj, monkeypatch, tmp_path):
    from accelscope.core.evaluation.records.efficiency import Measurement

    measure = Measurement.of

    def refuse(self, kind):
        if kind == "sphere":
            raise InputError("no spheres today")
        return measure(self, kind)

    monkeypatch.setattr(Measurement, "of", refuse)
    outcome = run("efficiency", obj(), "--volume", "aabb", "sphere", "obb", "--lines", "500",
                  "--json", tmp_path / "a.json", "--pictures", tmp_path / "p")  # fmt: skip
    assert outcome.code == 1
    assert "accelscope: error: sphere: no spheres today" in outcome.err.splitlines()
    records = json.loads((tmp_path / "a.json").read_text())["records"]
    assert [r["volume"] for r in records] == ["aabb", "sphere", "obb"]
    assert set(records[1]) == {"scene", "volume", "settings", "environment", "error"}
    assert outcome.out.splitlines()[3].split(None, 1) == ["sphere", "failed: no spheres today"]
    assert "failed: no spheres today" in (tmp_path / "p" / "index.html").read_text()


def test_hits_that_cannot_be_written_do_not_lose_the_record(run, tmp_path):
    outcome = run("evaluate", TETRA, *RAYS[:2], "--hits", "/dev/full", "--json", tmp_path / "a",
                  "--quiet")  # fmt: skip
    assert outcome.code == 2
    assert "cannot write /dev/full" in outcome.err
    assert np.isfinite(json.loads((tmp_path / "a").read_text())["records"][0]["trace"]["N_TS"])
