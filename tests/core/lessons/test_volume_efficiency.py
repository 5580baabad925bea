"""Lesson "volume_efficiency": p is a ratio of surfaces, the verdict is the inequality."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons.drawing import BLUE, GREY, ORANGE
from accelscope.core.lessons.volume_efficiency import Settings


@pytest.mark.parametrize("name", ["suzanne", "one", "flat"])
@pytest.mark.parametrize("spread", [1.0, 2.5])
def test_p_is_the_surface_in_that_of_the_ball(lab, play_lesson, name, spread):
    scene = lab.small_scene(name)
    play = play_lesson("volume_efficiency", scene, spread=spread).play
    radius = 0.5 * spread * np.linalg.norm(scene.upper - scene.lower)
    p = float(play.volume.areas()[0]) / (4.0 * np.pi * radius**2)
    assert abs(play.p - p) < 4.0 * np.sqrt(p * (1.0 - p) / 20_000)
    assert play.B > 0.0
    assert play.I > 0.0
    sample = play.counted
    assert (sample.hits_volume | ~sample.hits_object).all()


def test_the_bars_are_the_two_sides_of_the_inequality(play_lesson, read_charts):
    play = play_lesson("volume_efficiency").play
    for B, I in ((10.0, 100.0), (70.0, 100.0)):  # noqa: E741  the lecture's
        (chart,) = read_charts(play, Settings(B=B, I=I))
        heights = [chart.rectangles(colour)[:, [1, 3]] for colour in (ORANGE, BLUE)]
        np.testing.assert_allclose(heights[0], [(0.0, I), (B, B + play.p * I)], atol=1e-9 * I)
        np.testing.assert_allclose(heights[1], [(0.0, B)], atol=1e-9 * I)
        # Those of the time with the volume stand on each other, right of that without.
        (left, _, end, _), stacked = chart.rectangles(ORANGE)[0], chart.rectangles(ORANGE)[1]
        np.testing.assert_allclose(stacked[[0, 2]], chart.rectangles(BLUE)[0, [0, 2]])
        assert left < end < stacked[0]
        (line,) = chart.lines((*GREY[:3], 0.8))
        np.testing.assert_allclose(line[:, 1], I)


def test_the_verdict_turns_at_the_break_even(play_lesson):
    played = play_lesson("volume_efficiency")
    p = played.play.p
    just_below, just_above = (100.0 * (1.0 - p) * share for share in (0.999, 1.001))
    assert "it pays" in marks_of(played.picture(B=just_below, I=100.0))
    assert "it does not pay" in marks_of(played.picture(B=just_above, I=100.0))
    assert played.row("B + p I", B=10.0, I=100.0) == f"{10.0 + 100.0 * p:.4g} ns"
    assert played.row("Break-Even p", B=10.0, I=100.0) == "0.9000"


def test_it_says_what_is_measured_and_what_is_set(play_lesson):
    played = play_lesson("volume_efficiency")
    for knobs, origins in (({}, ("measured", "measured")), ({"B": 5.0}, ("set", "measured")),
                           ({"I": 5.0}, ("measured", "set"))):  # fmt: skip
        rows = played.picture(**knobs).rows
        for row, origin in zip(rows, origins, strict=False):
            assert f": {origin}" in row.meaning


def test_other_items_are_refused_with_a_way_out(lab, play_lesson):
    with pytest.raises(InputError, match="choose another"):
        play_lesson("volume_efficiency", lab.small_scene("balls"))


def test_a_film_begins_with_what_was_measured_and_ends_beyond_the_break_even(play_lesson):
    played = play_lesson("volume_efficiency")
    values = list(played.play.film(played.lesson))
    assert values[0] == played.play.B
    assert values == sorted(values)
    assert "it does not pay" in marks_of(played.picture(B=values[-1]))


def marks_of(picture):
    return [mark.text for mark in picture.marks]
