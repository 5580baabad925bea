"""Lesson "sah": its terms add up to the cost of the log, and are those of the finished tree."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import SPLIT
from accelscope.core.errors import InputError
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, GREY, ORANGE
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.sah import Sah, Settings
from accelscope.core.lessons.splits import was_split_by_cost
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.topology.tree import ranges_of


@pytest.mark.parametrize("builder", ["sweep_sah", "binned_sah", "parallel_sah"])
@pytest.mark.parametrize("scene", ["suzanne", "mess"])
def test_the_terms_of_a_split_are_those_of_the_tree_and_add_up_to_the_cost_of_the_log(
    lab, build, read_charts, scene, builder
):
    bvh = build("bvh", lab.small_scene(scene), f"builder={builder},C_trav=3,C_isect=2", log=True)
    play, log = Sah(bvh, SILENT), bvh.build_log
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    boxes = bvh.arrays.volumes.boxes()
    finite = (log.kind == SPLIT) & (log.axis >= 0) & np.isfinite(log.cost)
    assert play.ends["node"] + 1 == len(play.splits) == min(int(finite.sum()), 31)
    # Those nearest to the root, level by level.
    depths = [split.depth for split in play.splits]
    assert depths == sorted(bvh.depths()[log.cells[log.node[finite]]])[: len(depths)]
    assert play.splits[0].node == 0
    for number, (split, terms) in enumerate(zip(play.splits, play.terms, strict=True)):
        event = log.split_of(split.node)
        assert terms.cost == pytest.approx(split.cost, rel=1e-12)
        assert split.cost == log.cost[event]
        assert (split.axis, split.position) == (log.axis[event], log.position[event])
        assert log.counts[event].tolist() == [terms.N_L, terms.N_R]
        children = bvh.arrays.first[split.node] + np.arange(2)
        assert np.array_equal(split.box, boxes[split.node])
        assert np.array_equal(split.sides, boxes[children])
        assert (end - begin)[children].tolist() == [terms.N_L, terms.N_R]
        area = surface_area(boxes[split.node])
        assert terms.p_L == surface_area(boxes[children[0]]) / area
        (chart,) = read_charts(play, Settings(number, "cost"))
        # The terms stand on each other, and beside them what the node costs undivided.
        left = 2.0 * surface_area(boxes[children[0]]) / area * terms.N_L
        undivided = 2.0 * (terms.N_L + terms.N_R)
        for colour, bars in (
            (GREY, [(0.0, 3.0), (0.0, undivided)]), (BLUE, [(3.0, 3.0 + left)]),
            (ORANGE, [(3.0 + left, split.cost)]),
        ):  # fmt: skip
            drawn = chart.rectangles(colour)[:, [1, 3]]
            np.testing.assert_allclose(drawn, bars, atol=1e-9 * undivided)
        last = chart.picture
        assert f"= {split.cost:.2f}" in last.caption
        assert f"Cost = {split.cost:.2f}" in [mark.text for mark in last.marks]


def test_terms_come_one_after_the_other(play_lesson):
    played = play_lesson("sah")
    counts = [
        len(played.picture(term=term).marks)
        for term in played.lesson.Settings.__dataclass_fields__["term"].metadata["choices"]
    ]
    assert counts == [2, 3, 5, 7, 9]


def test_what_was_not_split_by_cost_is_refused(lab, build):
    lesson = lesson_named("sah")
    scene = lab.small_scene("suzanne")
    assert "no hierarchy" in was_split_by_cost(build("grid", scene))
    for text in ("builder=lbvh", "optimise=rotate", "arity=4"):
        assert "by cost" in was_split_by_cost(build("bvh", scene, text, log=True))
    assert "log" in was_split_by_cost(build("bvh", scene))
    one = build("bvh", lab.small_scene("one"), log=True)
    with pytest.raises(InputError, match="more triangles"):
        lesson.play(Subject(one.scene, (one,)), Settings(), SILENT)
