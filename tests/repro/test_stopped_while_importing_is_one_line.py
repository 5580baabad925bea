"""Ctrl-C or a request to terminate while modules are imported ends with one line."""

import os
import signal
import subprocess
import sys

import pytest

SLOW_NUMPY = """
import time
print("importing", flush=True)
time.sleep(60.0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("start", ["-m accelscope", "program"])
def test_while_importing(tmp_path, number, start):
    (tmp_path / "numpy.py").write_text(SLOW_NUMPY)
    program = (
        ["-m", "accelscope"]
        if start != "program"
        else ["-c", "import sys; from accelscope.__main__ import main; sys.exit(main())"]
    )
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        [sys.executable, *program, "list"], text=True, env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        # A shell lets what it starts in the background ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert process.stdout.readline() == "importing\n"
    os.kill(process.pid, number)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (2, "", "accelscope: error: stopped\n")
