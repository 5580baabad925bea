"""Lesson "csg_intervals": bars are what solids share; the hit is the first end of the last one."""

import numpy as np
from accelscope.core.geometry.csg.description import Intersection
from accelscope.core.geometry.solids.description import Box, Sphere
from accelscope.core.scene import Scene


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
