"""Lesson "ploc": the clusters shown are those of every iteration of the builder itself."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import MERGE
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons.drawing import BLUE, ORANGE
from accelscope.core.lessons.ploc import Clusters, Settings, was_clustered
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.builders.bottom_up import ploc
from accelscope.core.structures.bvh.builders.morton.codes import MortonSettings, sort_by_code
from accelscope.core.structures.bvh.topology.tree import leaves_only


@pytest.mark.parametrize("optimise", ["none", "reinsert", "treelet"])
def test_the_clusters_shown_are_those_of_every_iteration(muddle, build, read_charts, optimise):
    bvh = build("bvh", muddle, f"builder=ploc,optimise={optimise}", log=True)
    play = Clusters(bvh, bvh.build_log, SILENT)
    shots, boxes = play.shots, boxes_of(muddle.triangles)
    with Team(SILENT, "testing") as team:
        _, order = sort_by_code(boxes, MortonSettings(), team)
        tree = leaves_only(boxes[order])
        assert np.array_equal(shots[0].boxes, boxes[order])
        made = len(boxes)
        for shot, nodes in zip(shots[1:], ploc.iterations(tree, 14, team), strict=True):
            assert np.array_equal(shot.boxes, tree.boxes[nodes])
            assert np.array_equal(shot.is_new, nodes >= made)
            assert shot.total == len(nodes)
            made += int(shot.is_new.sum())
    assert [shot.total for shot in shots] == bvh.figures["clusters"]
    assert (bvh.build_log.kind == MERGE).sum() == len(boxes) - 1
    for number, shot in enumerate(shots):
        picture = play.picture(Settings(number))
        count = 12 * len(shot.boxes)
        assert np.array_equal(picture.segments[:count], box_segments(shot.boxes))
        bright = picture.colours[:count:12, 3] == 1.0
        assert np.array_equal(bright, shot.is_new)
        (chart,) = read_charts(play, Settings(number))
        left = np.log10(bvh.figures["clusters"])
        curve = np.stack([np.arange(len(left)), left], axis=1)
        np.testing.assert_allclose(chart.curve(BLUE), curve, atol=1e-9)
        np.testing.assert_allclose(chart.lines(ORANGE)[0, 1], curve[number], atol=1e-9)


def test_other_trees_and_meshes(lab, build, play_lesson):
    assert "ploc" in was_clustered(build("bvh", lab.small_scene("soup"), log=True))
    played = play_lesson("ploc", lab.small_scene("one"))
    assert played.play.ends == {"iteration": 0}
    assert np.isfinite(played.picture().points()).all()
