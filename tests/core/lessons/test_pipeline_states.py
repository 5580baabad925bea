"""Lesson "pipeline_states": its states are those that the compiled program's counters count."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import ORANGE
from accelscope.core.lessons.pipeline_states import (
    BOX_OF,
    BOXES,
    CALLS,
    WORDS,
    Settings,
    sent_until,
)
from accelscope.core.pipeline.launch import Pipeline
from accelscope.core.pipeline.loading import program_named
from accelscope.core.pipeline.stage import STAGE_NAMES, STATE_NAMES


@pytest.mark.parametrize("program", ["leaves", "mirror"])
def test_calls_in_the_last_state_are_what_was_counted_for_the_pixel(play_lesson, program):
    played = play_lesson("pipeline_states", program=program)
    (structure,) = played.subject.structures
    pipeline = Pipeline(structure, program_named(program))
    for number, (_, pixel) in enumerate(played.play.found):
        ray = played.play.rays.select(np.array([pixel]))
        counted = dict(zip(STAGE_NAMES, pipeline.launch(ray, 1, 1).calls[0, 0].tolist()))
        for label, name in CALLS.items():
            assert played.row(label, ray=number, state=999) == str(counted[name])


def test_the_stage_that_is_lit_is_that_of_the_state(play_lesson, read_charts):
    played = play_lesson("pipeline_states")
    states, _ = played.play.found[0]
    lit = set()
    for number, state in enumerate(states):
        (chart,) = read_charts(played.play, Settings(state=number))
        ((left, low, right, high),) = chart.rectangles(ORANGE)
        (label,) = [name for name, box in BOXES.items()
                    if np.allclose(box, (left, right, low, high), atol=1e-9)]  # fmt: skip
        assert label == BOX_OF[state.name]
        lit.add(label)
        depth = state.depth
        assert len(sent_until(states, number)) == depth
    assert {"Ray generation", "TraceRay", "Traversal", "Any hit", "Closest hit"} <= lit


def test_every_state_has_its_words_and_its_stage():
    assert set(WORDS) == set(BOX_OF) == set(STATE_NAMES)
    assert set(BOX_OF.values()) == set(BOXES)
