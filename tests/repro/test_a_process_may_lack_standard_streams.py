"""Started without standard input, output or errors, it writes its results all the same.

The next file that is opened gets the number of a stream that is missing, and in it what others
print.
"""

import json
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a shell of other systems")

SMALL = "evaluate sample:tetra:size=1 --structure naive --rays random_lines:count=5"

NOISY = """
import ctypes, os, sys
from accelscope.addon.command.main import main
from accelscope.core.evaluation.records import experiment
build = experiment.build
def noisy_build(*arguments, **options):
    for descriptor in (1, 2):
        try:
            os.write(descriptor, b"noise")
        except OSError:
            pass
    return build(*arguments, **options)
experiment.build = noisy_build
sys.exit(main(sys.argv[1:], until_exit=True))
"""


@pytest.mark.parametrize("closed", ["<&-", "2>&-", ">&-", "<&- >&- 2>&-"])
def test_what_is_closed(tmp_path, closed):
    (tmp_path / "noisy.py").write_text(NOISY)
    line = f"exec '{sys.executable}' noisy.py {SMALL} --json a.json --csv a.csv {closed}"
    done = subprocess.run(
        ["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    (record,) = json.loads((tmp_path / "a.json").read_text())["records"]
    assert record["rays"]["count"] == 5
    assert "noise" not in (tmp_path / "a.csv").read_text()


def test_results_on_standard_output_are_results_alone(tmp_path):
    (tmp_path / "noisy.py").write_text(NOISY)
    line = f"exec '{sys.executable}' noisy.py {SMALL} --json - <&- 2>&-"
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, check=True)
    assert json.loads(done.stdout)["records"][0]["rays"]["count"] == 5


def test_a_refusal_that_nobody_hears():
    line = f"exec '{sys.executable}' -m accelscope evaluate /nowhere.obj >&- 2>&-"
    assert subprocess.run(["sh", "-c", line], check=False).returncode == 2
