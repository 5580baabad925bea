"""Numba refuses to be imported beside a NumPy it does not know, or with a variable it dislikes."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("numba")


SMALL = ("evaluate", "sample:tetra:size=1", "--rays", "random_lines:count=20", "--structure",
         "bvh", "--hits")  # fmt: skip


def evaluate(folder, environment):
    return subprocess.run(
        [sys.executable, "-m", "accelscope", *SMALL, "ill.npz"],
        cwd=folder, capture_output=True, text=True, timeout=120, check=True,
        env=os.environ | environment,
    )  # fmt: skip


def test_a_variable(run, tmp_path):
    assert run(*SMALL, tmp_path / "well.npz").code == 0
    done = evaluate(tmp_path, {"NUMBA_NUM_THREADS": "0"})
    assert done.stderr == (
        "accelscope: Numba cannot be imported (ValueError: Number of threads specified must be "
        "> 0.): kernels run as slow plain Python\n"
    )
    assert (tmp_path / "ill.npz").read_bytes() == (tmp_path / "well.npz").read_bytes()


def test_a_numba_of_another_numpy(tmp_path):
    """As one does that is too old for the NumPy it finds."""
    (tmp_path / "numba").mkdir()
    (tmp_path / "numba" / "__init__.py").write_text("raise ImportError('Numba needs\\nNumPy 1.0')")
    done = evaluate(tmp_path, {})
    assert done.stderr == (
        "accelscope: Numba cannot be imported (ImportError: Numba needs NumPy 1.0): "
        "kernels run as slow plain Python\n"
    )
