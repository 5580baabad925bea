"""Where there is no room for compiled kernels a run goes on without, and says so once."""

import os
import shutil
import subprocess
import sys

import pytest

resource = pytest.importorskip("resource", reason="limits as other systems have them")

RUN = """
import sys
from pathlib import Path
from accelscope.core import kernel_cache, kernels
kernel_cache.set_cache_root(Path(sys.argv[1]) / "kernels")
sys.path.insert(0, sys.argv[1])
import numpy as np
import toy
from accelscope.core.progress import Progress

class Listening(Progress):
    def announce(self, text):
        print(text)

for values in (np.arange(4.0), np.arange(4)):
    with kernels.announcing(Listening(), "toy"):
        print(kernels.call(toy.sum_of_squares, values))
"""


def run(folder, bytes_a_file):
    """Run the toy where no file can be longer; return the lines that it prints."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_a_file, bytes_a_file))

    done = subprocess.run(
        [sys.executable, "-B", "-c", RUN, str(folder)], preexec_fn=limit, text=True,
        capture_output=True, timeout=120, check=True,
        # Numba's own place in the user's folder is no way out.
        env=os.environ | {"XDG_CACHE_HOME": "/dev/null"},
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.mark.parametrize("room", [0, 20, 2000])
def test_no_room(toy_kernels, tmp_path, room):
    """Not for an index, for the half of one, and for indices but not for a kernel."""
    (tmp_path / "toy.py").write_text(toy_kernels)
    for _ in range(2):
        assert run(tmp_path, room) == [
            "compiling toy, once after installation, some ten seconds",
            "14.0",
            "what is compiled cannot be kept for the next start: File too large",
            "compiling toy, at every start, for there is no place to keep what is compiled",
            "14.0",
        ]
    # As soon as there is room again, all is as ever.
    first = run(tmp_path, 1 << 24)
    assert "compiling toy, once after installation, some ten seconds" in first
    assert run(tmp_path, 1 << 24) == ["14.0", "14.0"]
    assert not list(tmp_path.rglob("*.tmp.*"))


def test_no_folder_can_be_made(toy_kernels, tmp_path):
    """A full disk may refuse even that: files stand wherever Numba looks for a place."""
    (tmp_path / "toy.py").write_text(toy_kernels)
    run(tmp_path, 1 << 24)
    (kernels,) = (tmp_path / "kernels").iterdir()
    for folder in (*kernels.iterdir(), tmp_path / "__pycache__"):
        if folder.is_dir():
            shutil.rmtree(folder)
        folder.write_text("in the way")
    assert run(tmp_path, 1 << 24)[:2] == [
        "compiling toy, at every start, for there is no place to keep what is compiled", "14.0",
    ]  # fmt: skip
