"""Lesson "axis_choice": planes and costs are those of both trees; turns are x, y, z."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import SPLIT
from accelscope.core.lessons.drawing import RED


@pytest.mark.parametrize("name", [None, "mess", "flat", "one"])
def test_the_planes_are_those_of_both_trees(lab, play_lesson, name):
    scene = lab.small_scene(name) if name else None
    played = play_lesson("axis_choice", scene)
    trees, shown = played.subject.structures, played.play.trees
    for level in range(played.play.ends["level"] + 1):
        picture = played.picture(level=level)
        caption, planes = picture.caption, 0
        for tree in trees:
            log = tree.build_log
            nodes = log.cells[log.node]
            here = (log.kind == SPLIT) & (tree.depths()[nodes] == level) & (log.axis >= 0)
            planes += int(here.sum())
            for axis in range(3):
                if count := int((log.axis[here] == axis).sum()):
                    assert f"{count} across {'xyz'[axis]}" in caption
        is_red = (picture.face_colours[:, :3] == RED[:3]).all(axis=1)
        assert is_red.sum() == 2 * planes
        assert (picture.colours == RED).all(axis=1).sum() == 4 * planes
    for tree, each in zip(trees, shown, strict=True):
        assert each.cost == tree.statistics().sah


def test_axes_take_turns_on_the_left(play_lesson):
    played = play_lesson("axis_choice")
    left, right = played.play.trees
    assert left.name.startswith("Round-robin")
    # Of the levels shown; below, some nodes have nothing to tell apart along the axis in turn.
    divided = (left.axis >= 0) & (left.depths <= played.play.ends["level"])
    assert np.array_equal(left.axis[divided], left.depths[divided] % 3)
    assert right.cost < left.cost
    divided = (right.axis >= 0) & (right.depths <= played.play.ends["level"])
    assert (right.axis[divided] != right.depths[divided] % 3).any()
