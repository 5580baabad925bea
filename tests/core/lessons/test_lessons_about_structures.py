"""Every lesson on every structure that it can be taught on, whatever its settings are."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons import lessons_about
from accelscope.core.lessons.picture import MOST_SEGMENTS
from accelscope.core.progress import SILENT

SMALL_SCENES = "suzanne", "one", "mess", "flat"

TELLING = "volume", "arity", "optimise"
"""Settings that pictures of the same lesson depend on."""


@pytest.mark.exhaustive
@pytest.mark.parametrize("scene", SMALL_SCENES)
def test_pictures_can_be_drawn_and_leave_the_structure_alone(scene, lab, build):
    seen = set()
    for name, text in lab.ALL_VARIANTS:
        structure = build(name, lab.small_scene(scene), text, log=True)
        before = structure.cells().boxes, structure.geometry.ids.copy()
        for lesson in lessons_about(structure):
            kind = lesson.name, *(getattr(structure.settings, key, "") for key in TELLING)
            if kind not in seen:
                seen.add(kind)
                with contextlib.suppress(InputError):  # there is nothing to show
                    check_lesson(lesson, structure)
        np.testing.assert_array_equal(structure.cells().boxes, before[0])
        np.testing.assert_array_equal(structure.geometry.ids, before[1])
    assert len({name for name, *_ in seen}) > 20


def check_lesson(lesson, structure):
    """Assert that the pictures of a lesson can be drawn."""
    subject, settings = lesson.subject(structure.scene, given=[structure]), lesson.Settings()
    play = lesson.play(subject, settings, SILENT)
    for knobs in (settings, play.on_page(lesson, settings)[-1]):
        picture = play.picture(play.within(knobs))
        assert len(picture.segments) == len(picture.colours) <= MOST_SEGMENTS
        assert np.isfinite(picture.points()).all()
        assert picture.caption
