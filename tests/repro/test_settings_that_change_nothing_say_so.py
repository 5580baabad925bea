"""A setting without effect beside the others is named on the command line, with the reason."""

import pytest

RAYS = ("--rays", "random_lines:count=10")


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("kdtree:links=stored", "links changes nothing, it is only for walk neighbours"),
        ("octree:links=stored", "links changes nothing, it is only for walk neighbours"),
        ("kdtree:planes=cyclic,empty_bonus=0", "empty_bonus changes nothing, it is only for planes "
         "sah"),
        ("bsp:planes=autopartition,empty_bonus=0", "empty_bonus changes nothing, it is only for "
         "planes sah, fixed"),
        ("bsp:directions=13", "directions changes nothing, it is only for planes fixed"),
        ("bsp:planes=fixed,candidates=3", "candidates changes nothing, it is only for planes sah, "
         "autopartition"),
        ("octree:order=priority", "order changes nothing, it is only for budget given"),
        ("kdtree:order=depth_first", "order changes nothing, it is only for budget given"),
        ("bsp:order=depth_first", "order changes nothing, it is only for budget given"),
        ("grid:resolution=3x3x3,rule=regular", "rule changes nothing, it is only for resolution "
         "open"),
        ("macro_grid:resolution=3x3x3,density=9", "density changes nothing, it is only for "
         "resolution open"),
    ],
)  # fmt: skip
def test_it_says_so(run, spec, sentence):
    got = run("evaluate", "sample:tetra:size=2", "--structure", spec, *RAYS)
    assert got.code == 0
    name = spec.split(":")[0]
    assert f"structure {name}: {sentence}" in got.err


@pytest.mark.parametrize(
    "spec",
    [
        "kdtree:walk=neighbours,links=stored", "octree:walk=neighbours,links=stored",
        "kdtree:empty_bonus=0", "bsp:empty_bonus=0", "bsp:planes=fixed,directions=13",
        "bsp:candidates=3", "octree:order=priority,budget=100", "grid:rule=regular,density=9",
        "grid:resolution=0x3x3,rule=regular",
    ],
)  # fmt: skip
def test_it_does_not_where_there_is_an_effect(run, spec):
    got = run("evaluate", "sample:tetra:size=2", "--structure", spec, *RAYS)
    assert got.code == 0
    assert "changes nothing" not in got.err
