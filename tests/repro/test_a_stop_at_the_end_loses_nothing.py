"""Ctrl-C once all is measured: what is being written is written, and the exit code is its own."""

import json
import os
import signal
import subprocess
import sys

import pytest
from accelscope.addon import stopping
from accelscope.core.evaluation.records import report
from accelscope.core.evaluation.records.experiment import SCHEMA

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")

SMALL = ("evaluate", "sample:tetra:size=1", "--rays", "camera:width=4,height=3", "--quiet")


@pytest.fixture
def stopped_while_writing(monkeypatch):
    """Let a signal come, so many times, whenever records become JSON."""
    to_text = report.to_json_text

    def times(number, count):
        def stopping(records):
            for _ in range(count):
                os.kill(os.getpid(), number)
            return to_text(records)

        monkeypatch.setattr(report, "to_json_text", stopping)

    return times


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("count", [1, 3])
def test_the_first_one_waits(run, stopped_while_writing, tmp_path, number, count):
    """So do those that come with it: as from timeout, which tells the group of a process, too."""
    # To standard output, which is written at the end alone.
    stopped_while_writing(number, count)
    outcome = run(*SMALL, "--json", "-", "--csv", tmp_path / "a.csv")
    assert (outcome.code, outcome.err) == (0, "")
    assert len(outcome.records) == 1
    assert (tmp_path / "a.csv").exists()


def test_the_second_one_does_not(run, stopped_while_writing, monkeypatch):
    monkeypatch.setattr(stopping, "SAME", 0.0)
    stopped_while_writing(signal.SIGINT, 2)
    outcome = run(*SMALL, "--json", "-")
    assert (outcome.code, outcome.out, outcome.err) == (2, "", "accelscope: error: stopped\n")


def test_a_command_that_is_over_has_its_own_exit_code():
    program = (
        "import atexit, os, signal, sys; from accelscope.__main__ import main; "
        "atexit.register(os.kill, os.getpid(), signal.SIGTERM); sys.exit(main())"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "list", "--json"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["schema"] == SCHEMA
