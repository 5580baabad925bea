"""B + p I < I: shares of lines against areas, the verdict's arithmetic, and the pictures."""

import numpy as np
import pytest
from accelscope.core.evaluation.records.efficiency import (
    EfficiencySettings,
    Measurement,
    table,
)
from accelscope.core.geometry.kinds import KINDS
from accelscope.core.sah.line_sample import (
    Ball,
    chords,
    parallel_lines_through,
    random_lines_through,
    sample_of,
)
from accelscope.core.sah.timing import time_of_object, time_of_volume, verdict
from accelscope.core.sah.volume_around import volume_around
from accelscope.core.scene import Scene

SETTINGS = EfficiencySettings(lines=20_000)


def test_lines_lie_in_the_ball():
    ball = Ball(np.array([1.0, -2.0, 3.0]), 5.0)
    for rays in (random_lines_through(ball, 500, 1), parallel_lines_through(ball, [1, 2, 3], 400)):
        segments = chords(rays) - ball.centre
        assert np.linalg.norm(segments, axis=2) == pytest.approx(5.0)
        assert np.linalg.norm(rays.directions, axis=1) == pytest.approx(1.0)
    assert (rays.directions == np.array([1, 2, 3]) / np.sqrt(14)).all()


def test_random_lines_are_isotropic_and_uniform():
    ball = Ball(np.zeros(3), 2.0)
    rays = random_lines_through(ball, 40_000, 7)
    error = 4.0 / np.sqrt(len(rays))
    assert np.abs(rays.directions.mean(axis=0)).max() < error / np.sqrt(3)
    assert np.abs((rays.directions**2).mean(axis=0) - 1 / 3).max() < error * np.sqrt(4 / 45)
    # Mean chord 4 V / S = 4 R / 3; its variance R^2 (2 - 16 / 9).
    length = np.linalg.norm(np.diff(chords(rays), axis=1), axis=2)
    assert abs(length.mean() - 8 / 3) < error * 2 * np.sqrt(2 / 9)


# REFERENCE: the tetrahedron in [-1, 1]^3 has the area 8 sqrt(3).
TETRA_P = {
    "aabb": 1 / np.sqrt(3), "kdop6": 1 / np.sqrt(3), "kdop18": 1 / np.sqrt(3), "kdop14": 1.0,
    "kdop26": 1.0, "smallest_sphere": 8 * np.sqrt(3) / (12 * np.pi),
}  # fmt: skip


def test_tetrahedron(lab, build):
    """Area ratios in closed form, and lines against them: it is convex."""
    scene = lab.make_sample("tetra:size=1")
    measurement = Measurement(scene, SETTINGS)
    records = {kind: measurement.of(kind) for kind in KINDS}
    for kind, p in TETRA_P.items():
        assert records[kind]["p_SA"] == pytest.approx(p, abs=1e-9)
    for record in records.values():
        error = record["p_measured_error"]
        assert abs(record["p_measured"] - record["p_SA"]) <= 4 * error + 1e-9
        assert abs(record["p_hit_measured"] - record["p_hit"]) < 4 * record["p_hit_error"]
    # Seen along an axis the tetrahedron is a square, as its box is; the sphere has 3 pi.
    sizes = records["smallest_sphere"]["projected"]
    assert list(sizes.values()) == pytest.approx([4 / (3 * np.pi)] * 3, abs=2e-3)
    assert records["aabb"]["projected"] == {"x": 1.0, "y": 1.0, "z": 1.0}


def test_lines_that_hit_the_object_hit_its_volume(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    ball = Ball.around(scene.lower, scene.upper, 1.5)
    structure = build("bvh", scene)
    for rays in (random_lines_through(ball, 400, 2), parallel_lines_through(ball, [0, 1, 0], 400)):
        for kind in ("aabb", "sphere", "kdop14"):
            sample = sample_of(rays, structure, volume_around(scene, kind))
            assert not (sample.hits_object & ~sample.hits_volume).any()
            assert 0.0 <= sample.ratio <= 1.0


def test_verdict():
    found = verdict(B=2.0, I=10.0, p=0.5)
    assert found == {
        "time_with": 7.0, "pays": True, "break_even": 0.8,
        "speed_up": pytest.approx(10 / 7),
    }  # fmt: skip
    # At the break-even it pays no more.
    assert not verdict(2.0, 10.0, 0.8)["pays"]
    assert not verdict(11.0, 10.0, 0.0)["pays"]


def test_times_are_positive_and_grow_with_the_object(lab):
    small = lab.make_sample("tetra:size=1")
    large = Scene.from_triangles(np.tile(small.triangles, (500, 1, 1)), "large")
    rays = random_lines_through(Ball(np.zeros(3), 3.0), 2000, 1).arrays()
    few, many = (time_of_object(scene.items(), rays) for scene in (small, large))
    # 4 and 2000 triangles; no more is claimed, since machines are disturbed.
    assert 0.0 < few < many
    assert 0.0 < time_of_volume(volume_around(small, "aabb"), rays, np.ones(3)) < many


def test_records_and_table(lab):
    scene = lab.small_scene("bunny")
    measurement = Measurement(scene, SETTINGS, {"1x1x0": (1, 1, 0)})
    records = [measurement.of(kind) for kind in ("aabb", "obb")]
    assert [record["volume"] for record in records] == ["aabb", "obb"]
    for record in records:
        assert record["p_measured"] < record["p_SA"] < 1.0  # it is not convex
        assert set(record["projected"]) == {"1x1x0"}
        assert record["hull_area"] == records[0]["hull_area"]
    lines = table(records).splitlines()
    assert len(lines) == 4
    assert "pA/pB 1x1x0" in lines[0]
