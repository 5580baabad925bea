"""Lesson "classification": bars are means of counters over the same lines; slides exist."""

import numpy as np
import pytest
from accelscope.core.lessons.classification import OTHER_WAYS, SLIDES_OF, WAYS
from accelscope.core.lessons.slides import SLIDES
from accelscope.core.sah.line_sample import Ball, random_lines_through


def test_the_way_on_is_a_slide():
    assert set(SLIDES_OF) == set(WAYS)
    for slide in (*SLIDES_OF.values(), *(slide for _, slide, _ in OTHER_WAYS)):
        assert slide in SLIDES


@pytest.mark.parametrize("name", ["suzanne", "one", "mess"])
def test_bars_are_counted(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("classification", scene)
    play = played.play
    lines = random_lines_through(Ball.around(scene.lower, scene.upper, 1.3), play.lines, seed=1)
    for (way, (label, _, _)), structure in zip(WAYS.items(), played.subject.structures):
        _, counts = structure.trace(lines)
        assert play.tests[way] == counts["N_IT"].mean()
        _, own = structure.trace(play.ray)
        assert play.count[way] == own["N_IT"][0]
        assert len(play.tested[way]) <= play.count[way]
        caption = played.picture(way=way).caption
        assert caption.startswith(label[0].upper() + label[1:])
    # Without anything all are tested; with one volume for all, those lines test all that hit it.
    assert play.tests["naive"] == len(scene)
    one = played.subject.structures[1]
    if len(one.arrays.offsets) == 2:
        shares = np.unique(one.trace(lines)[1]["N_IT"])
        assert set(shares.tolist()) <= {0, len(scene)}
    assert len(play.tested["naive"]) == len(scene)
