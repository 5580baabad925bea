"""Ctrl-C, a request to terminate and a defect keep the records there were."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from accelscope.core.evaluation import experiment

TETRA = "sample:tetra:depth=1"
SMALL = ("--rays", "camera:width=4,height=3", "--quiet")


@pytest.fixture
def stop_at(monkeypatch):
    """Let the building of a structure raise."""

    def at(name, error):
        build = experiment.build

        def stopping(scene, structure_type, *arguments):
            if structure_type.name == name:
                raise error
            return build(scene, structure_type, *arguments)

        monkeypatch.setattr(experiment, "build", stopping)

    return at


def test_ctrl_c(run, stop_at, tmp_path):
    stop_at("grid", KeyboardInterrupt())
    outcome = run("evaluate", TETRA, "--structure", "bvh", "grid", "naive", *SMALL,
                  "--json", tmp_path / "a.json", "--pictures", tmp_path / "p")  # fmt: skip
    assert outcome.code == 1
    assert outcome.err == "accelscope: error: stopped; 1 of 3 records were measured\n"
    (record,) = json.loads((tmp_path / "a.json").read_text())["records"]
    assert record["structure"]["name"] == "bvh"
    assert (tmp_path / "p" / "index.html").read_text().count("<section>") == 1


def test_ctrl_c_before_anything_was_measured(run, stop_at, tmp_path):
    (tmp_path / "a.json").write_text("old")
    stop_at("bvh", KeyboardInterrupt())
    outcome = run("evaluate", TETRA, *SMALL, "--json", tmp_path / "a.json")
    assert (outcome.code, outcome.err) == (2, "accelscope: error: stopped\n")
    assert (tmp_path / "a.json").read_text() == "old"


def test_a_defect_keeps_its_traceback_and_the_records(run, stop_at, tmp_path):
    stop_at("grid", ZeroDivisionError("a defect"))
    with pytest.raises(ZeroDivisionError, match="a defect"):
        run("evaluate", TETRA, "--structure", "bvh", "grid", *SMALL, "--json", tmp_path / "a.json")
    assert len(json.loads((tmp_path / "a.json").read_text())["records"]) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals(tmp_path, number):
    """The naive algorithm takes minutes over what the BVH has done at once."""
    words = ["evaluate", "sample:tetra", "--structure", "bvh", "naive", "--rays",
             "random_lines:count=3000000", "--json", "a.json", "--pictures", "p"]  # fmt: skip
    process = subprocess.Popen(
        [sys.executable, "-m", "accelscope", *words], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    # The last picture of the BVH is written just before the naive algorithm begins.
    seen = tmp_path / "p" / "tetra-bvh-ray.png"
    deadline = time.monotonic() + 120.0
    while not seen.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(1.0)
    os.kill(process.pid, number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 1, err
    assert "accelscope: error: stopped; 1 of 2 records were measured" in err
    (record,) = json.loads((tmp_path / "a.json").read_text())["records"]
    assert record["structure"]["name"] == "bvh"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "p"]
