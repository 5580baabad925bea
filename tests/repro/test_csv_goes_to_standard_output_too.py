"""``--csv -`` is CSV on standard output, and nothing else; it was left out without a word."""

import csv
import io
import subprocess
import sys

import pytest
from accelscope.addon.standard_streams import path_of
from accelscope.core.errors import InputError

SMALL = ["evaluate", "sample:tetra:size=1", "--structure", "naive", "--rays",
         "random_lines:count=5"]  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="what is open has no names there")
def test_csv_alone():
    command = [sys.executable, "-m", "accelscope", *SMALL, "--csv", "-"]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    (row,) = csv.DictReader(io.StringIO(done.stdout.decode()))
    assert row["rays.count"] == "5"


@pytest.mark.parametrize(
    "options", [["--json", "--csv"], ["--json", "--hits"], ["--csv", "--hits"]]
)
def test_two_at_once(refused, options):
    line = refused(*SMALL, *(word for option in options for word in (option, "-")))
    assert f"{options[0]} and {options[1]} cannot both be standard output" in line


def test_where_it_has_no_name(refused, tmp_path, monkeypatch):
    """As where a program that goes on has put something of its own in its place."""
    monkeypatch.chdir(tmp_path)
    assert "standard output has no name here; name a file" in refused(*SMALL, "--csv", "-")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="what is open has no names there")
def test_what_a_file_holds_already_is_not_lost(tmp_path):
    """``>> all.csv`` goes on behind it; the CSV would have taken its place."""
    path = tmp_path / "all.csv"
    for held in ("", "a,b\n1,2\n"):
        path.write_text(held)
        with path.open("a") as stream:
            if held:
                with pytest.raises(InputError, match="would be replaced; name another"):
                    path_of(stream)
            else:
                assert path_of(stream) == f"/dev/fd/{stream.fileno()}"
