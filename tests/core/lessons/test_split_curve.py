"""Lesson "cost_curve": the plane it marks is that of the tree, and the cheapest of its curve."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import BLUE, GREEN, RED
from accelscope.core.lessons.split_curve import CostCurve, Settings
from accelscope.core.progress import SILENT
from accelscope.core.sah.split_curve import RULES
from accelscope.core.scene import Scene


@pytest.mark.parametrize("builder", RULES)
@pytest.mark.parametrize("scene", ["suzanne", "mess"])
def test_what_is_marked_is_what_the_builder_noted(lab, build, read_charts, scene, builder):
    tree = build("bvh", lab.small_scene(scene), f"builder={builder}", log=True)
    play, log = CostCurve(tree, tree.build_log, SILENT), tree.build_log
    assert play.nodes[0].node == 0
    depths = [tree.depths()[this.node] for this in play.nodes]
    assert depths == sorted(depths)
    for number, this in enumerate(play.nodes):
        picture, event, curve = play.picture(Settings(number)), log.split_of(this.node), this.curve
        for across, chart in enumerate(read_charts(play, Settings(number))):
            check_chart(chart, this, across, builder)
        axis, position = log.axis[event], log.position[event]
        if axis < 0:
            assert "by index" in picture.caption
            continue
        n_left, n_right = log.counts[event]
        assert f"{'xyz'[axis]} = {position:.5g}: N_L = {n_left}, N_R = {n_right}" in picture.caption
        best = curve.best
        assert (curve.axis[best], curve.position[best]) == (axis, position)
        assert (curve.N_L[best], curve.N_R[best]) == (n_left, n_right)
        if np.isfinite(log.cost[event]):
            assert curve.cost[best] == log.cost[event] == curve.cost.min()
            assert f"Cost = {log.cost[event]:.2f}" in [mark.text for mark in picture.marks]
        # No candidate of the builder is cheaper than the cheapest of all cuts.
        assert curve.cost[best] >= this.sweep.cost[this.sweep.best] * (1.0 - 1e-12)
        # The plane stands in the model, the charts beside it.
        red = picture.segments[(picture.colours == RED).all(axis=1)]
        assert ((red[..., axis] == position).all(axis=1)).sum() >= 6
        beside = picture.segments[..., 0].min(axis=1) > tree.scene.upper[0]
        assert 6 < beside.sum() < len(picture.segments)


def check_chart(chart, this, axis, builder):
    """Assert that the chart of an axis shows the candidates across it, each at its place."""
    slack = {"atol": 1e-9 * max(chart.chart.span, chart.chart.top)}
    cuts, own = np.flatnonzero(this.sweep.axis == axis), np.flatnonzero(this.curve.axis == axis)
    if len(cuts) > 1:
        want = np.stack([this.sweep.position[cuts], this.sweep.cost[cuts]], axis=1)
        np.testing.assert_allclose(chart.curve(GREEN), want, **slack)
    # Every second line is flat: the step of a candidate, which stands above or below it.
    steps = chart.lines(BLUE)[::2]
    own = own[np.argsort(this.curve.position[own], kind="stable")]
    assert len(steps) == (0 if builder == "sweep_sah" else len(own))
    for (begin, end), candidate in zip(steps, own, strict=False):
        assert begin[0] - slack["atol"] <= this.curve.position[candidate] <= end[0] + slack["atol"]
        np.testing.assert_allclose([begin[1], end[1]], this.curve.cost[candidate], **slack)


def test_a_root_that_is_a_leaf_has_no_plane_that_was_taken(build):
    scene = Scene.from_triangles(np.random.default_rng(1).random((4, 3, 3)), "few")
    tree = build("bvh", scene, "max_leaf_size=4,C_trav=50", log=True)
    picture = CostCurve(tree, tree.build_log, SILENT).picture(Settings(0))
    assert not (picture.colours == RED).all(axis=1).any()
    assert picture.caption.endswith("a leaf")
