"""Kernels compiled before the first call, and small files to call the command line with."""

import numpy as np
import pytest
from accelscope.core.evaluation.experiment import warm_up
from accelscope.core.structures import structures


@pytest.fixture(scope="session", autouse=True)
def compiled():
    """Compile all kernels first: the command announces that once, on stderr."""
    for structure in structures().values():
        warm_up(structure, structure.Settings())


TRIANGLES = np.array(
    [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[0, 0, 1], [1, 0, 1], [0, 1, 1]],
        [[2, 0, 0], [3, 0, 0], [2, 1, 0]],
        [[0, 2, 3], [1, 2, 3], [0, 3, 3]],
        [[5, 5, 5], [6, 5, 5], [5, 6, 6]],
    ],
    dtype=float,
)


def write_obj(path, triangles):
    lines = []
    for n, triangle in enumerate(np.asarray(triangles, float)):
        lines += ["v " + " ".join(map(repr, map(float, corner))) for corner in triangle]
        lines.append(f"f {3 * n + 1} {3 * n + 2} {3 * n + 3}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def obj(tmp_path):
    """Write triangles as an OBJ file and return its path."""

    def make(triangles=TRIANGLES, name="mesh.obj"):
        return write_obj(tmp_path / name, triangles)

    return make


@pytest.fixture
def five():
    """Five triangles apart from each other."""
    return TRIANGLES.copy()
