"""Paths with commas, colons, quotes and drive letters can be given on the command line."""

import numpy as np
import pytest
from accelscope.core.settings import parse_spec

# What is typed for each name: quotes where the name itself looks like another setting.
NAMES = {
    "a,b.npz": "a,b.npz", "a,b=c.npz": '"a,b=c.npz"', "C:x,y.npz": "C:x,y.npz",
    "it's.npz": "it's.npz", "'a', \"b\".npz": "'a', \"b\".npz", "a,,b.npz": "a,,b.npz",
    "a=b.npz": "a=b.npz", "two words, or more.npz": "two words, or more.npz", ",.npz": "',.npz'",
    "a,path=b.npz": "'a,path=b.npz'",
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_rays_of_a_file_of_any_name(run, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    np.savez(name, origins=np.zeros((7, 3)), directions=np.ones((7, 3)))
    spec = f"file:path={NAMES[name]}"
    outcome = run("evaluate", "sample:tetra:size=1", "--rays", spec, "--json", "-", "--quiet")
    assert (outcome.code, outcome.err) == (0, "")
    (record,) = outcome.records
    assert record["rays"]["count"] == 7
    assert record["rays"]["settings"]["path"] == name


@pytest.mark.parametrize(
    ("spec", "texts"),
    [
        ("file:path=a,b.npz", {"path": "a,b.npz"}),
        ('file:path="a,b=c.npz"', {"path": "a,b=c.npz"}),
        ("file:path='a,b=c.npz', other=2", {"path": "a,b=c.npz", "other": "2"}),
        (r"file:path=C:\rays\x.npz", {"path": r"C:\rays\x.npz"}),
        (r'file:path="C:\rays, y\x.npz"', {"path": r"C:\rays, y\x.npz"}),
        ("file:path=dir/x,y/z=1.npz", {"path": "dir/x,y/z=1.npz"}),
        ("file:path=it's,b.npz", {"path": "it's,b.npz"}),
        ("file:path=a.npz\n", {"path": "a.npz\n"}),
        ("file:path='a,\n',other=b\n\n", {"path": "a,\n", "other": "b\n\n"}),
        ("grid:resolution=1x2x3,,padding=0,", {"resolution": "1x2x3", "padding": "0"}),
    ],
)
def test_where_a_value_ends(spec, texts):
    assert parse_spec(spec) == (spec.partition(":")[0], texts)


def test_a_comma_in_a_number_is_shown_in_the_message(refused):
    line = refused("evaluate", "sample:tetra", "--structure", "bvh:bins=4,mailbox")
    assert "bins takes a whole number, not '4,mailbox'" in line


def test_scenes_of_any_name(evaluate, obj, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a,b.obj", "C:b.obj", "a:b=c,d.obj", "-1.obj", "bvh.obj", "sample:x.obj"):
        obj(name=name)
        argument = f"./{name}" if name.startswith(("-", "sample:")) else name
        (record,) = evaluate(argument)
        assert record["scene"]["triangles"] == 5


def test_a_file_called_like_a_sample_is_not_mistaken(refused, obj, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    obj(name="sample:tetra")
    assert "write ./sample:tetra for it" in refused("evaluate", "sample:tetra")
