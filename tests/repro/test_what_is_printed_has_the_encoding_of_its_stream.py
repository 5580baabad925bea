"""Standard output and standard error are written in their own encoding, whatever that is."""

import os
import subprocess
import sys

import pytest

NAME = "Fläche ✓.obj"


@pytest.fixture
def mesh(tmp_path, obj):
    return obj(name=NAME)


def run(mesh, encoding, *words):
    return subprocess.run(
        [sys.executable, "-m", "accelscope", "evaluate", mesh, "--rays", "camera:width=2,height=2",
         *words],
        capture_output=True, check=False, timeout=120,
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "shown"),
    [
        ("utf-8", "Fläche ✓".encode()),
        ("latin-1", rb"Fl\xe4che \u2713".replace(rb"\xe4", "ä".encode("latin-1"))),
        ("ascii", rb"Fl\xe4che \u2713"),
    ],
)
def test_a_name(mesh, encoding, shown):
    done = run(mesh, encoding)
    assert done.returncode == 0, done.stderr
    assert shown in done.stdout
    refused = run(f"{mesh}.gone", encoding, "--quiet")
    assert refused.returncode == 2
    assert shown in refused.stderr
