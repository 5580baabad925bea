"""The command line, called in this process, and small files to call it with."""

import json

import numpy as np
import pytest
from accelscope.addon.command import main
from accelscope.core.evaluation.experiment import warm_up
from accelscope.core.structures import structures


@pytest.fixture(scope="session", autouse=True)
def compiled():
    """Compile all kernels first: the command announces that once, on stderr."""
    for structure in structures().values():
        warm_up(structure, structure.Settings())


class Outcome:
    """What a call of the command line left behind."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    @property
    def records(self):
        return json.loads(self.out)["records"]


@pytest.fixture
def run(capsys):
    """Call the command line with arguments; exceptions pass through, as they are defects."""

    def call(*arguments):
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture
def evaluate(run):
    """Evaluate and return the records, which must succeed without a word on stderr."""

    def call(*arguments):
        outcome = run("evaluate", *arguments, "--json", "-", "--quiet")
        assert (outcome.code, outcome.err) == (0, "")
        return outcome.records

    return call


@pytest.fixture
def refused(run):
    """Assert that the command line refuses with one clear line, and return that line."""

    def call(*arguments):
        outcome = run(*arguments)
        assert outcome.code == 2
        assert outcome.out == ""
        assert outcome.err.endswith("\n")
        lines = outcome.err.splitlines()
        assert len(lines) == 1, outcome.err
        assert "error: " in lines[0]
        assert "Traceback" not in lines[0]
        assert len(lines[0]) < 500
        return lines[0]

    return call


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
