"""Havran's 1999 tables for the SPD scenes tetra and tree, which mirror nothing: figures per ray."""

import pytest

HAVRAN = "camera:width=513,height=513,pixel=corner,shadows=true"

PUBLISHED = {
    16: {"N_V": 4096, "N_EV": 3104, "N_OIV": 12556, "N_TS": 7.43, "N_ETS": 7.43, "N_EETS": 5.83,
         "N_IT": 20.64},
    35: {"N_V": 42875, "N_EV": 37311, "N_OIV": 35936, "N_TS": 15.97, "N_ETS": 15.97,
         "N_EETS": 14.36, "N_IT": 10.01},
}  # fmt: skip

OURS = (49949, 46260, 5557)
"""Primary hits, shadow rays and blocked ones; every structure and every machine finds these."""


@pytest.mark.parametrize("n", PUBLISHED)
def test_grid_over_tetra(evaluate, n):
    (record,) = evaluate(
        "sample:tetra",
        "--structure",
        f"grid:resolution={n}x{n}x{n},padding=0.001,assignment=box",
        "--rays",
        HAVRAN,
    )
    assert record["scene"]["triangles"] == 4096
    published = PUBLISHED[n]
    for name in ("N_V", "N_EV", "N_OIV"):
        assert record["statistics"][name] == published[name]
    assert "N_IN" not in record["statistics"]
    for name, share in (("N_TS", 0.015), ("N_ETS", 0.015), ("N_EETS", 0.015), ("N_IT", 0.05)):
        assert record["trace"][name] == pytest.approx(published[name], rel=share)
    assert record["trace"]["mailbox_hits"] == 0
    primary, shadow = record["trace"]["hits_by_class"].values()
    rays, shadow_rays = record["rays"]["classes"].values()
    assert rays == 513 * 513
    # Published: 49950 hits, 46262 shadow rays, 5538 of them blocked; ours to the last ray.
    assert (primary, shadow_rays, shadow) == OURS
    assert abs(primary - 49950) <= 2
    assert abs(shadow_rays - 46262) <= 5
    assert shadow == pytest.approx(5538, rel=0.01)


OF_TREE = {
    "grid:resolution=52x52x3": (7.60, 7.60, 4.50, 727.62),
    "grid:resolution=60x60x60": (56.36, 56.36, 45.36, 355.45),
    "octree:max_depth=7,walk=march": (219.3, 32.74, 23.33, None),
    "octree:max_depth=7,walk=neighbours": (130.1, 32.74, 23.34, None),
    "octree:max_depth=7,walk=recursive": (65.90, None, None, None),
}
"""N_TS, N_ETS, N_EETS and N_IT over spheres, cones and a polygon.

None where the text counts otherwise than we do: tests in octrees, and cells of the recursive walk.
"""


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", OF_TREE)
def test_steps_over_tree(evaluate, text):
    rules = "padding=0.001,assignment=box"
    if text.startswith("octree"):
        rules += ",max_leaf_size=1,duplication=0"
    (record,) = evaluate("sample:tree", "--structure", f"{text},{rules}", "--rays", HAVRAN)
    shares = 0.03 if "neighbours" in text else 0.01, 0.015, 0.015, 0.05
    for name, published, share in zip(
        ("N_TS", "N_ETS", "N_EETS", "N_IT"), OF_TREE[text], shares, strict=True
    ):
        if published is not None:
            assert record["trace"][name] == pytest.approx(published, rel=share), name
    # Published: 169907 hits and 1110323 shadow rays.
    assert abs(record["trace"]["hits_by_class"]["primary"] - 169907) <= 4
    assert record["rays"]["classes"]["shadow"] == pytest.approx(1110323, rel=0.015)


@pytest.mark.parametrize("text", ["bvh", "grid:resolution=35x35x35", "grid:mailbox=true"])
def test_all_structures_see_the_same_picture(evaluate, text):
    (record,) = evaluate("sample:tetra", "--structure", text, "--rays", HAVRAN)
    (other,) = evaluate("sample:tetra", "--structure", "bvh:max_leaf_size=1", "--rays", HAVRAN)
    assert record["trace"]["hits_by_class"] == other["trace"]["hits_by_class"]


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ("octree:max_depth=4,max_leaf_size=1,padding=0,assignment=box,mailbox=true", 13),
        ("grid:resolution=16x1x16,padding=0,mailbox=true", 17),
    ],
)
def test_the_lectures_picture_of_a_ray(evaluate, text, cells):
    (record,) = evaluate(
        "sample:nonuniform",
        "--structure",
        text,
        "--rays",
        "camera:width=1,height=1,from=-4.85x6.1x4.9,at=9.7x6.1x16",
    )
    assert sum(record["rays"]["classes"].values()) == 1
    assert (record["trace"]["N_ETS"], record["trace"]["N_IT"]) == (cells, 3)
