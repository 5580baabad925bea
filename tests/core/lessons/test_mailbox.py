"""Lesson "mailbox": tests are saved as it says, and hits wait until the ray is there."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.contract.events import HIT, MAILBOX, POSTPONE, TEST, VISIT_EMPTY, VISIT_LEAF
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.column import YELLOW
from accelscope.core.lessons.drawing import GREEN
from accelscope.core.lessons.mailbox import Settings
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

LESSON = lesson_named("mailbox")


def played(scene):
    return LESSON.play(LESSON.subject(scene), Settings(), SILENT)


def has_colour(picture, colour):
    return bool((picture.colours == np.array(colour)).all(axis=1).any())


@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne", "sample"])
def test_the_mailbox_saves_what_is_tested_twice_without(lab, name):
    scene = make_sample(LESSON.sample) if name == "sample" else lab.small_scene(name)
    play = played(scene)
    counts, others = play.walked.counts, play.without.counts
    assert others["mailbox_hits"] == 0
    assert counts["N_IT"] + counts["mailbox_hits"] == others["N_IT"]
    assert counts["N_ETS"] == others["N_ETS"]
    assert play.walked.t_hit == play.without.t_hit
    steps = play.walked.steps
    met, leave = [], np.inf
    nearest = None
    for number in range(play.ends["event"] + 1):
        event = int(play.events[number])
        kind, item = int(steps.kind[event]), int(steps.primitive[event])
        if kind in (VISIT_LEAF, VISIT_EMPTY):
            leave = steps.t_exit[event]
        elif kind == TEST:
            assert item not in met
            met.append(item)
        elif kind == MAILBOX:
            assert item in met
        elif kind == POSTPONE:
            assert steps.t_enter[event] > leave
            nearest = steps.t_enter[event]
        elif kind == HIT:
            assert steps.t_enter[event] <= leave
            nearest = steps.t_enter[event]
        picture = play.picture(Settings(number))
        assert np.isfinite(picture.points()).all()
        listed = [mark.text for mark in picture.marks if mark.text.startswith("triangle ")]
        assert listed == [f"triangle {other}" for other in met[::-1][:8]]
        waits = nearest is not None and nearest > leave
        assert waits == any(mark.text == "waits" for mark in picture.marks)
        assert not waits or has_colour(picture, YELLOW)
        if nearest is not None and not waits:
            assert has_colour(picture, GREEN)
    rows = {row.label: row.text for row in picture.rows}
    assert rows["Tests with Mailbox"] == str(counts["N_IT"])
    assert rows["Tests without"] == str(others["N_IT"])
    assert rows["Saved"] == str(counts["mailbox_hits"])


def test_the_sample_has_what_is_to_be_seen():
    """A postponed hit, and tests saved; and a ray that ended at once would be wrong on others."""
    play = played(make_sample(LESSON.sample))
    assert play.walked.counts["postponed_hits"] >= 1
    assert play.walked.counts["mailbox_hits"] >= 2
    texts = [play.picture(Settings(n)).caption for n in range(play.ends["event"] + 1)]
    assert any("is postponed" in text for text in texts)
    assert any("not tested again" in text for text in texts)
