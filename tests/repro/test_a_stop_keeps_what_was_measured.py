"""Ctrl-C, a request to terminate, a kill and a defect keep the records there were."""

import argparse
import contextlib
import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from accelscope.addon.command import output as command_output
from accelscope.addon.stopping import Stops
from accelscope.core.evaluation.records import experiment

TETRA = "sample:tetra:size=1"
SMALL = ("--rays", "camera:width=4,height=3", "--quiet")


@pytest.fixture
def stop_at(monkeypatch):
    """Let the building of a structure raise."""

    def at(name, error):
        build = experiment.build

        def stopping(scene, structure_type, *arguments, **options):
            if structure_type.name == name:
                raise error
            return build(scene, structure_type, *arguments, **options)

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


def test_a_defect_keeps_its_traceback_and_leaves_the_other_records(run, stop_at, tmp_path):
    stop_at("grid", ZeroDivisionError("a defect"))
    outcome = run("evaluate", TETRA, "--structure", "bvh", "grid", "naive", *SMALL,
                  "--json", tmp_path / "a.json")  # fmt: skip
    assert outcome.code == 1
    assert "Traceback (most recent call last)" in outcome.err
    assert outcome.err.splitlines()[-1] == (
        "accelscope: error: tetra, grid: a defect of AccelScope: ZeroDivisionError: a defect"
    )
    records = json.loads((tmp_path / "a.json").read_text())["records"]
    assert [record.get("error") for record in records] == [
        None, "a defect of AccelScope: ZeroDivisionError: a defect", None,
    ]  # fmt: skip


def test_a_defect_alone_is_a_failure(run, stop_at, tmp_path):
    stop_at("grid", ZeroDivisionError("a defect"))
    outcome = run("evaluate", TETRA, "--structure", "grid", *SMALL, "--json", tmp_path / "a.json")
    assert outcome.code == 2
    assert "ZeroDivisionError: a defect" in outcome.err
    assert not (tmp_path / "a.json").exists()


ENDLESS = ["evaluate", "sample:tetra", "--structure", "bvh", "naive", "--rays",
           "random_lines:count=1500000", "--json", "a.json", "--csv", "a.csv",
           "--pictures", "p"]  # fmt: skip
"""The naive algorithm takes long over what the BVH has done at once."""

PROGRAM = """
import sys
from accelscope.core.evaluation.pages import view
view.WIDTH, view.HEIGHT = view.WIDTH // 4, view.HEIGHT // 4
from accelscope.__main__ import main
sys.exit(main())
"""
"""Accelscope that draws small pictures, which take less time."""


def heed_ctrl_c():
    """Undo what a shell does to what it starts in the background: Ctrl-C is ignored there."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextlib.contextmanager
def measuring(folder):
    """Yield a process that has measured the first record and is at the second."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *ENDLESS], cwd=folder, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heed_ctrl_c,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 120.0
        # The page is the last of the files that are written for a record.
        page = folder / "p" / "index.html"
        while not page.exists() or "<section>" not in page.read_text():
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        yield process
    finally:
        process.kill()
        process.communicate()


def check_files(folder):
    """Check that everything that was asked for holds the first record."""
    assert sorted(path.name for path in folder.iterdir()) == ["a.csv", "a.json", "p"]
    (record,) = json.loads((folder / "a.json").read_text())["records"]
    assert record["structure"]["name"] == "bvh"
    assert record["trace"]["N_IT"] > 0
    (row,) = csv.DictReader((folder / "a.csv").open())
    assert float(row["trace.N_IT"]) == record["trace"]["N_IT"]
    page = (folder / "p" / "index.html").read_text()
    assert page.count("<section>") == 1
    for name in re.findall(r'<img src="([^"]+)"', page):
        assert (folder / "p" / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")
@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.exhaustive)]
)
def test_signals(tmp_path, number):
    with measuring(tmp_path) as process:
        os.kill(process.pid, number)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 1, err
    assert "accelscope: error: stopped; 1 of 2 records were measured" in err
    check_files(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")
def test_a_process_that_is_killed(tmp_path):
    """By kill -9, or by a crash: nothing of it runs any more."""
    (tmp_path / "a.json").write_text("of yesterday")
    with measuring(tmp_path) as process:
        process.kill()
        process.communicate(timeout=30)
    check_files(tmp_path)


def test_what_there_is_so_far_is_not_written_all_the_time(monkeypatch, tmp_path):
    """Else a batch of thousands would write down the first of its records thousands of times."""
    now, written = [100.0], []
    monkeypatch.setattr(command_output, "time", SimpleNamespace(monotonic=lambda: now[0]))

    def write_page():
        written.append(now[0])
        now[0] += 0.5

    options = argparse.Namespace(json=None, csv=None, pictures="p", quiet=True, stops=Stops())
    results = command_output.Results(options, str, 100, write_page)
    results.keep()
    assert written == []
    results.records.append({})
    for _ in range(300):
        results.keep()
        now[0] += 0.1
    # Half a second each: twice at once, then a twentieth of the time.
    assert written == pytest.approx([100.0, 100.6, 120.0, 130.0], abs=0.11)
