"""Esc stops a lesson: between its pieces of work it reports, and a report may cancel.

No seconds here, which depend on who else uses the processor: what is asserted is that a play looks,
that nothing is done after the look that stops it, and that it can be played again.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from accelscope.core.geometry import hull
from accelscope.core.geometry.half_spaces import AT_ONCE
from accelscope.core.lessons import lesson_named, refit
from accelscope.core.lessons.around import hull_surface
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


def test_a_hull_grows_some_points_at_a_time():
    points = np.random.default_rng(1).normal(size=(400, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)  # all of them are corners
    watch = Watch()
    area = hull.hull_area(points, watch)
    # Once before the tetrahedron of four and once at the end; a last call finds nothing to do if
    # the one before it took in as many as it could.
    assert len(watch.texts) == 3 + (len(points) - 4) // hull.POINTS_PER_CALL

    class Second(Progress):
        looks = 0

        def report(self, done, total, text):
            self.looks += 1
            if self.looks == 2:
                raise Cancelled

    stopped = Second()
    with pytest.raises(Cancelled):
        hull.hull_area(points, stopped)
    assert stopped.looks == 2
    assert hull.hull_area(points) == area


def test_lessons_can_be_stopped_while_the_hull_grows(monkeypatch):
    scene = make_sample("suzanne")
    few, many = Watch(), Watch()
    area = hull_surface(scene, few)
    monkeypatch.setattr(hull, "POINTS_PER_CALL", 1)
    assert hull_surface(scene, many) == area
    assert len(many.texts) > len(few.texts)


@pytest.mark.parametrize("name", ["rearranging", "refit", "construction"])
def test_what_takes_long_is_behind_a_look_of_its_own(name, monkeypatch):
    lesson = lesson_named(name)
    subject = lesson.subject(make_sample("suzanne:subdivisions=0"))
    watch, put_together = Watch(), []
    for structure in subject.structures:
        told = structure._log

        def noted(of, told=told):
            put_together.append(len(watch.texts))
            return told(of)

        structure._log = noted
    deform = refit.deformed

    def deformed(*args):
        put_together.append(len(watch.texts))
        return deform(*args)

    monkeypatch.setattr(refit, "deformed", deformed)
    lesson.play(subject, lesson.Settings(), watch)
    # Before the first there was a look, and between any two of them.
    assert put_together[0] > 0
    assert len(set(put_together)) == len(put_together) > 1


def test_nodes_are_listed_in_steps_between_which_it_can_be_cancelled():
    structure = build(make_sample("suzanne:subdivisions=0"), "bvh")
    watch = Watch()
    structure.cells(watch)
    assert watch.texts.count("Listing the nodes") == 7
