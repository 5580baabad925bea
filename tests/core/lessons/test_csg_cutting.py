"""Lesson "csg_cutting": what is drawn and counted is what cutting has made of the tree."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.csg.cutting import CUT, CuttingSettings, cutting_of
from accelscope.core.geometry.csg.description import Difference
from accelscope.core.geometry.solids.description import Box, Sphere
from accelscope.core.lessons.drawing import GREEN, RED
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample


def test_volumes_are_those_of_the_closed_form(play_lesson):
    """The classic: cube and sphere of volumes 8 and 2.7^3, cylinders of 1.1 x 1.1 x 4."""
    lesson = play_lesson("csg_cutting")
    total = 8 + 2.7**3 + 3 * 1.1**2 * 4
    after = 8 + 8 + 3 * 1.1**2 * 2
    assert lesson.row("Volume of Leaves", passes=0) == f"{total:.4g}"
    assert lesson.row("Volume of Leaves", passes=2) == f"{total:.4g}, now {after:.4g}"
    assert lesson.play.ends["passes"] == 3  # up, down, and up once more, where nothing changes


def test_pruned_branches_are_crossed_out(play_lesson):
    """A ball beside the cube takes nothing away; the second pass finds out."""
    tree = Difference([Difference([Box((0, 0, 0), (1, 1, 1)), Sphere((5, 0, 0), 1)]),
                       Sphere((1, 1, 1), 0.5)])  # fmt: skip
    lesson = play_lesson("csg_cutting", Scene.from_trees([tree], "beside"))
    red = [(lesson.picture(passes=n).colours == RED).all(axis=1).sum() for n in range(3)]
    assert red == [0, 0, 2]
    assert "1 is pruned by now" in lesson.picture(passes=2).caption


def test_green_frames_are_the_changed_nodes(play_lesson):
    scene = make_sample("csg_rook")
    lesson = play_lesson("csg_cutting", scene)
    cutting = cutting_of(scene.geometry, CuttingSettings(CUT, "aabb"))
    for number in range(2, lesson.play.ends["passes"] + 1):
        green = (lesson.picture(passes=number).colours == GREEN).all(axis=1).sum()
        nodes = np.intersect1d(cutting.passes[number - 1].changed, lesson.play.tree.nodes)
        assert green == 4 * len(nodes)


def test_a_scene_without_trees_is_refused(play_lesson):
    with pytest.raises(InputError, match="the scene has no CSG trees"):
        play_lesson("csg_cutting", make_sample("tetra:size=1"))
    with pytest.raises(InputError, match="the scene has no CSG trees"):
        play_lesson("csg_intervals", make_sample("balls:size=1"))
