"""Refit: the tree stays, hits are those of brute force, and cost is compared over frames."""

import dataclasses
import re

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.pages.animation_page import write_page
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.evaluation.records.animation import animate, growth, table
from accelscope.core.geometry.kinds import KINDS
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH

LINES = RandomLinesSettings(count=300)


def twisted(scene, angle):
    """The scene turned about z, the more so the higher."""
    size = scene.upper - scene.lower
    p = scene.triangles - 0.5 * (scene.lower + scene.upper)
    turn = angle * p[..., 2] / max(size[2], 1e-300)
    x = np.cos(turn) * p[..., 0] - np.sin(turn) * p[..., 1]
    y = np.sin(turn) * p[..., 0] + np.cos(turn) * p[..., 1]
    return Scene.from_triangles(np.stack([x, y, p[..., 2]], axis=-1), scene.name)


@pytest.mark.parametrize(("volume", "arity"), [*((volume, "2") for volume in KINDS), ("aabb", "8")])
@pytest.mark.parametrize("name", ["bunny", "mess", "one"])
def test_hits_after_a_deformation(lab, build, name, volume, arity):
    before = lab.small_scene(name)
    after = twisted(before, 3.0)
    structure = build("bvh", before, f"volume={volume},arity={arity}")
    moved = structure.refitted(after)
    assert moved.validate() == []
    assert np.array_equal(moved.arrays.first, structure.arrays.first)
    assert np.array_equal(moved.triangles.ids, structure.triangles.ids)
    rays = RandomLinesWorkload.make(after, LINES)
    want, _ = build("naive", after).trace(rays)
    got, _ = moved.trace(rays)
    assert np.array_equal(got.primitive, want.primitive)
    assert np.array_equal(got.t, want.t)
    # The old one is as it was.
    assert structure.scene is before
    assert structure.validate() == []


def test_a_refit_without_a_deformation_changes_nothing(lab, build, scene_name):
    structure = build("bvh", lab.small_scene(scene_name))
    moved = structure.refitted(structure.scene)
    assert np.array_equal(moved.arrays.volumes.rows, structure.arrays.volumes.rows)
    assert moved.statistics().sah == structure.statistics().sah


def test_other_triangles_are_refused(lab, build):
    scene = lab.small_scene("tetra")
    structure = build("bvh", scene)
    fewer = Scene.from_triangles(scene.triangles[:-1], "fewer")
    with pytest.raises(InputError, match="built over 256 triangles, now there are 255"):
        structure.refitted(fewer)
    broken = scene.triangles.copy()
    broken[3] = np.nan
    same_number = Scene.from_triangles(np.concatenate([broken, broken[:1]]), "another left out")
    assert len(same_number) == len(scene)
    with pytest.raises(InputError, match="others were left out"):
        structure.refitted(same_number)


def test_pieces_are_refused(lab, build):
    structure = build("bvh", lab.small_scene("one"))
    structure.parts = np.zeros((len(structure.triangles.ids), 6))
    with pytest.raises(InputError, match="cuts triangles into pieces"):
        structure.refitted(structure.scene)


def test_records_of_an_animation(lab, tmp_path):
    scene = lab.small_scene("bunny")
    frames = [(number, twisted(scene, 0.6 * (number - 3))) for number in (3, 4, 8)]
    found = animate(frames, BVH, BVH.Settings(), RandomLinesWorkload, LINES)
    assert [(r["frame"], r["method"]) for r in found.records] == [
        (number, method) for number in (3, 4, 8) for method in ("refit", "rebuild")
    ]
    costs = np.array([r["statistics"]["sah"] for r in found.records]).reshape(-1, 2)
    assert costs[0, 0] == costs[0, 1]
    assert costs[2, 0] > costs[1, 0] > costs[0, 0]
    assert costs[2, 0] > 1.2 * costs[2, 1]
    for first, second in zip(found.records[::2], found.records[1::2], strict=True):
        assert first["trace"]["hits"] == second["trace"]["hits"]
    assert [m.frame for m in found.history] == [3, 4, 8]
    assert growth(*found.records[-2:]) == pytest.approx(costs[2, 0] / costs[2, 1])
    lines = table(found.records).splitlines()
    assert len(lines) == 2 + 3
    assert len({len(line) for line in lines}) == 1
    write_page(tmp_path, found)
    chart = (tmp_path / "cost.svg").read_text()
    assert chart.count("<polyline") == 2
    assert chart.count("<circle") == 6
    page = (tmp_path / "index.html").read_text()
    for file in re.findall('src="([^"]*)"', page):
        assert (tmp_path / file).stat().st_size > 0


def test_a_frame_with_other_triangles_is_named(lab):
    scene = lab.small_scene("tetra")
    fewer = Scene.from_triangles(scene.triangles[1:], "fewer")
    with pytest.raises(InputError, match="frame 7: the tree was built over 256 triangles"):
        animate([(6, scene), (7, fewer)], BVH, BVH.Settings(), RandomLinesWorkload, LINES)
    with pytest.raises(InputError, match="no frame"):
        animate([], BVH, BVH.Settings(), RandomLinesWorkload, LINES)


def test_the_settings_stay(lab):
    scene = lab.small_scene("tetra")
    settings = dataclasses.replace(BVH.Settings(), max_leaf_size=1, C_trav=3.0)
    found = animate([(1, scene)], BVH, settings, RandomLinesWorkload, LINES)
    assert {r["statistics"]["mean_leaf_size"] for r in found.records} == {1.0}
    assert {r["structure"]["settings"]["C_trav"] for r in found.records} == {3.0}
