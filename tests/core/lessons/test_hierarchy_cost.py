"""Lesson "hierarchy_cost": N_TS against log2 N is what rays count in a BVH over each part."""

import numpy as np
import pytest
from accelscope.core.contract.events import TEST, VISIT_INNER, VISIT_LEAF
from accelscope.core.lessons.growth import fitted_line
from accelscope.core.structures import structures


@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat"])
def test_figures_are_the_counters_of_trees_over_the_parts(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("hierarchy_cost", scene)
    play, growth = played.play, played.play.growth
    assert growth.counts[-1] == len(scene)
    assert ((growth.counts[1:] + 1) // 2 <= growth.counts[:-1]).all()
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
    kind = structures()["bvh"]
    _, counts = kind.build(scene, kind.Settings()).trace(growth.rays)
    assert counts["N_TS"].mean() == play.steps[-1]


def test_it_is_logarithmic_on_the_sample(play_lesson):
    """From 64 triangles on, N_TS is no power of N that one could take for a cost like N."""
    play = play_lesson("hierarchy_cost").play
    large = play.growth.counts >= 64
    x, steps = play.logarithm[large], play.steps[large]
    power = fitted_line(x, np.log2(steps))[1]
    assert power < 0.35
    assert play.line[1] > 0.0
    assert play.steps[-1] < 0.01 * play.growth.counts[-1]


def test_a_line_is_fitted_by_least_squares():
    assert fitted_line(np.array([0.0, 1, 2]), np.array([1.0, 3, 5])) == (1.0, 2.0)
    assert fitted_line(np.array([4.0]), np.array([7.0])) == (7.0, 0.0)
