"""Lessons "radix_sort" and "radix_split": every pass sorts stably, the last by all."""

import numpy as np
import pytest
from accelscope.core.lessons.morton_intervals import sorted_along
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.builders.morton.codes import codes_of

SCENES = "suzanne", "one", "flat", "mess"


@pytest.mark.parametrize("name", SCENES)
def test_every_pass_sorts_by_one_digit_more(lab, play_lesson, name):
    played = play_lesson("radix_sort", lab.small_scene(name))
    play, (bvh,) = played.play, played.subject.structures
    assert play.ends == {"done": 6}
    before = play.states[0]
    with Team(SILENT, "testing") as team:
        codes = codes_of(played.scene.boxes(), 63, team)
    assert np.array_equal(before, codes[:: play.stride])
    for number, state in enumerate(play.states):
        low = np.sort(codes & (1 << min(11 * number, 63)) - 1)
        if number:
            assert np.array_equal(state & (1 << min(11 * number, 63)) - 1, low[:: play.stride])
        picture = played.picture(done=number)
        assert len(picture.segments) == len(state) + 2
    assert np.array_equal(play.states[-1], sorted_along(bvh, SILENT).codes[:: play.stride])


@pytest.mark.parametrize("name", SCENES)
def test_a_split_is_stable_and_all_of_them_sort(lab, play_lesson, name):
    played = play_lesson("radix_split", lab.small_scene(name))
    play = played.play
    count = len(play.orders[0])
    assert play.ends == {"bit": 29}
    for bit, (codes, places) in enumerate(zip(play.orders[:-1], play.places, strict=True)):
        is_one = codes >> bit & 1
        want = np.argsort(is_one, kind="stable")
        assert np.array_equal(np.argsort(places), want)
        picture = played.picture(bit=bit)
        zeros_before = np.cumsum(1 - is_one) - (1 - is_one)
        texts = [mark.text for mark in picture.marks]
        assert texts[:count] == [str(number) for number in zeros_before]
        assert f"Bit {bit}: {count - is_one.sum()} zero" in picture.caption
    assert np.array_equal(play.orders[-1], np.sort(play.orders[0]))
