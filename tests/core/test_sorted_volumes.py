"""Sorted volumes: objects are looked into in the order in which the ray enters their volumes."""

import numpy as np
import pytest
from accelscope.core.contract.events import HIT, JUMP, SKIP, VISIT_LEAF, VOLUME_TEST
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
from accelscope.core.lessons.walk_in_words import event_text
from accelscope.core.scene import Scene


def squares(heights, size=1.0):
    """One object per height: a square in the plane z = height."""
    corners = size * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    two = corners[[[0, 1, 2], [0, 2, 3]]]
    triangles = np.concatenate([two + np.array([0.0, 0.0, height]) for height in heights])
    return Scene.from_triangles(
        triangles, "squares", object_ids=np.repeat(np.arange(len(heights)), 2),
        object_names=tuple(f"square {height}" for height in heights),
    )  # fmt: skip


DOWN = Rays.from_arrays(np.array([[0.6, 0.3, 10.0]]), np.array([[0.0, 0.0, -1.0]]))


def test_the_walk_ends_before_the_second_object(build):
    structure = build("sorted_volumes", squares([3.0, 1.0, 5.0, 2.0]))
    hits, counters = structure.trace(DOWN)
    assert hits.t[0] == 5.0
    assert counters["N_TS"][0] == 1
    assert counters["volume_tests"][0] == 4
    assert counters["cells_skipped"][0] == 3
    steps = structure.record(DOWN, 0)
    assert steps.cell[steps.kind == VISIT_LEAF].tolist() == [2]
    assert sorted(steps.cell[steps.kind == SKIP].tolist()) == [0, 1, 3]
    assert steps.primitive[steps.kind == JUMP].tolist() == [3]
    assert event_text(steps, len(steps) - 1).startswith("jump over 3: t = 5")
    # Lines that never stop look into all of them, in order.
    steps = structure.record(DOWN, 0, ALL)
    assert steps.cell[steps.kind == VISIT_LEAF].tolist() == [2, 0, 3, 1]
    assert not (steps.kind == JUMP).any()
    assert structure.trace(DOWN, ANY)[1]["N_IT"][0] <= 2


def test_of_equal_hits_the_lowest_triangle_wins(build):
    structure = build("sorted_volumes", squares([3.0, 5.0, 5.0, 5.0, 1.0]))
    hits, counters = structure.trace(DOWN)
    assert hits.primitive[0] in (2, 3)
    assert counters["N_TS"][0] == 3
    assert counters["cells_skipped"][0] == 2


@pytest.mark.parametrize("volume", ["aabb", "sphere", "kdop26", "two_boxes"])
def test_objects_are_entered_in_order_and_the_rest_is_counted(lab, build, volume):
    scene = lab.small_scene("soup")
    structure = build("sorted_volumes", scene, f"volume={volume},parts=100")
    rays, _, _, _ = lab.truth("soup")
    rays = rays.select(np.arange(0, len(rays), 40))
    _, counters = structure.trace(rays, CLOSEST)
    early = 0
    for i in range(len(rays)):
        steps = structure.record(rays, i, CLOSEST)
        tested = steps.kind == VOLUME_TEST
        assert tested.sum() == 100
        entered = np.isfinite(steps.t_enter[tested])
        visits = np.flatnonzero(steps.kind == VISIT_LEAF)
        assert (np.diff(steps.t_enter[visits]) >= 0).all()
        assert counters["N_TS"][i] + counters["cells_skipped"][i] == entered.sum()
        hit = np.flatnonzero(steps.kind == HIT)[-1:]
        skipped = steps.t_enter[steps.kind == SKIP]
        if len(hit):
            assert (skipped > steps.t_enter[hit]).all()
            assert (steps.t_enter[visits] <= steps.t_enter[hit]).all()
        early += len(skipped)
    assert early > 100


def test_objects_are_those_of_the_scene(build):
    scene = squares([3.0, 1.0, 5.0])
    structure = build("sorted_volumes", scene, "parts=2")
    assert len(structure.cells()) == 3
    assert structure.cells().count.tolist() == [2, 2, 2]
    assert structure.statistics().N_V == 3


@pytest.mark.parametrize("parts", [1, 2, 3, 64, 499, 500, 501, 65536])
def test_a_single_object_is_cut_into_equal_parts(lab, build, parts):
    scene = lab.small_scene("soup")
    structure = build("sorted_volumes", scene, f"parts={parts}")
    count = structure.cells().count
    assert len(count) == min(parts, len(scene))
    assert count.sum() == len(scene)
    assert count.max() <= 2 * count.min() + 1
    assert structure.validate() == []


def test_damage_is_found(lab, build):
    structure = build("sorted_volumes", lab.small_scene("soup"), "volume=sphere")
    assert structure.validate() == []
    whole = structure.arrays
    offsets = whole.offsets.copy()
    offsets[-1] -= 1
    structure.arrays = whole._replace(offsets=offsets)
    assert "partition" in structure.validate()[0]
    structure.arrays = whole
    structure.triangles.ids[0] = structure.triangles.ids[1]
    assert "permutation" in structure.validate()[0]
    whole.volumes.rows[5, 3] *= 0.9
    assert "stick out" in structure.validate()[-1]
