"""A KeyboardInterrupt that others catch or turn into another error stops the run all the same.

Exit codes stay those of the README, also where CPython would end by a signal afterwards.
"""

import os
import signal
import subprocess
import sys
import threading

import pytest
from accelscope.core.evaluation.records import experiment

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")

TWO = ("evaluate", "sample:tetra:size=1", "--structure", "bvh", "naive",
       "--rays", "random_lines:count=20")  # fmt: skip


@pytest.fixture
def lose_stop(monkeypatch):
    """Let a stop come, and be lost, while a structure is built."""

    def at(name, error=None):
        build = experiment.build

        def losing(scene, structure_type, *arguments, **options):
            if structure_type.name == name:
                try:
                    os.kill(os.getpid(), signal.SIGINT)
                except KeyboardInterrupt:
                    if error:
                        raise error from None
            return build(scene, structure_type, *arguments, **options)

        monkeypatch.setattr(experiment, "build", losing)

    return at


@pytest.mark.parametrize("error", [None, ImportError("of another module")])
@pytest.mark.parametrize("quiet", [(), ("--quiet",)])
def test_in_a_batch(run, lose_stop, tmp_path, error, quiet):
    lose_stop("naive", error)
    outcome = run(*TWO, "--csv", tmp_path / "a.csv", *quiet)
    assert outcome.code == 1
    lines = [line for line in outcome.err.splitlines() if ": compiling " not in line]
    assert lines == ["accelscope: error: stopped; 1 of 2 records were measured"]
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 2


@pytest.mark.parametrize("error", [None, ImportError("of another module")])
def test_before_anything_was_measured(run, lose_stop, error):
    lose_stop("bvh", error)
    outcome = run(*TWO, "--quiet")
    assert (outcome.code, outcome.out, outcome.err) == (2, "", "accelscope: error: stopped\n")


def test_among_locks(run, monkeypatch, tmp_path):
    """An exception there leaves locks behind that nobody has locked, or that nobody can unlock."""
    build, passed = experiment.build, []

    def stopped_among_locks(scene, structure_type, *arguments, **options):
        lock = threading.Condition()

        def condition():
            os.kill(os.getpid(), signal.SIGINT)
            passed.append(structure_type.name)
            return True

        if structure_type.name == "naive":
            with lock:
                lock.wait_for(condition)
            passed.append("unlocked")
        return build(scene, structure_type, *arguments, **options)

    monkeypatch.setattr(experiment, "build", stopped_among_locks)
    outcome = run(*TWO, "--csv", tmp_path / "a.csv", "--quiet")
    assert passed == ["naive", "unlocked"]
    assert (outcome.code, outcome.err) == (
        1, "accelscope: error: stopped; 1 of 2 records were measured\n",
    )  # fmt: skip


TEXT = """
import sys, time
exec("sys.stderr.write('importing\\\\n'); sys.stderr.flush(); time.sleep(60.0)")
"""


def test_in_code_that_was_a_text(tmp_path):
    """CPython would kill itself by SIGINT at its end, though the exception was caught."""
    (tmp_path / "numpy.py").write_text(TEXT)
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        [sys.executable, "-m", "accelscope", "list"], text=True,
        env=os.environ | {"PYTHONPATH": path}, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert process.stderr.readline() == "importing\n"
    os.kill(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (2, "", "accelscope: error: stopped\n")
