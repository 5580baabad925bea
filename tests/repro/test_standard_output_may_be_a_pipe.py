"""What ``/dev/stdout`` leads to may have no name: a result is written to it all the same."""

import csv
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from accelscope.core.writing import refuse_unwritable, write_bytes

DESCRIPTORS = Path("/proc/self/fd")

pytestmark = pytest.mark.skipif(not DESCRIPTORS.exists(), reason="no names for what is open")


def test_a_pipe():
    reader, writer = os.pipe()
    for path in (f"/dev/fd/{writer}", f"/proc/self/fd/{writer}"):
        refuse_unwritable(path)
        write_bytes(path, b"through")
        assert os.read(reader, 100) == b"through"
    os.close(reader)
    os.close(writer)


def test_a_link_to_a_pipe(tmp_path):
    reader, writer = os.pipe()
    link = tmp_path / "link"
    link.symlink_to(f"/dev/fd/{writer}")
    write_bytes(link, b"through")
    assert os.read(reader, 100) == b"through"
    assert link.is_symlink()
    os.close(reader)
    os.close(writer)


def test_a_file_that_is_open_and_deleted(tmp_path):
    with (tmp_path / "gone").open("w+b") as file:
        (tmp_path / "gone").unlink()
        write_bytes(f"/proc/self/fd/{file.fileno()}", b"kept")
        assert file.read() == b"kept"
    assert list(tmp_path.iterdir()) == []


def test_an_open_file_with_a_name_is_replaced_whole(tmp_path):
    path = tmp_path / "named"
    with path.open("w+b") as file:
        write_bytes(f"/proc/self/fd/{file.fileno()}", b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


SMALL = ["evaluate", "sample:tetra:size=1", "--structure", "naive", "--rays",
         "random_lines:count=5"]  # fmt: skip


def read_as(option, data):
    """Return how many rays a result of the command line is of."""
    if option == "--json":
        return json.loads(data)["records"][0]["rays"]["count"]
    if option == "--csv":
        (row,) = csv.DictReader(io.StringIO(data.decode()))
        return int(row["rays.count"])
    with np.load(io.BytesIO(data)) as arrays:
        return len(arrays["t"])


@pytest.mark.parametrize(
    "option",
    [
        "--csv",
        *(pytest.param(option, marks=pytest.mark.exhaustive) for option in ("--json", "--hits")),
    ],
)
def test_of_the_command_line(option):
    command = [sys.executable, "-m", "accelscope", *SMALL, option, "/dev/stdout", "--quiet"]
    done = subprocess.run(command, capture_output=True, check=True)
    assert done.stderr == b""
    assert read_as(option, done.stdout) == 5


def test_json_there_is_json_alone(tmp_path):
    """Neither a table nor progress stands between, in a file either."""
    with (tmp_path / "out").open("wb") as file:
        command = [sys.executable, "-m", "accelscope", *SMALL, "--json", "/dev/stdout"]
        subprocess.run(command, stdout=file, stderr=subprocess.PIPE, check=True)
    assert read_as("--json", (tmp_path / "out").read_bytes()) == 5
