"""With Numba's own switch, kernels run as plain Python, as they do where there is no Numba."""

import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("numba")


def test_the_same_hits(tmp_path):
    said = {}
    for name, value in (("on", "0"), ("off", "1")):
        command = [
            sys.executable, "-m", "accelscope", "evaluate", "sample:tetra:depth=2", "--rays",
            "random_lines:count=30", "--structure", "kdtree", "--hits", f"{name}.npz",
        ]  # fmt: skip
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True,
            env=os.environ | {"NUMBA_DISABLE_JIT": value},
        )  # fmt: skip
        said[name] = done.stderr
    assert said["off"] == "accelscope: no Numba here: kernels run as slow plain Python\n"
    with np.load(tmp_path / "on.npz") as on, np.load(tmp_path / "off.npz") as off:
        assert (on["primitive"] >= 0).any()
        for name in on:
            assert np.array_equal(on[name], off[name]), name
