"""Python complains of files that are left open, where it is asked to; it finds none."""

import subprocess
import sys


def test_with_every_warning_an_error():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "accelscope", "list", "--json"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("}\n")
