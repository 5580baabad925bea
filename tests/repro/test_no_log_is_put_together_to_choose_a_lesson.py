"""Which lessons suit a structure is asked while the panel is drawn: nothing is computed for it."""

from __future__ import annotations

import pytest
from accelscope.core.lessons import lessons, lessons_about
from accelscope.core.lessons.construction import keeps_a_log
from accelscope.core.lessons.lesson import build
from accelscope.core.lessons.morton_intervals import has_intervals
from accelscope.sample_scenes import make_sample

SPECS = (
    "bvh", "bvh:builder=lbvh", "bvh:builder=lbvh_parallel", "bvh:builder=hlbvh",
    "bvh:builder=ploc", "bvh:builder=agglomerative", "bvh:builder=sbvh",
    "bvh:builder=lbvh,optimise=rotate", "bvh:optimise=treelet", "bvh:arity=4", "kdtree", "octree",
)  # fmt: skip


@pytest.mark.parametrize("spec", SPECS)
def test_asking_leaves_the_log_as_the_builder_noted_it(spec):
    structure = build(make_sample("suzanne:subdivisions=0"), spec)
    for lesson in lessons().values():
        lesson.suits(structure)
    lessons_about(structure)
    assert structure.keeps_log
    assert "build_log" not in vars(structure)


@pytest.mark.parametrize("spec", [spec for spec in SPECS if spec.startswith("bvh")])
def test_the_answer_is_what_the_log_says(spec):
    structure = build(make_sample("suzanne:subdivisions=0"), spec)
    said, intervals = keeps_a_log(structure), has_intervals(structure)
    log = structure.build_log
    assert ("rearranged" in said) == log.is_rearranged
    assert not log.is_bottom_up or intervals
