"""Results are written beside the old file and renamed: a write that fails leaves the old one."""

import os
import stat
import sys

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.pages.png import write_png
from accelscope.core.evaluation.records.report import write_csv, write_json, write_text
from accelscope.core.writing import refuse_unwritable, replacing, write_bytes

WRITERS = {
    "json": lambda path: write_json(path, [{"a": 1}]),
    "csv": lambda path: write_csv(path, [{"a": 1}]),
    "html": lambda path: write_text(path, "page"),
    "png": lambda path: write_png(path, np.zeros((2, 2, 3))),
    "bytes": lambda path: write_bytes(path, b"bytes"),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_the_old_file_stays_whole_until_the_new_one_is(tmp_path, monkeypatch, kind):
    path = tmp_path / f"old.{kind}"
    path.write_bytes(b"old")
    replace = os.replace

    def no_space(*arguments, **options):
        assert path.read_bytes() == b"old"
        raise OSError(28, "no space left")

    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(InputError, match=f"cannot write {path}: no space left"):
        WRITERS[kind](path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    monkeypatch.setattr(os, "replace", replace)
    WRITERS[kind](path)
    assert path.read_bytes() != b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_whatever_ends_the_writing(tmp_path, error):
    path = tmp_path / "old"
    path.write_text("old")

    def stopped():
        with replacing(path) as file:
            file.write(b"half")
            raise error

    with pytest.raises(error):
        stopped()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="links and modes of other systems")
def test_links_and_modes_stay(tmp_path):
    real, link = tmp_path / "real", tmp_path / "link"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    write_bytes(link, b"new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    dangling = tmp_path / "dangling"
    dangling.symlink_to(tmp_path / "later")
    write_bytes(dangling, b"new")
    assert (tmp_path / "later").read_text() == "new"


def test_a_new_file_has_the_usual_mode(tmp_path):
    (tmp_path / "usual").touch()
    write_bytes(tmp_path / "new", b"")
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_name_as_long_as_names_may_be(tmp_path):
    path = tmp_path / ("n" * 255)
    refuse_unwritable(path)
    write_bytes(path, b"new")
    assert path.read_bytes() == b"new"
    with pytest.raises(InputError, match="cannot write"):
        refuse_unwritable(tmp_path / ("n" * 256))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names")
def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    refuse_unwritable(path)
    write_bytes(path, b"through")
    assert os.read(reader, 100) == b"through"
    os.close(reader)
    assert stat.S_ISFIFO(path.stat().st_mode)


def test_asking_leaves_nothing_behind(tmp_path):
    old = tmp_path / "old"
    old.write_text("old")
    for path in (old, tmp_path / "new"):
        refuse_unwritable(path)
    assert old.read_text() == "old"
    assert list(tmp_path.iterdir()) == [old]
    for path in (tmp_path, old / "below"):
        with pytest.raises(InputError, match="cannot write"):
            refuse_unwritable(path)
