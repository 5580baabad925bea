"""``accelscope ... >&-`` and ``2>&-``: what is printed goes nowhere, and all else is as ever."""

import json
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a shell of other systems")

SMALL = ["evaluate", "sample:tetra:size=1", "--structure", "naive", "--rays",
         "random_lines:count=5"]  # fmt: skip


def run(closing, *words):
    return subprocess.run(
        ["sh", "-c", f'exec "$0" -m accelscope "$@" {closing}', sys.executable, *words],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("closing", [">&-", "2>&-", ">&- 2>&-"])
def test_files_are_written(tmp_path, closing):
    path = tmp_path / "a.json"
    done = run(closing, *SMALL, "--json", str(path), "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert json.loads(path.read_text())["records"][0]["rays"]["count"] == 5


def test_refusals_have_their_exit_code():
    done = run("2>&-", "evaluate", "/nowhere.obj")
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")
