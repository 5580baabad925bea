"""Lesson "spatial_splits": sides, parts and cut triangles are those of the builder itself."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import FIT, SPLIT
from accelscope.core.errors import InputError
from accelscope.core.lessons.drawing import BLUE, ORANGE, RED
from accelscope.core.lessons.sbvh import Settings, SpatialSplits, side_of
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders.spatial.sbvh import Construction
from accelscope.core.structures.bvh.topology.tree import Primitives


def splits_one_by_one(scene, settings):
    """Yield of every split, breadth-first, what went to either side, from the builder itself."""
    work = Construction(Primitives(scene.geometry, scene.boxes()), settings)
    waiting = [work.root]
    while waiting:
        node = waiting.pop(0)
        children = work.split(node)
        waiting += children
        if children:
            sides = []
            for child in children:
                these = slice(child.first, child.first + child.size)
                ids = work.references.triangle[these]
                order = np.argsort(ids)
                sides.append((ids[order], work.references.boxes[these][order]))
            yield node.size, sides


@pytest.mark.parametrize(("optimise", "arity"), [("none", "2"), ("none", "4"), ("reinsert", "2")])
def test_spatial_splits_that_are_shown(muddle, build, optimise, arity):
    bvh = build("bvh", muddle, f"builder=sbvh,optimise={optimise},arity={arity}", log=True)
    log, play = bvh.build_log, SpatialSplits(bvh, bvh.build_log, SILENT)
    events = np.flatnonzero(log.kind == SPLIT)
    settings = bvh.settings
    if optimise != "none":
        settings = BVH.Settings(builder="sbvh", max_leaf_size=1)
    witness, shown = list(splits_one_by_one(muddle, settings)), 0
    assert len(witness) == len(events)
    for event, (size, sides) in zip(events, witness, strict=True):
        assert play.descent.size[log.node[event]] == size
        assert log.counts[event].tolist() == [len(ids) for ids, _ in sides]
        for child, (ids, boxes) in zip(log.children[event], sides, strict=True):
            found, around = side_of(bvh, log, play.descent, int(child))
            assert np.array_equal(found, ids)
            # Parts of a triangle leave out what of its box has none of it, and rounding.
            assert (around[:, :3] >= boxes[:, :3]).all()
            assert (around[:, 3:] <= boxes[:, 3:]).all()
            np.testing.assert_allclose(around, boxes, atol=1e-9)
        if log.counts[event].sum() > size and shown <= play.ends["split"]:
            picture = play.picture(Settings(shown))
            both = len(np.intersect1d(sides[0][0], sides[1][0]))
            assert both == log.counts[event].sum() - size
            axis, position = log.axis[event], log.position[event]
            is_red = (picture.face_colours[:, :3] == RED[:3]).all(axis=1)
            assert is_red.sum() == 2
            assert (picture.faces[is_red][..., axis] == position).all()
            n_left, n_right = (len(ids) for ids, _ in sides)
            assert f"divides {size} references into {n_left} (blue) and " in picture.caption
            assert f"{n_right} (orange); {both} triangle" in picture.caption
            for (_, boxes), colour in zip(sides, (BLUE, ORANGE), strict=True):
                outer = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
                drawn = picture.segments[(picture.colours == colour).all(axis=1)]
                ends = drawn[:12].reshape(-1, 3)
                drawn = np.concatenate([ends.min(axis=0), ends.max(axis=0)])
                np.testing.assert_allclose(drawn, outer, atol=1e-9)
            shown += 1
    assert shown == play.ends["split"] + 1 > 0
    made = bvh.figures["spatial_splits"]
    assert shown == min(sum(made), 12)
    for number, depth in enumerate(np.repeat(np.arange(len(made)), made)[:shown].tolist()):
        assert f"at depth {depth}:" in play.picture(Settings(number)).caption
    assert not (log.kind == FIT).any() or optimise != "none"


@pytest.mark.parametrize("name", ["one", "flat"])
def test_without_a_cut_it_says_what_to_do(lab, play_lesson, name):
    with pytest.raises(InputError, match="large triangles beside small ones"):
        play_lesson("spatial_splits", lab.small_scene(name))


def test_items_that_are_no_triangles(lab, play_lesson):
    played = play_lesson("spatial_splits", lab.small_scene("gears"))
    for split in range(played.play.ends["split"] + 1):
        assert np.isfinite(played.picture(split=split).points()).all()
