"""Lesson "rearranging": costs are those noted, moves of a step those of the log."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import FIT, MOVE, REINSERT
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons.drawing import BLUE, RED, faint
from accelscope.core.lessons.rearranging import COLOURS, WHICH, Course, Rearranging, Settings
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.optimisers import OPTIMISERS


@pytest.mark.parametrize("optimise", sorted(set(OPTIMISERS) - {"none"}))
@pytest.mark.parametrize("builder", ["lbvh", "rtree_insert"])
def test_every_step_has_the_moves_of_the_log(muddle, build, read_charts, builder, optimise):
    text = f"builder={builder},optimise={optimise},max_leaf_size=1"
    bvh = build("bvh", muddle, text, log=True)
    log = bvh.build_log
    course = Course(bvh, log, SILENT)
    assert course.costs.tolist() == bvh.rearrangement.costs
    assert course.moves.sum() == bvh.rearrangement.made > 0
    # A step with moves changes the cost by what they gain together.
    is_move = np.isin(log.kind, (MOVE, REINSERT)) & ~np.isnan(log.cost)
    first = int(log.step[~np.isin(log.kind, (MOVE, REINSERT, FIT))].max())
    gains = np.bincount(log.step[is_move] - first, log.cost[is_move], len(course.costs))
    np.testing.assert_allclose(-np.diff(course.costs), gains[1:], atol=1e-9)
    play = Rearranging(muddle, [course])
    for step in range(len(course.costs)):
        picture = play.picture(Settings(step))
        assert f"step {step} of {len(course.costs) - 1}" in picture.caption
        assert f"SAH cost {course.costs[step]:.2f}," in picture.caption
        assert f"; {course.moves[step]} move" in picture.caption.replace(" ", " ")
        red = picture.segments[(picture.colours == RED).all(axis=1)]
        boxes = box_segments(course.boxes[step])
        assert len(boxes) == 12 * min(course.moves[step], 60)
        assert len(boxes) == 0 or np.array_equal(red[-len(boxes) :], boxes)
        (chart,) = read_charts(play, Settings(step))
        curve = np.stack([np.arange(len(course.costs)), course.costs], axis=1)
        np.testing.assert_allclose(chart.curve(faint(BLUE, 0.35)), curve, atol=1e-9)
        np.testing.assert_allclose(chart.lines(RED)[0, 1], curve[step], atol=1e-9)
        if step > 0:
            np.testing.assert_allclose(chart.curve(BLUE), curve[: step + 1], atol=1e-9)


def test_three_trees_begin_alike(play_lesson, read_charts):
    played = play_lesson("rearranging")
    courses = played.play.courses
    assert [course.name for course in courses] == ["reinsert", "treelet", "rotate"]
    assert len({course.costs[0] for course in courses}) == 1
    assert played.play.ends["step"] == max(len(course.costs) for course in courses) - 1
    # What there is to look for.
    reinsert, treelet, rotate = courses
    assert len(rotate.costs) < min(len(reinsert.costs), len(treelet.costs))
    assert reinsert.costs[-1] < min(treelet.costs[-1], rotate.costs[-1])
    for course in courses:
        assert course.costs[0] - course.costs[1] > 0.5 * (course.costs[0] - course.costs[-1])
    (chart,) = read_charts(played.play, Settings(999))
    for colour, course in zip(COLOURS, courses, strict=True):
        curve = np.stack([np.arange(len(course.costs)), course.costs], axis=1)
        np.testing.assert_allclose(chart.curve(colour), curve, atol=1e-9)
    for name, course in zip(WHICH, courses, strict=True):
        picture = played.picture(moves_of=name, step=1)
        assert picture.caption.startswith(f"{course.name}, step 1 of ")
        last = played.picture(moves_of=name, step=999)
        assert f"SAH cost {course.costs[-1]:.2f}" in last.caption


def test_a_tree_that_was_not_kept_says_so(lab, build):
    scene = lab.small_scene("teapot_in_stadium")
    bvh = build("bvh", scene, "max_leaf_size=16,C_trav=3,optimise=reinsert", log=True)
    play = Rearranging(scene, [Course(bvh, bvh.build_log, SILENT)])
    assert play.picture(Settings(0)).caption.endswith("and was kept")


def test_one_triangle_has_nothing_to_rearrange(lab, play_lesson):
    played = play_lesson("rearranging", lab.small_scene("one"))
    for step in range(played.play.ends["step"] + 1):
        assert "; 0 moves" in played.picture(step=step).caption
