"""A record carries versions, machine, threads and date, and camera and lights as used."""

import csv
import datetime
import platform

import numpy as np
import pytest
from accelscope.core.evaluation.records import environment
from accelscope.core.kernels import has_numba
from accelscope.core.parallel import core_count

CAMERA = "camera:width=20,height=10,shadows=true"
KEYS = {
    "accelscope", "blender", "python", "numpy", "numba", "processor", "cores", "threads",
    "platform", "date",
}  # fmt: skip


@pytest.fixture
def without_blender(monkeypatch):
    """A process that has not loaded Blender."""
    monkeypatch.setattr(environment, "_blender", None)


def test_the_environment(without_blender, evaluate):
    before = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
    (record,) = evaluate("sample:tetra:size=3", "--structure", "bvh", "--rays", CAMERA)
    found = record["environment"]
    assert set(found) == KEYS
    assert found["accelscope"] == "0.1.0"
    assert found["blender"] is None
    assert found["python"] == platform.python_version()
    assert found["numpy"] == np.__version__
    assert (found["numba"] is not None) == has_numba()
    assert found["processor"].strip()
    assert found["cores"] == found["threads"] == core_count()
    date = datetime.datetime.fromisoformat(found["date"])
    assert date.utcoffset() == datetime.timedelta(0)
    assert before <= date <= datetime.datetime.now(datetime.UTC)


def test_the_version_is_that_of_the_package():
    import tomllib
    from pathlib import Path

    project = Path(__file__).parents[2] / "pyproject.toml"
    assert environment.own_version() == tomllib.loads(project.read_text())["project"]["version"]


def test_the_threads_are_those_that_traced(evaluate):
    records = evaluate(
        "sample:tetra:size=3", "--structure", "bvh", "grid", "--rays", CAMERA, "--threads", 3
    )
    assert [record["environment"]["threads"] for record in records] == [3, 3]


def test_a_build_alone_has_traced_on_no_threads(bpy, current):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.accelscope.build()
    found = current.record["environment"]
    assert found["threads"] is None
    assert found["blender"] == bpy.app.version_string
    bpy.ops.accelscope.trace()
    assert current.record["environment"]["threads"] == core_count()


@pytest.mark.parametrize(
    ("scene", "rays", "source", "fov"),
    [
        ("sample:tetra:size=3", CAMERA, "scene", 45.0),
        ("sample:suzanne", "camera:width=20,height=10", "framing", 45.0),
        ("sample:tetra:size=3", f"{CAMERA},from=0x-9x0,at=0x1x0,fov=30", "settings", 30.0),
    ],
)
def test_the_camera_is_the_one_that_was_used(evaluate, scene, rays, source, fov):
    (record,) = evaluate(scene, "--structure", "bvh", "--rays", rays)
    camera = record["rays"]["camera"]
    assert (camera["source"], camera["kind"], camera["fov"]) == (source, "perspective", fov)
    if source == "settings":
        assert (camera["position"], camera["target"]) == ([0, -9, 0], [0, 1, 0])


def test_other_rays_have_no_camera(evaluate):
    (record,) = evaluate(
        "sample:tetra:size=3", "--structure", "bvh", "--rays", "random_lines:count=9"
    )
    assert "camera" not in record["rays"]
    assert record["scene"]["lights"] == [
        {"name": "", "kind": "point", "position": [2.0, -18.0, -5.0]}
    ]


def test_all_of_it_stands_in_the_csv(evaluate, tmp_path):
    path = tmp_path / "records.csv"
    evaluate("sample:tetra:size=3", "--structure", "bvh", "--rays", CAMERA, "--csv", path)
    (row,) = csv.DictReader(path.open(encoding="utf-8"))
    assert row["scene.lights.0.kind"] == "point"
    assert row["scene.lights.0.position"] == "2.0 -18.0 -5.0"
    assert row["rays.camera.source"] == "scene"
    assert row["environment.accelscope"] == "0.1.0"


SCENE_KEYS = {"name", "source", "triangles", "dropped_triangles", "bounds", "notes", "lights"}


def test_efficiency_carries_it_too(run, obj, monkeypatch):
    from accelscope.core.errors import InputError
    from accelscope.core.evaluation.records import efficiency

    def refuse(record):
        if record["volume"] == "sphere":
            raise InputError("no spheres today")

    monkeypatch.setattr(efficiency, "refuse_not_finite", refuse)
    outcome = run("efficiency", obj(), "--volume", "aabb", "sphere", "--lines", 500, "--json", "-",
                  "--quiet")  # fmt: skip
    assert outcome.code == 1
    assert ["error" in record for record in outcome.records] == [False, True]
    for record in outcome.records:
        assert set(record["environment"]) == KEYS
        assert record["environment"]["threads"] == 1
        assert set(record["scene"]) == SCENE_KEYS


def test_animations_carry_it_too(run, obj, five):
    frames = [obj(five, "0.obj"), obj(five[:3], "1.obj"), obj(five + 1.0, "2.obj"), "3.obj"]
    outcome = run("animate", *frames, "--rays", "random_lines:count=9", "--threads", 2, "--json",
                  "-", "--quiet")  # fmt: skip
    assert outcome.code == 1
    failed = [False, False, True, True, False, False, True, True]
    assert ["error" in record for record in outcome.records] == failed
    for record in outcome.records:
        assert set(record["environment"]) == KEYS
        assert record["environment"]["threads"] == (None if "error" in record else 2)
    for record in outcome.records[:6]:
        assert set(record["scene"]) == SCENE_KEYS


def test_refusals_carry_it_too(run):
    outcome = run("evaluate", "sample:tetra:size=3", "--structure", "bvh",
                  "grid:resolution=9999x9999x9999", "--rays", CAMERA, "--json", "-")  # fmt: skip
    assert outcome.code == 1
    made, refused = outcome.records
    assert "error" in refused
    assert set(refused["environment"]) == set(made["environment"]) == KEYS
    assert (made["environment"]["threads"], refused["environment"]["threads"]) == (
        core_count(),
        None,
    )
