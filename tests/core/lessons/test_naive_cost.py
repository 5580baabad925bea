"""Lesson "naive_cost": N tests for every ray, whatever the part; times and the BVH are measured."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import BLUE, ORANGE, RED
from accelscope.core.lessons.naive_cost import Settings
from accelscope.core.structures import structures


@pytest.mark.parametrize("name", ["suzanne", "mess", "one"])
def test_every_ray_tests_every_object_of_the_part(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("naive_cost", scene)
    growth = played.play.growth
    assert growth.counts[-1] == len(scene)
    assert np.array_equal(np.sort(growth.order), np.arange(len(scene)))
    # O(N), exactly: not the mean but each ray, and so the line has the slope 1.
    assert (growth.naive == growth.counts[:, None]).all()
    assert played.play.slope == pytest.approx(1.0, abs=1e-12)
    assert (growth.seconds > 0.0).all()
    kind = structures()["naive"]
    _, counts = kind.build(scene, kind.Settings()).trace(growth.rays)
    assert (counts["N_IT"] == growth.naive[-1]).all()
    kind = structures()["bvh"]
    _, counts = kind.build(scene, kind.Settings()).trace(growth.rays)
    assert counts["N_IT"].mean() == played.play.with_bvh[-1]


def test_parts_are_eighths_and_their_rows_say_so(play_lesson):
    played = play_lesson("naive_cost")
    n = len(played.scene)
    for part in range(1, 9):
        assert played.row("N_IT, Naive", part=part) == f"{-(-n * part // 8):,}".replace(",", " ")
        picture = played.picture(part=part)
        assert f"N = {-(-n * part // 8):,}".replace(",", " ") in picture.caption


def test_the_stars_of_the_chart_lie_on_the_fitted_line(play_lesson, read_charts):
    play = play_lesson("naive_cost").play
    (chart,) = read_charts(play, Settings(3))
    counts, picture = play.growth.counts, chart.picture
    np.testing.assert_allclose(chart.stars(ORANGE), np.stack([counts, counts], axis=1))
    with_bvh = np.stack([counts, play.growth.tests.mean(axis=1)], axis=1)
    np.testing.assert_allclose(chart.curve(BLUE), with_bvh)
    np.testing.assert_allclose(chart.lines(RED)[0, 1], (counts[2], counts[2]))
    orange = picture.segments[(picture.colours[:, :3] == ORANGE[:3]).all(axis=1)]
    line, stars = orange[0], orange[1:].reshape(8, 3, 2, 3).mean(axis=(1, 2))
    along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
    away = np.cross(stars - line[0], along)
    assert np.abs(away).max() < 1e-12


def test_items_that_are_no_triangles(lab, play_lesson):
    played = play_lesson("naive_cost", lab.small_scene("balls"))
    assert (played.play.growth.naive == played.play.growth.counts[:, None]).all()
    assert "item" in played.picture().caption
