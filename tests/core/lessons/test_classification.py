"""Lesson "classification": bars are means of counters over the same lines; slides exist."""

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.classification import LESSON_OF, OTHER_WAYS, WAYS, Settings
from accelscope.core.lessons.drawing import BLUE, ORANGE
from accelscope.core.lessons.slides import SLIDES
from accelscope.core.sah.line_sample import Ball, random_lines_through


def test_the_way_on_is_a_lesson_or_a_slide(play_lesson):
    assert set(LESSON_OF) == set(WAYS)
    rows = play_lesson("classification").picture().rows
    for way, row in zip(WAYS, rows, strict=False):
        lesson = lesson_named(LESSON_OF[way])
        assert lesson.place > lesson_named("classification").place or way == "naive"
        assert row.meaning.endswith(f"Go on to {lesson.name}")
    for _, slide, _ in OTHER_WAYS:
        assert slide in SLIDES


@pytest.mark.parametrize("name", ["suzanne", "one", "mess"])
def test_bars_are_counted(lab, play_lesson, read_charts, name):
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
    # A bar for each, from the top down, as long as the logarithm of its tests.
    lengths = {way: np.log10(1.0 + tests) for way, tests in play.tests.items()}
    for way in WAYS:
        (chart,) = read_charts(play, Settings(way))
        (chosen,), others = chart.rectangles(ORANGE), chart.rectangles(BLUE)
        bars = np.insert(others, list(WAYS).index(way), chosen, axis=0)
        np.testing.assert_allclose(bars[:, 0], 0.0, atol=1e-9)
        np.testing.assert_allclose(bars[:, 2], list(lengths.values()), atol=1e-9)
        assert (bars[1:, 3] < bars[:-1, 1]).all()
    # Without anything all are tested; with one volume for all, those lines test all that hit it.
    assert play.tests["naive"] == len(scene)
    one = played.subject.structures[1]
    if len(one.arrays.offsets) == 2:
        shares = np.unique(one.trace(lines)[1]["N_IT"])
        assert set(shares.tolist()) <= {0, len(scene)}
    assert len(play.tested["naive"]) == len(scene)
