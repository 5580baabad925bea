"""Lesson "phr": clusters, counts and plane of every split are those that the tree was built by."""

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons.drawing import BLUE, ORANGE, RED
from accelscope.core.lessons.phr import Refinement, Settings, was_refined
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.topology.tree import ranges_of
from accelscope.sample_scenes import make_sample


def drawn_in(picture, colour):
    return picture.segments[(picture.colours == colour).all(axis=1)]


@pytest.mark.parametrize("text", ["", ",max_leaf_size=1,cut_delta=3", ",optimise=rotate,arity=4"])
def test_what_is_drawn_is_what_was_divided(muddle, build, text):
    bvh = build("bvh", muddle, f"builder=phr{text}", log=True)
    play = Refinement(bvh, bvh.build_log, SILENT)
    auxiliary, boxes = play.auxiliary, muddle.boxes()
    # The tree of the builder itself, by the same splits; one reference a leaf, as the lesson has.
    tree = build("bvh", muddle, f"builder=phr{text.partition(',optimise')[0]}", log=True)
    begin, end = ranges_of(tree.arrays.first, tree.arrays.size, tree.width())
    of_node = tree.build_log.cells
    assert len(play.splits) == 100 or len(play.splits) == len(tree.build_log)
    for number, split in enumerate(play.splits):
        picture = play.picture(Settings(number))
        event = play.events[number]
        for clusters, colour, side in ((split.left, BLUE, 0), (split.right, ORANGE, 1)):
            inside = np.concatenate(
                [auxiliary.order[auxiliary.begin[c] : auxiliary.end[c]] for c in clusters]
            )
            assert len(inside) == play.log.counts[event, side]
            segments = drawn_in(picture, colour)[: 12 * len(clusters)]
            assert np.array_equal(segments, box_segments(auxiliary.boxes[clusters]))
            for cluster in clusters[:20]:
                below = auxiliary.order[auxiliary.begin[cluster] : auxiliary.end[cluster]]
                around = [*boxes[below, :3].min(axis=0), *boxes[below, 3:].max(axis=0)]
                assert auxiliary.boxes[cluster].tolist() == around
            if "optimise" not in text:
                child = of_node[tree.build_log.children[event, side]]
                there = tree.triangles.ids[begin[child] : end[child]]
                assert np.array_equal(np.sort(inside), np.sort(there))
        axis = play.log.axis[event]
        if axis >= 0:
            assert (drawn_in(picture, RED)[..., axis] == play.log.position[event]).all()
        assert f" {len(split.left) + len(split.right)} clusters in place of {split.triangles}" in (
            picture.caption
        )


def test_cuts_are_shorter_than_what_they_stand_for(play_lesson):
    played = play_lesson("phr")
    finer = play_lesson("phr", make_sample("suzanne:subdivisions=3")).play.splits[0]
    assert finer.triangles == 4 * played.play.splits[0].triangles
    assert len(finer.left) + len(finer.right) < 250
    first, last = played.play.splits[0], played.play.splits[-1]
    assert 10 * (len(first.left) + len(first.right)) < first.triangles
    assert len(first.left) + len(first.right) > len(last.left) + len(last.right)
    assert int(played.row("Opened", split=0)) == len(first.left) + len(first.right) - 1


@pytest.mark.parametrize("name", ["one", "flat", "mess"])
def test_other_meshes(lab, play_lesson, name):
    played = play_lesson("phr", lab.small_scene(name))
    for number in range(played.play.ends["split"] + 1):
        assert np.isfinite(played.picture(split=number).points()).all()


def test_who_has_cuts(lab, build):
    scene = lab.small_scene("soup")
    assert was_refined(build("bvh", scene, "builder=phr", log=True)) == ""
    assert "log" in was_refined(build("bvh", scene, "builder=phr"))
    assert "phr" in was_refined(build("bvh", scene, log=True))
