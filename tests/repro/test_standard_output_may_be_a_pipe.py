"""What ``/dev/stdout`` leads to may have no name: a result is written to it all the same."""

import os
from pathlib import Path

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
