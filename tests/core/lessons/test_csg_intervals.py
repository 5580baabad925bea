"""Lesson "csg_intervals": bars are what solids share; the hit is the first end of the last one."""

import numpy as np
from accelscope.core.geometry.csg.description import Intersection
from accelscope.core.geometry.csg.trees import DIFFERENCE, INTERSECTION, UNION
from accelscope.core.geometry.solids.description import Box, Sphere
from accelscope.core.lessons.csg_intervals import FOUND, MISSED
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample


def test_intervals_are_those_of_the_solids(play_lesson):
    """Along x through a cube and a ball that share x from 0 to 1."""
    tree = Intersection([Box((-1, -1, -1), (1, 1, 1)), Sphere((1, 0, 0), 1)])
    played = play_lesson("csg_intervals", Scene.from_trees([tree], "lens"))
    done = {each.node: each for each in played.play.done}
    box, ball, both = done[1].intervals, done[2].intervals, done[0].intervals
    low, high = max(box[0, 0], ball[0, 0]), min(box[0, 1], ball[0, 1])
    np.testing.assert_array_equal(both, [[low, high]])
    assert played.play.hit == low
    assert [each.node for each in played.play.done] == [1, 2, 0]


def is_within(intervals, t):
    return ((intervals[:, 0] < t[:, None]) & (t[:, None] < intervals[:, 1])).any(axis=1)


def test_each_bar_is_what_the_operation_makes_of_those_below(play_lesson):
    """Also where an operand was missed or not asked, and the walk went on with the other one."""
    n_missed = 0
    for spec in ("csg_plate:holes=4", "csg_chain:size=12", "csg_rook"):
        played = play_lesson("csg_intervals", make_sample(spec))
        nodes = played.play.tree.geometry.pruned
        done = {each.node: each for each in played.play.done}
        ends = np.unique(np.concatenate([each.intervals.ravel() for each in done.values()]))
        middles = 0.5 * (ends[1:] + ends[:-1])
        inner = [each for each in done.values() if each.how == FOUND and nodes.left[each.node] >= 0]
        for each in inner:
            left, right = done[nodes.left[each.node]], done[nodes.right[each.node]]
            a, b = is_within(left.intervals, middles), is_within(right.intervals, middles)
            want = {UNION: a | b, INTERSECTION: a & b, DIFFERENCE: a & ~b}[nodes.kind[each.node]]
            np.testing.assert_array_equal(is_within(each.intervals, middles), want)
            n_missed += right.how == MISSED and len(each.intervals) > 0
    assert n_missed > 1
