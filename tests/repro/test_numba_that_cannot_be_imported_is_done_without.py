"""Numba refuses to be imported beside a NumPy it does not know, or with a variable it dislikes."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("numba")


def evaluate(folder, name, environment):
    return subprocess.run(
        [sys.executable, "-m", "accelscope", "evaluate", "sample:tetra:depth=1", "--rays",
         "random_lines:count=20", "--structure", "bvh", "--hits", f"{name}.npz"],
        cwd=folder, capture_output=True, text=True, timeout=120, check=True,
        env=os.environ | environment,
    )  # fmt: skip


def test_a_variable(tmp_path):
    evaluate(tmp_path, "well", {})
    done = evaluate(tmp_path, "ill", {"NUMBA_NUM_THREADS": "0"})
    assert done.stderr == (
        "accelscope: Numba cannot be imported (ValueError: Number of threads specified must be "
        "> 0.): kernels run as slow plain Python\n"
    )
    assert (tmp_path / "ill.npz").read_bytes() == (tmp_path / "well.npz").read_bytes()


def test_a_numba_of_another_numpy(tmp_path):
    """As one does that is too old for the NumPy it finds."""
    (tmp_path / "numba").mkdir()
    (tmp_path / "numba" / "__init__.py").write_text("raise ImportError('Numba needs\\nNumPy 1.0')")
    done = evaluate(tmp_path, "ill", {})
    assert done.stderr == (
        "accelscope: Numba cannot be imported (ImportError: Numba needs NumPy 1.0): "
        "kernels run as slow plain Python\n"
    )
