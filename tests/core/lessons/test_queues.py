"""Lesson "split_queues": the queues drawn from the log are those that the builder had."""

import dataclasses

import numpy as np
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons.queues import EMPTY, Settings, SplitQueues, queues_of
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVH, BVHSettings
from accelscope.core.structures.bvh.builders.top_down import parallel_sah
from accelscope.core.structures.bvh.builders.top_down.parallel_split import data_parallel_rules
from accelscope.core.structures.bvh.builders.top_down.recursion import room_for
from accelscope.core.structures.bvh.topology.tree import Primitives, ranges_of


def levels_of_the_builder(scene, settings):
    """The queues of the builder itself."""
    primitives = Primitives(scene.geometry, scene.boxes())
    make_rule, _ = data_parallel_rules(primitives, settings)
    tree, splits = room_for(len(scene), False)
    return list(parallel_sah.levels_of(make_rule, len(scene), tree, splits, SILENT))


def test_the_queues_shown_are_those_of_the_builder(lab):
    scene = lab.small_scene("suzanne")
    settings = dataclasses.replace(BVHSettings(), builder="parallel_sah")
    levels = levels_of_the_builder(scene, settings)
    tree = BVH.build(scene, settings, log=True)
    begin, end = ranges_of(tree.arrays.first, tree.arrays.size, tree.width())
    shown = queues_of(tree.build_log)
    assert len(shown) == len(levels)
    for queues, level in zip(shown, levels, strict=True):
        for nodes, rows in zip(queues, level, strict=True):
            there = rows[:, parallel_sah.NODE] != parallel_sah.EMPTY
            assert np.array_equal(nodes != EMPTY, there)
            assert np.array_equal(begin[nodes[there]], rows[there, parallel_sah.FIRST])
            assert np.array_equal((end - begin)[nodes[there]], rows[there, parallel_sah.COUNT])
    picture = SplitQueues(tree, tree.build_log, SILENT).picture(Settings(2, False))
    boxes = tree.arrays.volumes.boxes()[shown[2].input]
    assert np.array_equal(picture.segments[: 12 * len(boxes)], box_segments(boxes))


def test_lengths_and_shares(play_lesson):
    played = play_lesson("split_queues")
    (tree,) = played.subject.structures
    lengths, splits = (tree.figures[f"queue_{name}"] for name in ("lengths", "splits"))
    assert played.play.ends["level"] == len(lengths) - 1
    for level, (m, n_split) in enumerate(zip(lengths, splits, strict=True)):
        before, after = (played.picture(level=level, compacted=done) for done in (False, True))
        assert f"{m} in the input queue, {2 * n_split} of {2 * m} places" in before.caption
        assert f"{100 * n_split / m:.0f}% occupied" in before.caption
        assert f"{2 * m} places become {2 * n_split}" in after.caption
        texts = [f"input: m = {m}", f"output: 2 m = {2 * m}", f"compacted: {2 * n_split}"]
        assert [mark.text for mark in after.marks] == texts
        assert [mark.text for mark in before.marks] == texts[:2]
    # One line from each node that was split to each child: of the first level, and its box.
    assert len(played.picture(level=0, compacted=False).segments) == 12 + 2 + 8 + 2 * 8


def test_a_tree_of_one_leaf(lab, play_lesson):
    played = play_lesson("split_queues", lab.small_scene("one"))
    assert played.play.ends == {"level": 0}
    assert "0 of 2 places" in played.picture(compacted=False).caption
