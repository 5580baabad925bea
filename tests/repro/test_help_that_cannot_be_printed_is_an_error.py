"""A full disk, or a reader that has gone, is for help what it is for every other result."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="devices of other systems")


def run(standard_output, *words):
    return subprocess.run(
        [sys.executable, "-m", "accelscope", *words, "-h"],
        stdout=standard_output, stderr=subprocess.PIPE, text=True, timeout=60, check=False,
    )  # fmt: skip


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
@pytest.mark.parametrize("words", [[], ["evaluate"]])
def test_on_a_full_disk(words):
    with open("/dev/full", "w") as full:
        done = run(full, *words)
    assert done.returncode == 2
    assert done.stderr == "accelscope: error: cannot print: [Errno 28] No space left on device\n"


def test_for_a_reader_that_has_gone():
    read, write = os.pipe()
    os.close(read)
    done = run(write)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")
