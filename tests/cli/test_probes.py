"""``accelscope probes``: pictures, coverage, visible polygons, records, and what is refused."""

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest

SMALL = "beam:width=40,height=30"


def test_picture_coverage_outlines_and_record_are_written(run, tmp_path):
    image, covered, svg, record = (
        tmp_path / name for name in ("a.png", "covered.png", "a.svg", "a.json")
    )
    outcome = run(
        "probes", "sample:room", "--probe", SMALL, "--image", image, "--coverage", covered,
        "--svg", svg, "--json", record,
    )  # fmt: skip
    assert outcome.code == 0
    assert "beam through bsp" in outcome.out
    assert np.load(image.with_suffix(".npy")).shape == (30, 40, 3)
    shares = np.load(covered.with_suffix(".npy"))
    assert shares.shape == (30, 40)
    (made,) = json.loads(record.read_text())["records"]
    cast = made["cast"]
    assert shares.mean() == pytest.approx(1.0 - cast["missed"])
    assert sum(cast["by_object"].values()) == pytest.approx(1.0 - cast["missed"])
    assert set(cast["by_object"]) <= {"white", "red", "green", "lamp", "mirror"}
    assert cast["area_error"] < 1e-9
    assert cast["beams"] == sum(cast["by_kind"].values()) == 2
    assert made["probe"]["settings"]["width"] == 40
    assert made["structure"]["settings"]["planes"] == "autopartition"
    # The polygons of the drawing are the pieces, and cover the picture.
    root = ElementTree.fromstring(svg.read_text())
    groups = root.findall("{*}g")
    assert [group.get("class") for group in groups] == ["eye", "mirrored"]
    drawn = [polygon.get("points") for polygon in groups[0].findall("{*}polygon")]
    assert len(drawn) == cast["pieces_of_the_first"]
    area = 0.0
    for text in drawn:
        x, y = np.array([[float(n) for n in p.split(",")] for p in text.split()]).T
        area += 0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    assert area == pytest.approx(40 * 30, rel=1e-4)
    titles = {title.text for title in root.iter("{http://www.w3.org/2000/svg}title")}
    assert all(re.fullmatch(r"nothing|\w+ \d+", title) for title in titles)


def test_a_scene_of_triangles_goes_through_a_tree_of_ones_own(run, tmp_path):
    outcome = run(
        "probes", "sample:tetra:size=3", "--probe", SMALL, "--structure", "bsp:max_leaf_size=4",
        "--json", "-",
    )  # fmt: skip
    assert outcome.code == 0
    (made,) = json.loads(outcome.out)["records"]
    assert made["structure"]["settings"]["planes"] == "sah"
    assert made["cast"]["polygons"] == 64
    assert 0.0 < made["cast"]["missed"] < 1.0


@pytest.mark.parametrize(("probe", "structure"), [("cone", "kdtree"), ("pyramid", "bvh")])
def test_cones_and_pyramids_cover_what_the_beam_sees(run, tmp_path, probe, structure):
    """Of all pixels together; a cone is round, so of single pixels at edges not the same."""
    covered, records = tmp_path / "covered.png", {}
    for text, through in (
        (f"{probe}:width=24,height=18", structure),
        ("beam:width=24,height=18", "bsp"),
    ):
        outcome = run(
            "probes", "sample:tetra:size=2", "--probe", text, "--structure", through,
            "--coverage", covered, "--json", "-",
        )  # fmt: skip
        assert outcome.code == 0
        (record,) = json.loads(outcome.out)["records"]
        records[text.partition(":")[0]] = record["cast"], np.load(covered.with_suffix(".npy"))
    (own, shares), (beam, exact) = records[probe], records["beam"]
    assert own["probes"] == 24 * 18
    assert own["covered"] == pytest.approx(shares.mean(), abs=1e-12)
    assert own["covered"] == pytest.approx(1.0 - beam["missed"], abs=0.004)
    inner = (exact < 1e-9) | (exact > 1.0 - 1e-9)
    differ = np.abs(shares - exact)
    assert differ[~inner].max() < (0.25 if probe == "cone" else 0.05)
    # A cone of the pixel's area reaches a little beyond its sides.
    assert differ[inner].max() < (0.12 if probe == "cone" else 0.02)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sample:room", "--probe", "ray"], "there is no probe 'ray'; known are: cone, pyramid"),
        (["sample:tetra", "--probe", "cone", "--structure", "bsp"], "cones do not go through bsp"),
        (["sample:tetra", "--probe", "cone", "--svg", "x.svg"], "cone knows no outlines"),
        (["sample:tetra", "--probe", "pyramid:side=0"], "side"),
        (["sample:room", "--probe", "beam:depth=0"], "depth"),
        (["sample:room", "--structure", "grid"], "beams need the order of a BSP tree"),
        (["sample:balls:size=1"], "beams meet flat polygons only"),
        (["sample:room", "--svg", "x.png"], "--svg writes SVG"),
        (["sample:room", "--image", "x.jpg"], "--image writes PNG"),
        (["sample:room", "--probe", "beam:from=1x1x1,at=1x1x1"], "are the same point"),
        (["sample:room", "sample:facade"], "takes one SCENE, not 2"),
        (["sample:room", "--structure", "all"], "takes one structure"),
    ],
)
def test_what_cannot_be_is_refused(run, arguments, words):
    outcome = run("probes", *arguments, "--quiet")
    assert outcome.code == 2
    assert words in outcome.err
    assert len(outcome.err.splitlines()) == 1


def test_round_cones_see_spheres_as_such(run, tmp_path):
    """What is covered is what rays hit: a mean over pixels, each within the error of 64 rays."""
    record, covered = tmp_path / "a.json", tmp_path / "covered.png"
    outcome = run(
        "probes", "sample:lattice:size=1", "--probe", "cone:width=24,height=18", "--json", record,
        "--coverage", covered,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    (made,) = json.loads(record.read_text())["records"]
    assert made["cast"]["spheres"] == 8
    assert made["cast"]["triangles"] == 12 * 32
    assert any("its 12 items are seen as 384 triangles" in n for n in made["scene"]["notes"])
    shares = np.load(covered.with_suffix(".npy"))
    hits = tmp_path / "hits.npz"
    outcome = run(
        "evaluate", "sample:lattice:size=1", "--structure", "naive", "--rays",
        "camera:width=192,height=144", "--hits", hits,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    found = np.load(hits)["t"].reshape(18, 8, 24, 8)
    by_rays = np.isfinite(found).mean(axis=(1, 3))
    # A cone is a circle, a pixel a square; a cylinder is drawn with sixteen sides.
    assert abs(by_rays.mean() - shares.mean()) < 0.02
    assert np.abs(by_rays - shares).mean() < 0.05
    inside = (by_rays == 1.0) & (shares > 0.9)
    assert inside.sum() > 20
