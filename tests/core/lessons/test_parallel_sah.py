"""Lesson "data_parallel_split": the reduction ends with the plane of the tree."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import BLUE, GREY, RED
from accelscope.core.lessons.parallel_sah import Reduction, Settings
from accelscope.core.progress import SILENT
from accelscope.core.sah.split_curve import split_curve
from accelscope.core.scene import Scene


def test_the_reduction_leaves_the_plane_that_the_builder_noted(lab, build, read_charts):
    tree = build("bvh", lab.small_scene("suzanne"), "builder=parallel_sah,bins=10", log=True)
    play, curve = Reduction(tree, tree.build_log, SILENT), split_curve(tree, 0)
    assert play.ends == {"step": 5}
    assert [len(left) for left in play.left] == [30, 15, 8, 4, 2, 1]
    for before, after in zip(play.left[:-1], play.left[1:], strict=True):
        for place, winner in enumerate(after):
            pair = before[2 * place : 2 * place + 2]
            assert play.costs[winner] == play.costs[pair].min()
            assert winner == pair[np.argmin(play.costs[pair])]
    axis, position = curve.axis[curve.best], curve.position[curve.best]
    event = tree.build_log.split_of(0)
    assert (tree.build_log.axis[event], tree.build_log.position[event]) == (axis, position)
    winner = play.left[-1][0]
    assert (winner // 10, play.planes[winner]) == (axis, position)
    for step in range(6):
        (chart,) = read_charts(play, Settings(step))
        picture, slack = chart.picture, 1e-9 * chart.chart.top
        bars = chart.lines(GREY)[2:], chart.lines(BLUE)
        for drawn, candidates in zip(bars, (np.arange(30), play.left[step]), strict=True):
            x, costs = candidates[np.isfinite(play.costs[candidates])], play.costs
            np.testing.assert_allclose(drawn[:, 0], np.stack([x, 0 * x], axis=1), atol=slack)
            np.testing.assert_allclose(drawn[:, 1], np.stack([x, costs[x]], axis=1), atol=slack)
        red = picture.segments[(picture.colours == RED).all(axis=1)]
        assert len(red) == (6 if step == 5 else 0)
        assert (red[..., axis] == position).all()
        assert f": {len(play.left[step])} of 30 candidates left" in picture.caption
    assert picture.caption.endswith(f"{'xyz'[axis]} = {position:.5g}")


def test_a_root_that_is_a_leaf_has_no_plane_that_was_taken(build):
    scene = Scene.from_triangles(np.random.default_rng(1).random((4, 3, 3)), "few")
    tree = build("bvh", scene, "builder=parallel_sah,max_leaf_size=4,C_trav=50", log=True)
    play = Reduction(tree, tree.build_log, SILENT)
    picture = play.picture(Settings(play.ends["step"]))
    assert not (picture.colours == RED).all(axis=1).any()
    assert "leaf" in picture.caption


@pytest.mark.parametrize("count", [1, 20])
def test_triangles_that_no_plane_tells_apart(build, count):
    corners = np.tile(np.eye(3), (count, 1, 1))
    scene = Scene.from_triangles(corners, "same")
    tree = build("bvh", scene, "builder=parallel_sah", log=True)
    play = Reduction(tree, tree.build_log, SILENT)
    assert "no plane" in play.picture(Settings(play.ends["step"])).caption
