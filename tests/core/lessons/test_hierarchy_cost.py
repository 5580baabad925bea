"""Lesson "hierarchy_cost": N_TS against log2 N is what rays count in a BVH over each part."""

import numpy as np
import pytest
from accelscope.core.contract.events import TEST, VISIT_INNER, VISIT_LEAF
from accelscope.core.lessons.drawing import BLUE, GREEN, RED
from accelscope.core.lessons.growth import fitted_line
from accelscope.core.lessons.hierarchy_cost import Settings
from accelscope.core.structures import structures


@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat"])
def test_figures_are_the_counters_of_trees_over_the_parts(lab, play_lesson, read_charts, name):
    scene = lab.small_scene(name)
    played = play_lesson("hierarchy_cost", scene)
    play, growth = played.play, played.play.growth
    assert growth.counts[-1] == len(scene)
    assert ((growth.counts[1:] + 1) // 2 <= growth.counts[:-1]).all()
    shown = []
    for place, (count, tree) in enumerate(zip(growth.counts, growth.trees, strict=True)):
        assert len(tree.scene) == count
        assert not tree.validate()
        _, counts = tree.trace(growth.rays)
        assert counts["N_TS"].mean() == play.steps[place]
        assert counts["N_IT"].mean() == play.tests[place]
        # The walk that is drawn is one of those that were counted.
        walk = play.walks[place]
        visits = len(walk.events_of(VISIT_INNER)) + len(walk.events_of(VISIT_LEAF))
        assert visits == counts["N_TS"][growth.middle]
        assert len(walk.events_of(TEST)) == counts["N_IT"][growth.middle]
        (chart,) = read_charts(play, Settings(place))
        means = {name: counts[name].mean() for name in ("N_TS", "N_IT")}
        texts = {(mark.text, mark.colour) for mark in chart.picture.marks}
        assert (f"N_TS = {means['N_TS']:.1f}", BLUE[:3]) in texts
        assert (f"N_IT = {means['N_IT']:.1f}", GREEN[:3]) in texts
        shown.append([np.log2(count), means["N_TS"], means["N_IT"]])
    x, steps, tests = np.transpose(shown)
    np.testing.assert_allclose(chart.stars(BLUE), np.stack([x, steps], axis=1), atol=1e-9)
    if len(shown) > 1:
        np.testing.assert_allclose(chart.curve(GREEN), np.stack([x, tests], axis=1), atol=1e-9)
    np.testing.assert_allclose(chart.lines(RED)[0], [(x[-1], 0.0), (x[-1], steps[-1])], atol=1e-9)
    kind = structures()["bvh"]
    _, counts = kind.build(scene, kind.Settings()).trace(growth.rays)
    assert counts["N_TS"].mean() == play.steps[-1]


def test_it_is_logarithmic_on_the_sample(play_lesson):
    """From 64 triangles on, N_TS is no power of N that one could take for a cost like N.

    Lines and parts are always the same, so that the figures are, too: the power is 0.222 and the
    whole has 0.25% of N; bounds are a tenth and a fifth above.
    """
    play = play_lesson("hierarchy_cost").play
    large = play.growth.counts >= 64
    x, steps = play.logarithm[large], play.steps[large]
    power = fitted_line(x, np.log2(steps))[1]
    assert power < 0.25
    assert play.line[1] > 0.0
    assert play.steps[-1] < 0.003 * play.growth.counts[-1]


def test_a_line_is_fitted_by_least_squares():
    assert fitted_line(np.array([0.0, 1, 2]), np.array([1.0, 3, 5])) == (1.0, 2.0)
    assert fitted_line(np.array([4.0]), np.array([7.0])) == (7.0, 0.0)
