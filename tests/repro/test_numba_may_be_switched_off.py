"""With Numba's own switch, kernels run as plain Python, as they do where there is no Numba."""

import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("numba")


SMALL = ("evaluate", "sample:tetra:size=2", "--rays", "random_lines:count=30", "--structure",
         "kdtree", "--hits")  # fmt: skip


def test_the_same_hits(run, tmp_path):
    assert run(*SMALL, tmp_path / "on.npz").code == 0
    done = subprocess.run(
        [sys.executable, "-m", "accelscope", *SMALL, "off.npz"],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    assert done.stderr == "accelscope: no Numba here: kernels run as slow plain Python\n"
    with np.load(tmp_path / "on.npz") as on, np.load(tmp_path / "off.npz") as off:
        assert (on["primitive"] >= 0).any()
        for name in on:
            assert np.array_equal(on[name], off[name]), name
