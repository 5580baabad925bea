"""Lesson "construction": after every step the boxes divide the scene, as the logs have it."""

import itertools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons.construction import BUILDERS
from accelscope.core.lessons.lesson import build
from accelscope.core.structures.bvh.topology.tree import ranges_of


@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat", "balls"])
def test_boxes_divide_the_scene_after_every_step(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("construction", scene)
    n = len(scene)
    for structure, (name, building) in zip(
        played.subject.structures, played.play.buildings.items(), strict=True
    ):
        arrays = structure.arrays
        begin, end = ranges_of(arrays.first, arrays.size, structure.width())
        steps = np.unique(np.linspace(0, building.last, 9).astype(int))
        counts = []
        for step in steps:
            nodes = building.nodes_at(step)
            spans = sorted(zip(begin[nodes], end[nodes], strict=True))
            # One behind the other, without a gap: everything is in exactly one box.
            assert spans[0][0] == 0
            assert spans[-1][1] == n
            assert all(a[1] == b[0] for a, b in itertools.pairwise(spans))
            counts.append(len(nodes))
            assert building.boxes_at[step] == len(nodes)
            tests = (structure.areas * (end - begin))[nodes].sum() / (structure.areas[0] or 1.0)
            assert building.tests_at[step] == pytest.approx(tests, rel=1e-9)
            assert (np.diff((end - begin)[nodes]) <= 0).all()
        if name == "Top-down":
            assert counts == [step + 1 for step in steps]
        elif name == "Bottom-up":
            assert counts == [n - step for step in steps]
        assert sorted((counts[0], counts[-1])) == sorted((1, n))
        assert building.cost == pytest.approx(structure.efficiency().expected[0])
        for percent in (0, 37, 100):
            nodes = building.nodes_at(building.step(percent))
            assert played.row(name, percent=percent).startswith(
                f"{len(nodes):,} ".replace(",", " ")
            )


def test_captions_say_the_steps_of_the_logs(play_lesson):
    played = play_lesson("construction")
    for percent in (0, 1, 50, 100):
        caption = played.picture(percent=percent).caption
        for structure in played.subject.structures:
            last = structure.build_log.last_step
            assert f"step {-(-last * percent // 100)} of {last}" in caption


def test_a_tree_without_a_log_or_rearranged_is_refused(lab, play_lesson):
    lesson = play_lesson("construction", lab.small_scene("one")).lesson
    scene = lab.small_scene("suzanne")
    rearranged = build(scene, "bvh:optimise=rotate")
    for structure in (build(scene, "grid"), rearranged):
        with pytest.raises(InputError, match="cannot be given"):
            lesson.subject(scene, given=[structure])
    assert len(BUILDERS) == len(lesson.structures)
