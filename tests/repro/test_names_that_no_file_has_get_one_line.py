"""Names that are too long, begin with ~, or lead in circles: one line, and never a traceback."""

import json
import os
import subprocess
import sys

import pytest

LONG = "n" * 300
SMALL = ("--structure", "naive", "--rays", "random_lines:count=5")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([f"{LONG}.obj"], "cannot be read: File name too long"),
        ([f"{LONG}.blend"], "cannot be read: File name too long"),
        ([f"/{LONG}/a.glb"], "cannot be read: File name too long"),
        (["sample:tetra", "--structure", f"bhv:{LONG[:200]}=1"], "bhv"),
        (["sample:tetra", "--structure", f"bvh{LONG}"], "bvh"),
        (["sample:tetra", "--rays", f"file:path={LONG}"], "cannot be read: File name too long"),
        (["sample:tetra", "--rays", "file:path=~nobody-of-this-name/a.npz"], "there is no file ~"),
        (["~nobody-of-this-name.obj"], "there is no file ~nobody"),
        (["~nobody-of-this-name.blend"], "there is no file ~nobody"),
        (["a\0b.obj"], "there is no file"),
        (["sample:tetra", "--json", f"{LONG}.json"], "File name too long"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="says it in other words")
def test_one_line(run, words, said):
    outcome = run("evaluate", *words)
    assert outcome.code == 2
    (line,) = outcome.err.splitlines()
    assert said in line


def test_a_tilde_is_a_letter(run, obj, tmp_path, monkeypatch):
    """The shell knows homes; what it leaves is the name of a file."""
    monkeypatch.chdir(tmp_path)
    obj(name="~nobody-of-this-name.obj")
    outcome = run("evaluate", "~nobody-of-this-name.obj", *SMALL, "--json", "~out.json",
                  "--csv", "~/a.csv", "--quiet")  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    (record,) = json.loads((tmp_path / "~out.json").read_text())["records"]
    assert record["scene"]["name"] == "~nobody-of-this-name"
    assert (tmp_path / "~" / "a.csv").exists()
    outcome = run("evaluate", "~nobody-of-this-name.obj", "--json", "~nobody-of-this-name.obj")
    assert "would overwrite" in outcome.err


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="there are no links")
def test_a_link_in_circles(run, tmp_path):
    circle = tmp_path / "circle.obj"
    circle.symlink_to(circle)
    outcome = run("evaluate", circle, *SMALL)
    assert outcome.code == 2
    assert "cannot be read: Too many levels of symbolic links" in outcome.err
    outcome = run("evaluate", "sample:tetra:size=1", *SMALL, "--json", circle, "--quiet")
    assert (outcome.code, outcome.err) == (0, "")
    assert len(json.loads(circle.read_text())["records"]) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot go there")
def test_a_folder_that_is_gone(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    line = f"rmdir '{gone}' && exec '{sys.executable}' -P -m accelscope evaluate sample:tetra "
    line += "--json a.json"
    done = subprocess.run(
        ["sh", "-c", line], cwd=gone, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "accelscope: error: cannot write a.json: No such file or directory; choose another place"
    ]


def test_the_open_file_is_no_place_for_results(tmp_path, capsys):
    from accelscope.addon.command.main import main
    from accelscope.sample_scenes import make_sample

    path = tmp_path / "open.blend"
    path.write_bytes(b"a day's work")
    code = main(
        ["evaluate", *SMALL, "--json", str(path)], lambda: make_sample("tetra"),
        open_path=str(path),
    )  # fmt: skip
    assert code == 2
    assert "would overwrite" in capsys.readouterr().err
    assert path.read_bytes() == b"a day's work"
