"""Esc stops an exhibit within half a second: its frames report, and a report may cancel."""

from __future__ import annotations

import time

import pytest
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

SPECS = (
    "bvh:volume=kdop14", "bvh:builder=ploc,optimise=reinsert", "bvh:builder=sbvh",
    "bvh:builder=parallel_sah", "bvh:builder=lbvh,arity=4",
)  # fmt: skip

AT_ONCE = 0.1
"""Seconds of one thread between two reports over 63,000 triangles; a million have sixteen times as
many, most of which is sorting and gathering: that a tenth grows to half a second at worst is what
was measured."""


class Watch(Progress):
    """Notes the longest time between two reports, and cancels at one of them."""

    def __init__(self, cancel_at: int = -1) -> None:
        self.longest = 0.0
        self.reports = 0
        self.cancel_at = cancel_at
        self.last = time.thread_time()

    def report(self, done: float, total: float, text: str) -> None:
        now = time.thread_time()
        self.longest = max(self.longest, now - self.last)
        self.reports += 1
        if self.reports == self.cancel_at:
            raise Cancelled
        # What the reports themselves take does not count.
        self.last = time.thread_time()


def built(spec: str, scene: str):
    name, texts = parse_spec(spec)
    structure = structure_named(name)
    return structure.build(make_sample(scene), parse(structure.Settings, texts, spec))


@pytest.mark.parametrize("spec", SPECS)
def test_frames_report_all_the_time(spec):
    for exhibit in built(spec, "suzanne").exhibits():
        exhibit.frame(0)  # compiled before
        exhibit.frame(exhibit.count - 1)
    structure = built(spec, "suzanne:subdivisions=3")
    structure.statistics()  # what the record needs is known before an exhibit is asked for
    for exhibit in structure.exhibits():
        for number in {0, exhibit.count - 1}:
            watch = Watch()
            exhibit.frame(number, watch)
            watch.report(1, 1, "end")
            assert watch.longest < AT_ONCE, (exhibit.name, number)


@pytest.mark.parametrize("spec", SPECS)
def test_a_cancelled_frame_leaves_nothing_and_can_be_made_again(spec):
    structure, witness = built(spec, "suzanne"), built(spec, "suzanne")
    n_cancelled = 0
    for exhibit, other in zip(structure.exhibits(), witness.exhibits(), strict=True):
        counting = Watch()
        expected = other.frame(0, counting)
        for cancel_at in {1, counting.reports // 2, counting.reports} - {0}:
            fresh = next(e for e in structure.exhibits() if e.name == exhibit.name)
            with pytest.raises(Cancelled):
                fresh.frame(0, Watch(cancel_at))
            n_cancelled += 1
            again = fresh.frame(0)
            assert again.caption == expected.caption
            assert (again.segments == expected.segments).all()
    assert n_cancelled > 5
