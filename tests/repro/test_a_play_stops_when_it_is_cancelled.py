"""Esc stops a lesson: between its pieces of work it reports, and a report may cancel.

No seconds here, which depend on who else uses the processor: what is asserted is that a play looks,
that nothing is done after the look that stops it, and that it can be played again.
"""

from __future__ import annotations

import itertools

import pytest
from accelscope.core.geometry.half_spaces import AT_ONCE
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.lesson import build
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.structures.bvh.hierarchy import MOST_SHAPES
from accelscope.sample_scenes import make_sample

NAMES = (
    "sah", "cost_curve", "axis_choice", "sah_decision", "split_plane", "split_queues",
    "data_parallel_split", "morton_codes", "morton_intervals", "radix_sort", "ploc", "phr",
    "extended_codes", "rearranging", "reinsertion", "treelets", "spatial_splits", "refit",
)  # fmt: skip


class Watch(Progress):
    """Notes what is reported, and cancels when a stage begins.

    Stages are reports of one text that follow each other: how many a stage has may depend on how
    long its chunks take.
    """

    def __init__(self, cancel_at: int = -1) -> None:
        self.texts: list[str] = []
        self.cancel_at = cancel_at

    def report(self, done: float, total: float, text: str) -> None:
        assert 0 <= done <= total
        self.texts.append(text)
        if len(self.stages()) == self.cancel_at:
            raise Cancelled

    def stages(self) -> list[str]:
        return [text for text, _ in itertools.groupby(self.texts)]


@pytest.mark.parametrize("name", NAMES)
def test_a_cancelled_play_leaves_nothing_and_can_be_played_again(name):
    lesson = lesson_named(name)
    subject, settings = lesson.subject(make_sample(lesson.sample)), lesson.Settings()
    watch = Watch()
    expected = lesson.play(subject, settings, watch).picture(lesson.Settings())
    stages = watch.stages()
    for cancel_at in {1, (1 + len(stages)) // 2, len(stages)}:
        stopped = Watch(cancel_at)
        with pytest.raises(Cancelled):
            lesson.play(subject, settings, stopped)
        assert stopped.stages() == stages[:cancel_at]
    again = lesson.play(subject, settings, SILENT).picture(lesson.Settings())
    assert again.caption == expected.caption
    assert (again.segments == expected.segments).all()


def test_faces_are_found_some_at_a_time():
    structure = build(make_sample("suzanne"), "bvh:volume=kdop14")
    nodes = min(len(structure.arrays.size), MOST_SHAPES)
    assert nodes > 2 * AT_ONCE
    watch, lesson = Watch(), lesson_named("levels")
    subject = lesson.subject(structure.scene, given=[structure])
    lesson.play(subject, lesson.Settings(), watch)
    assert watch.texts.count("Finding faces") == -(-nodes // AT_ONCE)
