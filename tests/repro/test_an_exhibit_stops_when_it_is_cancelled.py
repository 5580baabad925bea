"""Esc stops an exhibit: between its pieces of work a frame reports, and a report may cancel.

No seconds here, which depend on who else uses the processor: what is asserted is that a frame
looks, and that nothing is done after the look that stops it.
"""

from __future__ import annotations

import itertools

import pytest
from accelscope.core.geometry.half_spaces import AT_ONCE
from accelscope.core.lessons import exhibits_of
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import structure_named
from accelscope.core.structures.bvh.hierarchy import MOST_SHAPES
from accelscope.sample_scenes import make_sample

SPECS = (
    "bvh:volume=kdop14", "bvh:builder=ploc,optimise=reinsert", "bvh:builder=sbvh",
    "bvh:builder=parallel_sah", "bvh:builder=lbvh,arity=4",
)  # fmt: skip

AT_HAND = {"cost_over_steps"}
"""Exhibits of what an optimiser noted, a bounded number of steps: their frames look at nothing
that grows with the scene."""


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


def built(spec: str):
    name, texts = parse_spec(spec)
    structure = structure_named(name)
    return structure.build(make_sample("suzanne"), parse(structure.Settings, texts, spec), log=True)


@pytest.mark.parametrize("spec", SPECS)
def test_a_frame_reports_between_its_pieces_of_work(spec):
    structure = built(spec)
    for exhibit in exhibits_of(structure):
        watch = Watch()
        exhibit.frame(0, watch)
        assert len(watch.texts) >= 2 or exhibit.name in AT_HAND, exhibit.name


def test_faces_are_found_some_at_a_time():
    structure = built("bvh:volume=kdop14")
    nodes = min(len(structure.arrays.size), MOST_SHAPES)
    assert nodes > 2 * AT_ONCE
    for exhibit in exhibits_of(structure):
        if exhibit.name in ("levels", "nodes_not_paying"):
            watch = Watch()
            exhibit.frame(0, watch)
            assert watch.texts.count("Finding faces") == -(-nodes // AT_ONCE), exhibit.name


@pytest.mark.parametrize("spec", SPECS)
def test_a_cancelled_frame_leaves_nothing_and_can_be_made_again(spec):
    structure, witness = built(spec), built(spec)
    for each in (structure, witness):
        each.statistics()  # measures the volumes, as after every build
    for exhibit, other in zip(exhibits_of(structure), exhibits_of(witness), strict=True):
        counting = Watch()
        expected = other.frame(0, counting)
        stages = counting.stages()
        for cancel_at in {1, (1 + len(stages)) // 2, len(stages)} if stages else ():
            fresh = next(e for e in exhibits_of(structure) if e.name == exhibit.name)
            watch = Watch(cancel_at)
            with pytest.raises(Cancelled):
                fresh.frame(0, watch)
            assert watch.stages() == stages[:cancel_at]
            again = fresh.frame(0)
            assert again.caption == expected.caption
            assert (again.segments == expected.segments).all()
