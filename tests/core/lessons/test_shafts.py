"""Lesson "shafts": green boxes are the starts of the class, and blue ones what its ray enters."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.contract.events import TEST
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, GREEN, GREY, extent_of
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.shafts import Settings, nodes_of
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

SCENES = ["suzanne:subdivisions=0", "one", "mess"]


@functools.cache
def played(name, settings, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("shafts").play(Subject(scene), settings, SILENT)


def segments_in(picture, colour):
    """Those segments of a picture that have a colour, each with its lower end first."""
    return picture.segments[(picture.colours == colour).all(axis=1)]


def as_set(segments):
    return {tuple(np.round(segment, 9).ravel()) for segment in segments}


@pytest.mark.parametrize("most", [2, 16])
@pytest.mark.parametrize("name", SCENES)
def test_boxes_are_those_of_both_walks(lab, name, most):
    play = played(name, Settings(most), lab)
    structure, last = play.structure, play.ends["number"]
    apart = np.array([1.6 * extent_of(play.scene), 0.0, 0.0])
    for place in sorted({0, last // 3, last // 2, last}):
        number = int(play.order[place])
        picture = play.picture(Settings(most, place))
        starts, ray = structure.starts_of(number), play.ray_of(number)
        assert len(starts) <= most
        assert play.classes[ray] == number
        assert [m.text for m in picture.marks[:-2]] == [
            str(n + 1) for n in range(min(len(starts), 9))
        ]
        green = segments_in(picture, (*GREEN[:3], 0.7))
        assert as_set(green) == as_set(box_segments(play.boxes[starts]))
        here, from_root = structure.record(play.rays, ray), structure.bvh.record(play.rays, ray)
        entered, others = nodes_of(here), nodes_of(from_root)
        assert len(entered) == here.tally()["N_TS"]
        assert play.work[ray] == here.tally()["N_TS"] + here.tally()["volume_tests"]
        spared = others[~np.isin(others, entered)]
        shared = others[np.isin(others, entered)]
        blue = as_set(segments_in(picture, BLUE))
        assert blue == as_set(box_segments(play.boxes[entered])) | as_set(
            box_segments(play.boxes[shared]) + apart
        )
        grey = segments_in(picture, (*GREY[:3], 0.8))
        assert as_set(grey) == as_set(box_segments(play.boxes[spared]) + apart)
        for text, walk in zip(picture.marks[-2:], (here, from_root), strict=True):
            tally = walk.tally()
            assert f"{tally['N_TS']} steps, {tally['volume_tests']} tests" in text.text
        # The same items are tested, whichever way they are come to, and the same is hit.
        items = [set(walk.primitive[walk.events_of(TEST)].tolist()) for walk in (here, from_root)]
        assert items[0] <= items[1]


def test_longer_arrays_spare_more(lab):
    saved = [
        1.0 - (play.work.sum() / play.work_from_root.sum())
        for play in (played(SCENES[0], Settings(most), lab) for most in (1, 4, 16))
    ]
    assert 0.0 < saved[0] < saved[1] < saved[2]
