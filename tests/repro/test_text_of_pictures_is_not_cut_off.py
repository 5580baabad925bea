# SPDX-License-Identifier: GPL-3.0-or-later
"""Text of a lesson's picture ended at its border: it was set before the picture was cut out."""

import numpy as np
import pytest
from accelscope.core.evaluation.pages.lesson_pictures import LessonPainter
from accelscope.core.evaluation.pages.lettering import Letters, free_place
from accelscope.core.lessons.picture import Mark, Picture
from accelscope.sample_scenes import make_sample


@pytest.mark.parametrize("column", [0.0, 50.0, 60.0, 95.0, 100.0])
def test_a_text_stands_in_its_picture(column):
    for width in (10.0, 60.0, 99.0):
        left, _ = free_place(Letters(column, 50.0, "", (0, 0, 0)), width, 20.0, [], 100, 100)
        assert 0.0 <= left <= 100.0 - width


def test_no_letter_touches_the_border_of_a_lessons_picture():
    pytest.importorskip("PIL")
    scene = make_sample("tetra:size=2")
    none = Picture("nothing")
    plain = LessonPainter(scene, [none]).paint(none)
    for corner in (scene.lower, scene.upper):
        marked = Picture("a text", marks=(Mark(corner, "a text that is rather long for this"),))
        image = LessonPainter(scene, [none]).paint(marked)
        changed = np.abs(image - plain).max(axis=2) > 0.05
        assert changed.sum() > 300
        assert not changed[:, [0, -1]].any()
