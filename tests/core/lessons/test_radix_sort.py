"""Lessons "radix_sort" and "radix_split": every pass sorts stably, the last by all."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import BLUE, ORANGE
from accelscope.core.lessons.morton_intervals import sorted_along
from accelscope.core.lessons.radix_sort import BitSettings, PassSettings
from accelscope.core.lessons.scattering import ITEMS, RESULT
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.builders.morton.codes import codes_of

SCENES = "suzanne", "one", "flat", "mess"


@pytest.mark.parametrize("name", SCENES)
def test_every_pass_sorts_by_one_digit_more(lab, play_lesson, read_charts, name):
    played = play_lesson("radix_sort", lab.small_scene(name))
    play, (bvh,) = played.play, played.subject.structures
    assert play.ends == {"done": 6}
    before = play.states[0]
    with Team(SILENT, "testing") as team:
        codes = codes_of(played.scene.boxes(), bvh.settings, team)
    assert np.array_equal(before, codes[:: play.stride])
    for number, state in enumerate(play.states):
        low = np.sort(codes & (1 << min(11 * number, 63)) - 1)
        if number:
            assert np.array_equal(state & (1 << min(11 * number, 63)) - 1, low[:: play.stride])
        (chart,) = read_charts(play, PassSettings(number))
        bars = chart.values(chart.picture.segments[2:])
        middles = np.arange(len(state)) + 0.5
        np.testing.assert_allclose(bars[..., 0], np.stack([middles, middles], axis=1))
        heights = np.stack([0.0 * state, state], axis=1)
        np.testing.assert_allclose(bars[..., 1], heights, atol=1e-9 * 2.0**63)
    assert np.array_equal(play.states[-1], sorted_along(bvh, SILENT).codes[:: play.stride])


@pytest.mark.parametrize("name", SCENES)
def test_a_split_is_stable_and_all_of_them_sort(lab, play_lesson, read_charts, name):
    played = play_lesson("radix_split", lab.small_scene(name))
    play = played.play
    count = len(play.orders[0])
    assert play.ends == {"bit": 29}
    for bit, (codes, places) in enumerate(zip(play.orders[:-1], play.places, strict=True)):
        is_one = codes >> bit & 1
        want = np.argsort(is_one, kind="stable")
        assert np.array_equal(np.argsort(places), want)
        below, matrix = read_charts(play, BitSettings(bit))
        picture = below.picture
        for side, colour in ((is_one == 0, BLUE), (is_one == 1, ORANGE)):
            for low, x in ((ITEMS, np.flatnonzero(side)), (RESULT, places[side])):
                np.testing.assert_allclose(below.rectangles(colour, low)[:, 0], x + 0.1)
            row = matrix.rectangles(colour)
            np.testing.assert_allclose(row[:, 0], np.flatnonzero(side), atol=1e-9)
            np.testing.assert_allclose(row[:, 1], bit, atol=1e-9)
        zeros_before = np.cumsum(1 - is_one) - (1 - is_one)
        texts = [mark.text for mark in picture.marks]
        assert texts[:count] == [str(number) for number in zeros_before]
        assert f"Bit {bit}: {count - is_one.sum()} zero" in picture.caption
    assert np.array_equal(play.orders[-1], np.sort(play.orders[0]))
